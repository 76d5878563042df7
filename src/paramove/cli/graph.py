"""`paramove graph`: nodes and topics of a launch file, or of what is running."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.cli import completions
from paramove.cli.output import ended, one_line
from paramove.documents import exit_codes

if TYPE_CHECKING:
    from paramove.supervision import Graph

app = typer.Typer(add_completion=False)

MEASURED_S = 2.0


class Format(enum.Enum):
    """Format of the output."""

    TEXT = "text"
    MERMAID = "mermaid"
    SVG = "svg"


@app.command()
def graph(
    name: Annotated[
        str | None,
        typer.Argument(
            help="launch file, such as rule_learning; without one: what is running",
            autocompletion=completions.launch_files,
        ),
    ] = None,
    overlays: Annotated[
        list[str] | None,
        typer.Option("--with", metavar="OVERLAY", help="as in paramove launch", autocompletion=completions.overlays),
    ] = None,
    form: Annotated[Format, typer.Option("--format", help="for a terminal, a page or a picture")] = Format.TEXT,
    output: Annotated[Path | None, typer.Option(help="file to write instead of the terminal")] = None,
    live: Annotated[bool, typer.Option("--live", help="what is running in the domain, with measured rates")] = False,
    domain: Annotated[
        str | None, typer.Option("--domain", help="for --live", autocompletion=completions.domains)
    ] = None,
) -> None:
    """Draw which node publishes and subscribes to what, with rates; topics without publisher are marked.

    Nodes of a launch file are not run or imported for it.

    Exit codes: 0 done; 1 nothing is running; 66 no such launch file; 77 the output cannot be written; 78 the launch
    file is wrong.
    """
    from paramove.supervision import as_mermaid, as_svg, as_text

    graph = _running(domain) if live or name is None else _launched(name, overlays)
    text = {Format.TEXT: as_text, Format.MERMAID: as_mermaid, Format.SVG: as_svg}[form](graph)
    if output is None:
        typer.echo(text, nl=False)
        return
    try:
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ended(f"{output}: {error.strerror}; name another file with --output", exit_codes.PERMISSION) from None
    typer.echo(f"written to {output}")


def _launched(name: str, overlays: list[str] | None) -> Graph:
    from paramove.supervision import check_topics, graph_of, load
    from paramove.workspace import Workspace

    with one_line():
        workspace = Workspace.here()
        launch = load(workspace, name, overlays)
        return graph_of(launch, check_topics(launch, workspace))


def _running(domain: str | None) -> Graph:
    from paramove.cli.bus_options import bus_folder
    from paramove.supervision import running_graph

    folder = bus_folder(domain)
    graph = running_graph(folder, folder.name, MEASURED_S)
    if not graph.nodes:
        raise ended(
            "no node is on the bus; name a launch file, such as `paramove graph rule_learning`", exit_codes.FAILURE
        )
    return graph
