"""`paramove node`: lists the nodes on the bus; stops, starts or restarts one."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal

import psutil
import typer

from paramove.bus import inspection, topics
from paramove.cli import completions
from paramove.cli.bus_options import DomainOption, bus_folder, show
from paramove.cli.output import JsonOption, ended
from paramove.documents import InputError, exit_codes, nearest, printable, read_document
from paramove.msgs.node_status_pb2 import NodeStatus, TopicCount
from paramove.supervision import NodeRow, NoRunError, Request, ask

app = typer.Typer(name="node", help="Look at the nodes on the bus; stop, start or restart one.", no_args_is_help=True)

NameArgument = Annotated[str, typer.Argument(help="name in the launch file", autocompletion=completions.nodes)]
WaitOption = Annotated[float, typer.Option("--wait", min=0.0, metavar="SECONDS", help="for it to be done")]
LOOK_PERIOD_S = 0.05


@app.command("list")
def list_nodes(
    domain: DomainOption = None,
    as_json: JsonOption = False,
    seconds: Annotated[float, typer.Option(min=0.1, help="how long to wait for an answer")] = 2.0,
) -> None:
    """List the nodes: state, their own status, messages, losses, seconds spent, restarts and last end."""
    folder = bus_folder(domain)
    try:
        supervised = {row.node: row for row in ask(folder, Request(do="list")).nodes}
    except NoRunError:  # nodes that were started one by one
        supervised = {}
    statuses = inspection.statuses(folder, seconds)
    nodes = {**supervised, **statuses}
    rows = [_row(node, statuses.get(node), node in statuses, supervised.get(node), seconds) for node in nodes]
    if not rows and not as_json:
        typer.echo("no node is on the bus")
    show(rows, as_json)


@app.command()
def info(
    name: NameArgument,
    domain: DomainOption = None,
    as_json: JsonOption = False,
    seconds: Annotated[float, typer.Option(min=0.1, help="how long to wait for an answer")] = 2.0,
) -> None:
    """Show one node: state, process, its topics with the other nodes at them, and its parameters.

    Parameters are those that the launch file gave, on this host; others have their defaults.

    Exit codes: 0 done; 1 nothing runs, or there is no such node.
    """
    statuses = inspection.statuses(bus_folder(domain), seconds)
    if name not in statuses:
        raise ended(f"there is no node '{name}'; {nearest(name, statuses)}", exit_codes.FAILURE)
    status = statuses[name]
    if status is None:
        raise ended(f"{name} is alive, but did not answer within {seconds:g} s", exit_codes.FAILURE)
    others = {node: other for node, other in statuses.items() if other is not None and node != name}
    facts: dict[str, Any] = {
        "node": name,
        "state": _state_of(status),
        "sentence": status.detail,
        "pid": status.pid,
        "subscribes": [
            _topic_of_node(count, [node for node, other in others.items() if _has(other.published, count.topic)])
            for count in status.received
        ],
        "publishes": [
            _topic_of_node(count, [node for node, other in others.items() if _has(other.received, count.topic)])
            for count in status.published
        ],
        "parameters": _parameters_of(status.pid),
    }
    if as_json:
        typer.echo(json.dumps(facts, indent=2))
        return
    typer.echo(f"{name}: {facts['state']}, pid {status.pid}, {printable(status.detail)}")
    for what in ("subscribes", "publishes"):
        typer.echo(f"{what}:" if facts[what] else f"{what} nothing")
        show([row | {"with": ", ".join(row["with"])} for row in facts[what]], as_json=False)
    typer.echo("parameters:" if facts["parameters"] else "parameters: defaults")
    for key, value in facts["parameters"].items():
        typer.echo(f"  {key}: {json.dumps(value)}")


def _topic_of_node(count: TopicCount, nodes: list[str]) -> dict[str, Any]:
    try:
        kind = topics.by_name(count.topic).type_name
    except KeyError:  # remapped, or of another workspace
        kind = ""
    return {"topic": count.topic, "type": kind, "messages": count.messages, "lost": count.lost, "with": nodes}


def _has(counts: Iterable[TopicCount], topic: str) -> bool:
    return any(count.topic == topic for count in counts)


def _state_of(status: NodeStatus) -> str:
    return str(NodeStatus.State.Name(status.state)).removeprefix("STATE_").lower()


def _parameters_of(pid: int) -> dict[str, Any]:
    """Of the configuration with which a node on this host was started; {} if that cannot be read."""
    with contextlib.suppress(psutil.Error, InputError, ValueError):
        words = psutil.Process(pid).cmdline()
        file = read_document(Path(words[words.index("--config") + 1]), "configuration of a node")
        parameters: dict[str, Any] = file.data.get("parameters", {})
        return parameters
    return {}


@app.command()
def stop(name: NameArgument, domain: DomainOption = None, wait_s: WaitOption = 10.0) -> None:
    """Stop one node. Stopping a required one with `restart: never` ends the run; no other does."""
    _do("stop", name, bus_folder(domain), wait_s)


@app.command()
def start(name: NameArgument, domain: DomainOption = None, wait_s: WaitOption = 40.0) -> None:
    """Start a node that has ended or was stopped, and wait until it is ready."""
    _do("start", name, bus_folder(domain), wait_s)


@app.command()
def restart(name: NameArgument, domain: DomainOption = None, wait_s: WaitOption = 40.0) -> None:
    """Stop one node, start it again, and wait until it is ready. An arm's driver comes back disarmed."""
    _do("restart", name, bus_folder(domain), wait_s)


def _do(action: Literal["stop", "start", "restart"], name: str, folder: Path, wait_s: float) -> None:
    """Sends a request to the supervisor and follows its result."""
    try:
        before = _supervised(folder, name)
        if before is None:
            known = [row.node for row in ask(folder, Request(do="list")).nodes]
            raise ended(f"there is no node '{name}'; {nearest(name, known)}", exit_codes.FAILURE)
        answer = ask(folder, Request(do=action, node=name))
        if not answer.ok:
            raise ended(answer.sentence, exit_codes.FAILURE)
        row = _followed(folder, name, action, wait_s, None if action == "stop" else before.pid)
    except NoRunError as error:
        raise ended(str(error), exit_codes.FAILURE) from None
    if row is None:
        typer.echo(f"{name}: {action} is done, and the run has ended with it")
        return
    typer.echo(f"{name} is {row.state}: {row.sentence}")
    if row.state not in (("stopped",) if action == "stop" else ("ready", "degraded")):
        raise typer.Exit(exit_codes.FAILURE)


def _followed(folder: Path, name: str, action: str, wait_s: float, old_pid: int | None) -> NodeRow | None:
    """The node's row once the action has come to its end or the timeout is over; None if the run has ended."""
    ends = ("stopped", "given up") if action == "stop" else ("ready", "degraded", "failed", "given up", "restarting")
    end_s = time.monotonic() + wait_s
    while True:
        try:
            row = _supervised(folder, name)
        except NoRunError:
            return None
        if row is None or time.monotonic() > end_s:
            return row
        if row.state in ends and (row.pid is None or row.pid != old_pid):
            return row
        time.sleep(LOOK_PERIOD_S)


def _supervised(folder: Path, name: str) -> NodeRow | None:
    return next((row for row in ask(folder, Request(do="list")).nodes if row.node == name), None)


def _row(
    node: str, status: NodeStatus | None, alive: bool, supervised: NodeRow | None, seconds: float
) -> dict[str, Any]:
    """A line of the list, from the node's status and its supervisor."""
    if status is None:
        status = NodeStatus(detail=f"alive, did not answer within {seconds:g} s" if alive else "")
    state = _state_of(status) if status.state else "busy"
    return {
        "node": node,
        "state": supervised.state if supervised else state,
        "pid": status.pid or (supervised.pid if supervised else None),
        "processed": status.processed,
        "seconds": round(status.processing_seconds, 3),
        "received": sum(count.messages for count in status.received),
        "lost": sum(count.lost for count in status.received),
        "refused": sum(count.rejected for count in status.received),
        "restarts": supervised.restarts if supervised else None,
        "last_end": supervised.exit_reason if supervised else "",
        "sentence": status.detail or (supervised.sentence if supervised else ""),
    }
