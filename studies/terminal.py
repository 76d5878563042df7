"""What the commands of the studies share: verdicts, errors, and the progress of work whose results are stored."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer
from rich.console import Console
from rich.progress import Progress

from paramove.cli import PROGRESS
from paramove.documents import exit_codes

_COLOURS = {"yes": "green", "in part": "yellow", "no": "red", "–": "bright_black"}


def marked(verdict: str) -> str:
    """A verdict ("yes", "in part", "no" or "–") in its colour, as Rich's markup."""
    return f"[{_COLOURS[verdict]}]{verdict}[/]"


def print_error(text: str) -> None:
    """To standard error, unbroken."""
    Console(stderr=True, highlight=False, markup=False).print(text, soft_wrap=True)


def stored_results(
    work: Sequence[Any],
    keys: Sequence[str],
    cache: Path,
    title: str,
    console: Console,
    *,
    jobs: int,
    scheduler: str | None = None,
) -> list[dict[str, Any]]:
    """Results of all pieces of work, with a progress bar; finished ones are stored in `cache` by their keys.

    The command ends with exit code 66 without the cluster of `scheduler`, 130 on Ctrl-C.
    """
    from studies.movements.sweep import ClusterMissingError, run_stored

    with Progress(*PROGRESS, console=console) as progress:
        task = progress.add_task(title, total=None)

        def finished(done: int, total: int, last: str) -> None:
            progress.update(task, completed=done, total=total, description=last[:60] or title)

        try:
            return run_stored(work, keys, cache, workers=jobs, scheduler=scheduler, finished=finished)
        except ClusterMissingError as error:
            print_error(str(error))
            raise typer.Exit(exit_codes.INPUT_MISSING) from error
        except KeyboardInterrupt:
            console.print(f"interrupted; finished results are stored in {cache}", soft_wrap=True)
            raise typer.Exit(130) from None
