"""What the commands of `paramove evaluate` take in and give out alike: the workspace, seeds, numbers as JSON."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from paramove.supervision import application, exit_codes

"""Exit code of an experiment that ran to its end and fell short of its goals."""
JsonFileOption = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="write the numbers to FILE too")]
PROGRESS = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())


def workspace_here() -> Path:
    """The workspace of the working directory; without one the command ends with exit code 66."""
    try:
        return application.find_workspace(Path.cwd())
    except FileNotFoundError as error:
        Console(stderr=True, highlight=False, markup=False).print(str(error), soft_wrap=True)
        raise typer.Exit(exit_codes.INPUT_MISSING) from error


def seeds_in(text: str) -> list[int]:
    """Seeds of `--seeds`; a text that names none is a wrong use of the command."""
    from paramove.evaluation.batch import SeedsError, seeds_of

    try:
        return seeds_of(text)
    except SeedsError as error:
        raise typer.BadParameter(str(error), param_hint="--seeds") from error


def stored_results(
    work: Sequence[Any], cache: Path, title: str, console: Console, *, jobs: int, scheduler: str | None = None
) -> list[dict[str, Any]]:
    """Results of all pieces of work, with a progress bar; what is finished is kept in `cache`.

    Each piece has a `key()`. The command ends with exit code 66 without the cluster of `scheduler`, 130 on Ctrl-C.
    """
    from paramove.evaluation.movements.sweep import ClusterMissingError, run_stored

    with Progress(*PROGRESS, console=console) as progress:
        shown = progress.add_task(title, total=None)

        def finished(done: int, total: int, last: str) -> None:
            progress.update(shown, completed=done, total=total, description=last[:60] or title)

        try:
            keys = [one.key() for one in work]
            return run_stored(work, keys, cache, workers=jobs, scheduler=scheduler, finished=finished)
        except ClusterMissingError as error:
            Console(stderr=True, highlight=False, markup=False).print(str(error), soft_wrap=True)
            raise typer.Exit(exit_codes.INPUT_MISSING) from error
        except KeyboardInterrupt:
            console.print(f"interrupted; what is finished is kept in {cache}", soft_wrap=True)
            raise typer.Exit(130) from None


def write_numbers(file: Path | None, numbers: Any, console: Console) -> None:
    """Writes what `--json` asks for: to the file and says so, or to standard output for `-`."""
    if file is None:
        return
    text = json.dumps(numbers, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    if str(file) == "-":
        sys.stdout.write(text)
        return
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    console.print(f"numbers: {file}", markup=False, soft_wrap=True)
