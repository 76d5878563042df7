"""Input and output shared by `paramove evaluate` and the studies: seeds, numbers as JSON."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn

JsonFileOption = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="write the numbers to FILE too")]
PROGRESS = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())


def seeds_in(text: str) -> list[int]:
    """Seeds of `--seeds`; a text without any is a wrong use of the command."""
    from paramove.runs import SeedsError, seeds_of

    try:
        return seeds_of(text)
    except SeedsError as error:
        raise typer.BadParameter(str(error), param_hint="--seeds") from error


def write_numbers(file: Path | None, numbers: Any, console: Console) -> None:
    """Writes the numbers of `--json`: to the file, whose name is printed, or to standard output for `-`."""
    if file is None:
        return
    text = json.dumps(numbers, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    if str(file) == "-":
        sys.stdout.write(text)
        return
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    console.print(f"numbers: {file}", markup=False, soft_wrap=True)
