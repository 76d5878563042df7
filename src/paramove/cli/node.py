"""`paramove node`: the nodes on the bus."""

from __future__ import annotations

from typing import Annotated

import typer

from paramove.bus import inspection
from paramove.cli.bus_options import DomainOption, JsonOption, bus_folder, show
from paramove.msgs.node_status_pb2 import NodeStatus

app = typer.Typer(name="node", help="Look at the nodes on the bus.", no_args_is_help=True)


@app.callback()
def _group() -> None:
    """Look at the nodes on the bus."""


@app.command("list")
def list_nodes(
    domain: DomainOption = None,
    as_json: JsonOption = False,
    seconds: Annotated[float, typer.Option(min=0.1, help="how long to wait for an answer")] = 2.0,
) -> None:
    """List the nodes: state, what they say of themselves, messages, losses, seconds spent."""
    rows = []
    for node, status in inspection.statuses(bus_folder(domain), seconds).items():
        if status is None:
            status = NodeStatus(sentence=f"alive, did not answer within {seconds:g} s")
        state = NodeStatus.State.Name(status.state).removeprefix("STATE_").lower()
        rows.append(
            {
                "node": node,
                "state": state if status.state else "busy",
                "pid": status.pid or None,
                "processed": status.processed,
                "seconds": round(status.processing_seconds, 3),
                "heard": sum(count.messages for count in status.heard),
                "lost": sum(count.lost for count in status.heard),
                "refused": sum(count.refused for count in status.heard),
                "sentence": status.sentence,
            }
        )
    if not rows and not as_json:
        typer.echo("no node is on the bus")
    show(rows, as_json)
