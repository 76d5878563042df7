"""`paramove param`: parameters that change while a node runs."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from paramove.bus import TopicTakenError, inspection, nodes_in
from paramove.cli import completions
from paramove.cli.bus_options import DomainOption, bus_folder, show
from paramove.cli.output import JsonOption, ended, one_line
from paramove.client import NoMessageError, Run, parameter_of, parameters_of, set_parameter
from paramove.documents import InputError, exit_codes, nearest
from paramove.msgs.node_status_pb2 import NodeParameter

app = typer.Typer(name="param", help="Look at and change parameters of nodes that run.", no_args_is_help=True)

NodeArgument = Annotated[str, typer.Argument(help="name in the launch file", autocompletion=completions.nodes)]
NameArgument = Annotated[str, typer.Argument(help="name of the parameter")]
WaitOption = Annotated[float, typer.Option("--wait", min=0.1, metavar="SECONDS", help="for the node's answer")]


@app.command("list")
def list_parameters(
    node: Annotated[str, typer.Argument(help="only of this node", autocompletion=completions.nodes)] = "",
    domain: DomainOption = None,
    as_json: JsonOption = False,
    wait_s: WaitOption = 5.0,
) -> None:
    """List the parameters that may change while their nodes run, with their values.

    All parameters of a launch file: `paramove launch NAME --show-args`; those that it gives a node: `paramove node
    info`.
    """
    folder = bus_folder(domain)
    if node:
        with _connected(folder, node) as run:
            rows = [_row(node, parameter) for parameter in parameters_of(run, node, wait_s).values()]
    else:
        statuses = inspection.statuses(folder, wait_s)
        answered = {name: status for name, status in statuses.items() if status is not None}
        rows = [_row(name, parameter) for name, status in answered.items() for parameter in status.parameters]
    if not rows and not as_json:
        typer.echo("no parameter changes while its node runs")
    show(rows, as_json)


@app.command()
def get(node: NodeArgument, name: NameArgument, domain: DomainOption = None, wait_s: WaitOption = 5.0) -> None:
    """Print the value of one of them, as JSON."""
    folder = bus_folder(domain)
    try:
        with _connected(folder, node) as run:
            typer.echo(parameter_of(run, node, name, wait_s).value)
    except InputError as error:
        raise ended(str(error), exit_codes.USAGE) from error


@app.command("set", context_settings={"ignore_unknown_options": True})  # a value may be -1
def set_value(
    node: NodeArgument,
    name: NameArgument,
    value: Annotated[str, typer.Argument(help="in YAML")],
    at_s: Annotated[
        float | None, typer.Option("--at", min=0.0, metavar="SECONDS", help="time of the run from which on it counts")
    ] = None,
    domain: DomainOption = None,
    wait_s: WaitOption = 5.0,
) -> None:
    """Change one of them. The change is recorded with its time.

    In simulated time it lands exactly at its time, 0.2 s later unless `--at` names another; a time that is over is
    rejected. In a run on several hosts the launcher's host changes the parameters of all of them.

    Exit codes: 0 accepted; 1 the node does not answer, or nothing runs; 75 another program changes parameters just
    now; 78 there is no such parameter, or the node does not take the value.
    """
    folder = bus_folder(domain)
    try:
        with one_line(), _connected(folder, node) as run:
            done = set_parameter(run, node, name, value, at_s, wait_s)
    except TopicTakenError as error:
        raise ended(str(error), exit_codes.TEMPORARY) from error
    typer.echo(f"{node}.{name} is {done.value}" if at_s is None else f"{node}.{name} changes at {at_s:g} s")


@contextlib.contextmanager
def _connected(folder: Path, node: str) -> Iterator[Run]:
    """A connection; ends the command with the nearest node if the node does not answer."""
    try:
        with Run(folder, "paramove param") as run:
            yield run
    except NoMessageError as error:
        running = nodes_in(folder)
        hint = "" if node in running else f"; {nearest(node, running)}"
        raise ended(f"{error}{hint}", exit_codes.FAILURE) from error


def _row(node: str, parameter: NodeParameter) -> dict[str, Any]:
    changed = 1e-9 * parameter.changed.ToNanoseconds() if parameter.HasField("changed") else None
    return {"parameter": f"{node}.{parameter.name}", "value": json.loads(parameter.value), "changed_s": changed}
