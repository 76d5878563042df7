"""`paramove logs`: log lines of the nodes of a run, in the order of time."""

from __future__ import annotations

import collections
import enum
import itertools
import json
import logging
import os
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from paramove.cli import completions
from paramove.cli.output import ended
from paramove.documents import exit_codes, printable
from paramove.supervision import LEVELS, SUPERVISOR, LogLine, RunLogs
from paramove.workspace import Workspace

app = typer.Typer(add_completion=False)

LOOK_PERIOD_S = 0.2
COLOURS = (36, 32, 35, 34, 96, 92, 95, 94)
"""Of the names of nodes: codes of a terminal. Red and yellow are left to levels."""
LEVEL_COLOURS = {logging.WARNING: 33, logging.ERROR: 31, logging.CRITICAL: 31}


class Level(enum.StrEnum):
    """Levels to choose from."""

    DEBUG = "debug"
    INFO = "info"
    WARN = "warn"
    ERROR = "error"


@app.command()
def logs(
    follow: Annotated[
        bool, typer.Option("--follow", "-f", help="continue as the logs grow, until the run ends")
    ] = False,
    node: Annotated[list[str] | None, typer.Option(help="only this node; may be repeated")] = None,
    level: Annotated[Level, typer.Option(help="this level and above")] = Level.INFO,
    run: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="folder of the run; default: the latest", autocompletion=completions.run_folders
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print a JSON object per line")] = False,
) -> None:
    """Show the log lines of a run's nodes and the supervisor's events, in the order of time.

    Lines without a level, such as tracebacks, count as warnings.
    """
    folder = _run_folder(run)
    read = RunLogs(folder, node or ())
    if unknown := set(node or ()) - set(read.names()):
        raise ended(
            f"no log of {', '.join(sorted(unknown))} in {folder}; there are: {', '.join(read.names())}",
            exit_codes.USAGE,
        )
    shown = _Shown(LEVELS[level], as_json)
    try:
        shown.show(read.read())
        while follow and not read.ended:
            time.sleep(LOOK_PERIOD_S)
            shown.show(read.read())
    except KeyboardInterrupt:
        return
    except BrokenPipeError:  # `| head`; flushing again at exit would fail too
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _run_folder(requested: Path | None) -> Path:
    folder = requested or Workspace.here().root / "runs" / "latest"
    if not (folder / "logs").is_dir():
        hint = "give the folder of a run with --run" if requested is None else "a run's folder holds logs/ and run.yaml"
        raise ended(f"{folder} holds no logs; {hint}", exit_codes.INPUT_MISSING)
    return folder.resolve()


class _Shown:
    """Prints lines, each node's name in a colour of its own where a terminal shows colours."""

    def __init__(self, level: int, as_json: bool) -> None:
        self._level = level
        self._as_json = as_json
        self._coloured = sys.stdout.isatty() and not os.environ.get("NO_COLOR")
        self._colours = collections.defaultdict(itertools.cycle(COLOURS).__next__, {SUPERVISOR: 1})

    def show(self, lines: Iterable[LogLine]) -> None:
        text = [self._text(line) for line in lines if line.level >= self._level]
        if text:
            sys.stdout.write("\n".join(text) + "\n")
            sys.stdout.flush()

    def _text(self, line: LogLine) -> str:
        level = logging.getLevelName(line.level)
        if self._as_json:
            facts = {"monotonic_s": line.monotonic_s, "wall": line.wall, "node": line.node, "level": level}
            return json.dumps(facts | {"text": line.text}, ensure_ascii=False)
        time_of_day = line.wall[11:23] or " " * 12
        name = self._in(self._colours[line.node], f"{line.node:<16}")
        return f"{time_of_day} {name} {self._in(LEVEL_COLOURS.get(line.level), f'{level:<7}')} {printable(line.text)}"

    def _in(self, colour: int | None, text: str) -> str:
        return f"\x1b[{colour}m{text}\x1b[0m" if self._coloured and colour is not None else text
