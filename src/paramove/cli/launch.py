"""`paramove launch`: runs an application."""

from __future__ import annotations

import io
import os
import signal
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from paramove.supervision import application, exit_codes
from paramove.supervision.domain import DomainError
from paramove.supervision.launch_file import LaunchFileMissingError, load
from paramove.supervision.positions import LaunchFileError
from paramove.supervision.run_folder import RunFolder
from paramove.supervision.supervisor import Outcome, View
from paramove.supervision.view import LineView, TableView

app = typer.Typer(add_completion=False)


@app.command()
def launch(
    name: Annotated[str, typer.Argument(help="launch file in launch/, such as rule_learning, or a path to a *.yaml")],
    overlays: Annotated[
        list[str] | None, typer.Option("--with", metavar="OVERLAY", help="lay launch/overlays/OVERLAY.yaml over it")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NODE.PARAM=VALUE", help="change one parameter; may be repeated"),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="seed of the world", min=0)] = None,
    headless: Annotated[bool, typer.Option("--headless", help="lines instead of the live table, and no video")] = False,
    runs: Annotated[Path | None, typer.Option(help="where the run folder is made (default: runs/)")] = None,
    check: Annotated[bool, typer.Option("--check", help="check the launch file and its nodes, start nothing")] = False,
) -> None:
    """Run an application: start its nodes, keep them running, end them in order, judge the run.

    Exit codes: 0 success; 1 failed, or judged a failure; 2 usage; 66 no such launch file; 75 another run is going on;
    78 the launch file is wrong; 124 time limit; 129, 130, 143 ended by a closed terminal, Ctrl-C, SIGTERM.
    Ctrl-C once ends the run in order, twice at once.
    """
    raise typer.Exit(_launch(name, overlays, settings or [], seed, headless, runs, check))


def _launch(
    name: str,
    overlays: list[str] | None,
    settings: list[str],
    seed: int | None,
    headless: bool,
    runs: Path | None,
    check_only: bool,
) -> int:
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a sentence must not end a run where a letter is unknown
    console = Console(highlight=False, markup=False, emoji=False)
    errors = Console(stderr=True, highlight=False, markup=False, emoji=False, soft_wrap=True)
    try:
        workspace = application.find_workspace(Path.cwd())
        loaded = load(workspace / "launch", name, overlays, settings, seed, headless)
        if check_only:
            application.check(loaded, workspace)
            console.print(f"{loaded.name}: {len(loaded.file.nodes)} nodes fit together")
            return exit_codes.OK
        outcome, folder = application.run(loaded, workspace, lambda folder: _view(console, folder, headless), runs)
    except (LaunchFileMissingError, FileNotFoundError) as error:
        errors.print(str(error))
        return exit_codes.INPUT_MISSING
    except LaunchFileError as error:
        errors.print(str(error))
        return exit_codes.CONFIGURATION
    except DomainError as error:
        errors.print(str(error))
        return exit_codes.TEMPORARY
    except PermissionError as error:
        errors.print(f"{error.filename}: {error.strerror}; run from a clone that you may write to")
        return exit_codes.PERMISSION
    try:
        console.print(f"{_verdict(outcome)}{outcome.reason}. Run folder: {folder.path}", soft_wrap=True)
    except OSError:  # the terminal was closed; flushing it again at exit would fail too
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return outcome.code


def _verdict(outcome: Outcome) -> str:
    """What the last line begins with; a run that a person ended did not fail."""
    if outcome.code in map(exit_codes.by_signal, (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)):
        return ""
    return "done: " if outcome.code == exit_codes.OK else "FAILED: "


def _view(console: Console, folder: RunFolder, headless: bool) -> View:
    console.print(f"run folder {folder.path}", soft_wrap=True)
    return TableView(console) if console.is_terminal and not headless else LineView(console)


if __name__ == "__main__":
    app()
