"""The command that evaluates a run: the launcher calls it when the run has ended, or people by hand."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from paramove.documents import exit_codes, replacing
from paramove.runs.recorded_run import RunFolderError, gaps_in, read_facts
from paramove.supervision import QueuedOutput
from paramove.terminal_size import drop_unusable_sizes

Evaluate = Callable[[argparse.Namespace, Console], tuple[bool | None, Sequence[Path | None]]]


def evaluated(
    module: str, described: str | None, flags: Mapping[str, str], evaluate: Evaluate, arguments: Sequence[str] | None
) -> int:
    """Reads the command's arguments and evaluates; returns the exit code. Never waits for the terminal.

    Args:
        module: whose command it is. described: its help.
        flags: options without a value in addition to `--no-video`, with their help.
        evaluate: what is to be done with `run_folder`, an absolute path, and the flags; returns whether the run did
            what it should, None if it is unknown, and the files that it wrote, which are printed (None: not written).
            Raises RunFolderError for a folder that holds no such run.
    """
    drop_unusable_sizes()
    parser = argparse.ArgumentParser(prog=f"python -m {module}", description=described)
    parser.add_argument("run_folder", type=lambda text: Path(text).resolve())
    for flag, text in {"--no-video": "write no video", **flags}.items():
        parser.add_argument(flag, action="store_true", help=text)
    options = parser.parse_args(arguments)
    with QueuedOutput():
        errors = Console(stderr=True, highlight=False, markup=False)
        try:
            console = Console(highlight=False, emoji=False)
            success, written = evaluate(options, console)
            paths = [path for path in written if path is not None]
            width = max((len(path.name) for path in paths), default=0)
            for path in paths:
                console.print(f"{path.name:{width}}  {path}", markup=False, soft_wrap=True)
        except RunFolderError as error:
            errors.print(str(error), soft_wrap=True)
            return exit_codes.INPUT_MISSING
        except OSError as error:
            again = f"when that is fixed, run python -m {module} {options.run_folder}"
            errors.print(f"{error.filename or options.run_folder}: {error.strerror or error}; {again}", soft_wrap=True)
            return exit_codes.FAILURE
    return exit_codes.JUDGED_A_FAILURE if success is False else exit_codes.OK


def verdict(success: bool) -> str:
    """In a word, with its colour as markup."""
    return "[bold green]SUCCESS[/]" if success else "[bold red]FAILURE[/]"


def rounded(value: float) -> float | None:
    """For `run.json`: to three digits after the point; None where it is infinite or unknown."""
    return round(float(value), 3) if np.isfinite(value) else None


def write_report(folder: Path, page: str) -> Path:
    """Writes `report.html` into a run's folder."""
    path = folder / "report.html"
    path.write_text(page, encoding="utf-8")
    return path


def write_run_json(folder: Path, summary: dict[str, Any]) -> Path:
    """Writes `run.json` into a run's folder: its numbers, the gaps of its recordings, and the workspace."""
    path = folder / "run.json"
    gaps, workspace = [asdict(gap) for gap in gaps_in(folder)], read_facts(folder).get("workspace")
    content = summary | {"gaps": gaps, "workspace": workspace}
    with replacing(path) as unfinished:
        unfinished.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return path
