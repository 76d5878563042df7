"""What a person may do to one node of a running application, and why not the rest.

A node stopped by hand ends no run, even a required one: somebody wanted it so. But a node with `restart: never` cannot
be started again within the run, because what it knows ends with it; so it is not restarted, and to stop a required one
ends the run. A node with `restart_ends_run` ends the run after a restart by hand, too.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from paramove.documents import nearest
from paramove.supervision.control import Answer
from paramove.supervision.supervised_node import ENDED, State, SupervisedNode


def answer(nodes: Mapping[str, SupervisedNode], request: Mapping[str, Any], ending: bool) -> Answer:
    """Does what a request asks for (`list`, `stop`, `start`, `restart`) or says why not.

    Args:
        nodes: Of the run.
        request: `do` and, but for `list`, `node`.
        ending: Whether the run is being ended.
    """
    do, name = request.get("do"), request.get("node")
    if do == "list":
        return {"ok": True, "sentence": "", "nodes": [_row(node) for node in nodes.values()]}
    if do not in _ACTIONS:
        return _no(f"'{do}' is nothing that can be done; there are: list, {', '.join(_ACTIONS)}")
    if not isinstance(name, str) or name not in nodes:
        return _no(f"there is no node '{name}'; {nearest(str(name), nodes)}")
    if ending:
        return _no("the run is ending; launch it again")
    node = nodes[name]
    refusal = _ACTIONS[do](node)
    if refusal:
        return _no(f"{name} {refusal}")
    return {"ok": True, "sentence": f"{name}: {do} by hand", "node": _row(node)}


def _stop(node: SupervisedNode) -> str:
    if node.state in ENDED:
        return f"does not run ({node.state.value})"
    if node.state is State.STOPPING:
        return "is being stopped already"
    node.stop_by_hand(time.monotonic())
    return ""


def _start(node: SupervisedNode) -> str:
    if node.state not in ENDED and node.state is not State.RESTARTING:
        return f"runs already ({node.state.value})" if node.is_running else f"is {node.state.value} {node.sentence}"
    if refusal := _once_only(node):
        return refusal
    node.start_by_hand(time.monotonic())
    return ""


def _restart(node: SupervisedNode) -> str:
    if not node.is_running:
        return _start(node)
    if node.state is State.STOPPING:
        return "is being stopped; start it when it has ended"
    if refusal := _once_only(node):
        return refusal
    node.stop_by_hand(time.monotonic(), restart=True)
    return ""


_ACTIONS = {"stop": _stop, "start": _start, "restart": _restart}


def _once_only(node: SupervisedNode) -> str:
    if node.settings.restart != "never":
        return ""
    return "cannot go on in a new process (restart: never in the launch file); end the run and launch it again"


def _no(sentence: str) -> Answer:
    return {"ok": False, "sentence": sentence}


def _row(node: SupervisedNode) -> dict[str, Any]:
    return {
        "node": node.name,
        "state": node.state.value,
        "sentence": node.sentence,
        "pid": node.pid if node.is_running else None,
        "restarts": node.restarts,
        "exit_reason": node.exit_reason,
    }
