"""`paramove run`: one node, beside a running application or alone."""

from __future__ import annotations

import os
from typing import Annotated

import typer

from paramove.cli import completions
from paramove.cli.bus_options import DomainOption

app = typer.Typer(add_completion=False)


@app.command()
def run(
    module: Annotated[
        str, typer.Argument(help="module of the node, such as nodes.camera", autocompletion=completions.modules)
    ],
    name: Annotated[str, typer.Option(help="name of the node; default: the last part of its module")] = "",
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="PARAM=VALUE", help="one parameter; may be repeated")
    ] = None,
    remaps: Annotated[
        list[str] | None,
        typer.Option("--remap", metavar="TOPIC=TOPIC", help="another topic in the place of one; may be repeated"),
    ] = None,
    namespace: Annotated[str, typer.Option(metavar="NAME", help="in which its topics are")] = "",
    domain: DomainOption = None,
) -> None:
    """Run one node beside those of a running application; where none runs, alone, as an application of one node.

    Beside others nothing supervises it, and simulated time does not wait for it. Ctrl-C ends it.

    Exit codes: those of the node, 0 if it ended in order; 75 another node publishes its topic; 78 there is no such
    module, or its parameters are wrong. Alone: those of `paramove launch`.
    """
    from paramove.bus import default_folder
    from paramove.cli.one_run import run_loaded
    from paramove.cli.output import one_line
    from paramove.supervision import Launch, join, node_alone
    from paramove.workspace import Workspace

    def loaded(_: Workspace) -> Launch:
        return node_alone(module, name, settings or [], remaps or [], namespace)

    folder = default_folder(domain)
    if not folder.is_dir():
        if domain is not None:
            os.environ["PARAMOVE_DOMAIN"] = domain
        raise typer.Exit(run_loaded(loaded))
    workspace = Workspace.here()
    with one_line():
        join(loaded(workspace), workspace, folder)
