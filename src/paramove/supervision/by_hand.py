"""Requests of a person to list, stop, start or restart nodes of a running application.

Stopping a node by hand does not end the run, not even that of a required node. But a node with `restart: never` cannot
be started again within the run, because its state is lost; so it is not restarted, and stopping a required one ends
the run. A node with `restart_ends_run` ends the run after a restart by hand, too.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

from paramove.documents import nearest
from paramove.supervision.messages import Answer, NodeRow, Request
from paramove.supervision.supervised_node import ENDED, State, SupervisedNode


def answer(nodes: Mapping[str, SupervisedNode], request: Request, ending: bool) -> Answer:
    """Executes a request (`list`, `stop`, `start`, `restart`) or answers why it is rejected.

    Args:
        nodes: Of the run.
        request: What to do, and with which node.
        ending: Whether the run is being ended.
    """
    do, name = request.do, request.node
    if do == "list":
        return Answer(ok=True, sentence="", nodes=[_row(node) for node in nodes.values()])
    if name is None or name not in nodes:
        return _rejected(f"there is no node '{name}'; {nearest(str(name), nodes)}")
    if ending:
        return _rejected("the run is ending; launch it again")
    node = nodes[name]
    rejection = _ACTIONS[do](node)
    if rejection:
        return _rejected(f"{name} {rejection}")
    return Answer(ok=True, sentence=f"{name}: {do} by hand", nodes=[_row(node)])


def _stop(node: SupervisedNode) -> str:
    if node.state in ENDED:
        return f"is not running ({node.state.value})"
    if node.state is State.STOPPING:
        return "is already being stopped"
    node.stop_by_hand(time.monotonic())
    return ""


def _start(node: SupervisedNode) -> str:
    if node.state not in ENDED and node.state is not State.RESTARTING:
        return f"is already running ({node.state.value})" if node.is_running else f"is {node.state.value} {node.detail}"
    if rejection := _not_restartable(node):
        return rejection
    node.start_by_hand(time.monotonic())
    return ""


def _restart(node: SupervisedNode) -> str:
    if not node.is_running:
        return _start(node)
    if node.state is State.STOPPING:
        return "is being stopped; start it when it has ended"
    if rejection := _not_restartable(node):
        return rejection
    node.stop_by_hand(time.monotonic(), restart=True)
    return ""


_ACTIONS = {"stop": _stop, "start": _start, "restart": _restart}


def _not_restartable(node: SupervisedNode) -> str:
    if node.settings.restart != "never":
        return ""
    return "cannot continue in a new process (restart: never in the launch file); end the run and launch it again"


def _rejected(message: str) -> Answer:
    return Answer(ok=False, sentence=message)


def _row(node: SupervisedNode) -> NodeRow:
    return NodeRow(
        node=node.name,
        state=node.state.value,
        sentence=node.detail,
        pid=node.pid if node.is_running else None,
        restarts=node.restarts,
        exit_reason=node.exit_reason,
    )
