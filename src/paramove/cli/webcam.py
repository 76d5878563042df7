"""`paramove webcam`: what tracking with a webcam needs once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from paramove.documents import exit_codes

app = typer.Typer(name="webcam", no_args_is_help=True, help="Track a person with a webcam.")


@app.callback()
def _group() -> None:
    """Track a person with a webcam."""


@app.command()
def setup(
    wheel: Annotated[
        Path | None, typer.Option(metavar="FILE", help="the package as a file, for a machine without network")
    ] = None,
) -> None:
    """Fetch the pose network that finds a person's arms in pictures (35.6 MB, once), and check it.

    Exit codes: 0 it is there; 66 it could not be had.
    """
    from paramove.documents import InputError
    from paramove.observation import fetch_networks, stored_network

    try:
        folder = fetch_networks(wheel)
        stored_network(folder)
    except InputError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(exit_codes.INPUT_MISSING) from error
    typer.echo(f"the pose network is in {folder}")
