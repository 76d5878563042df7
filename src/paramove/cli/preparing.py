"""Before a run: the files that it needs, made by commands that lead a person through it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import typer

from paramove.cli.set_up_view import FOLDER_VARIABLE
from paramove.documents import exit_codes, printable
from paramove.supervision import Launch, MissingFile, missing_files
from paramove.workspace import Workspace


def prepared(launch: Launch, workspace: Workspace, pages: Path | None) -> int:
    """Makes the files that are missing, each when the person presses Enter; the exit code.

    Without a terminal it names the first missing file with its command, and makes none.

    Args:
        launch: What shall run. workspace: where the files lie, and the commands run.
        pages: Folder of the page in the browser that follows the commands; None without one.

    Raises DocumentError for a wrong entry, or a command that does not write its file.
    """
    for missing in missing_files(launch, workspace):
        attended, name = sys.stdin.isatty(), missing.path.name
        typer.echo(printable(f"{name} is missing: {missing.about}"), err=not attended)
        typer.echo(printable(f"  {missing.typed}"), err=not attended)
        if not attended or not _agreed():
            return exit_codes.INPUT_MISSING
        if code := _run(missing, workspace, pages):
            typer.echo(f"{name} is still missing; the same command goes on from here", err=True)
            return code
        if not missing.path.exists():
            raise launch.error(("needs",), f"`{missing.typed}` did not write {missing.path}")
    return exit_codes.OK


def _run(missing: MissingFile, workspace: Workspace, pages: Path | None) -> int:
    shared = {} if pages is None else {FOLDER_VARIABLE: str(pages)}
    try:
        return subprocess.run(
            [sys.executable, "-m", "paramove.cli.main", *missing.command],
            cwd=workspace.root,
            env={**os.environ, **shared},
            check=False,
        ).returncode
    except KeyboardInterrupt:
        return exit_codes.by_signal(signal.SIGINT)


def _agreed() -> bool:
    """Whether a person presses Enter; Ctrl-C and the terminal's end are a no."""
    typer.echo("press Enter to begin, Ctrl-C to leave it")
    try:
        return bool(sys.stdin.readline())
    except KeyboardInterrupt:
        return False
