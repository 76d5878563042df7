"""`paramove new`: the folder of an application of one's own."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from paramove.cli.output import ended
from paramove.documents import exit_codes, is_identifier
from paramove.workspace import Workspace
from paramove.workspace.starting import start_application

app = typer.Typer(add_completion=False)


@app.command("new")
def new(
    name: Annotated[str, typer.Argument(help="name of the application, such as my_robot")],
    folder: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="where; default: a new folder of that name")
    ] = None,
) -> None:
    """Write an application of your own: a message, topics, two nodes, a launch file and a test, which run at once.

    Exit codes: 0 written; 2 the name is impossible or taken, or the folder has something in it.
    """
    if not is_identifier(name):
        message = f"'{name}' is no name of an application: a lower-case letter, then lower-case letters, digits and '_'"
        raise ended(message, exit_codes.USAGE)
    if name in Workspace.here().names("launch"):
        raise ended(
            f"'{name}' is an application already: paramove launch {name}; choose another name", exit_codes.USAGE
        )
    goal = Path(name) if folder is None else folder
    try:
        written = start_application(goal, name)
    except FileExistsError as error:
        raise ended(f"{goal} has something in it; choose another name, or --folder", exit_codes.USAGE) from error
    except OSError as error:
        raise ended(f"{goal}: {error.strerror}", exit_codes.USAGE) from error
    typer.echo("\n".join(f"wrote {goal / path}" for path in written))
    typer.echo(f"\nRun it:\n  cd {shlex.quote(str(goal))}\n  paramove launch {name}")
