"""`python -m studies chapter6`: tracking in action space on rendered movements."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from platformdirs import user_cache_path
from rich.console import Console
from rich.table import Table

from paramove.cli import JsonFileOption, write_numbers
from paramove.documents import exit_codes
from studies.terminal import marked, print_error, stored_results

if TYPE_CHECKING:
    from collections.abc import Sequence

    from studies.chapter6.experiments import Piece, Selection
    from studies.chapter6.goals import Goal

CHAPTER6_FOLDER = Path("runs/evaluation/chapter6")


class SplitName(StrEnum):
    """Which clips are tracked."""

    TUNING = "tuning"
    HELD_OUT = "held_out"
    ALL = "all"


def chapter6(
    split: Annotated[SplitName, typer.Option(help="clips: those for tuning, the third held out, or all")] = (
        SplitName.ALL
    ),
    kinds: Annotated[
        list[str] | None, typer.Option("--kind", metavar="KIND", help="only this kind of clip; may be repeated")
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="processes at the same time")] = 2,
    clips: Annotated[
        Path | None, typer.Option(metavar="DIR", help="folder of the clips (default: the user's cache)")
    ] = None,
    first: Annotated[int | None, typer.Option(min=1, metavar="N", help="only the first N clips of each kind")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="the first clip of each kind, fewer views: a minute")] = False,
    data: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="recordings (default: $PARAMOVE_DATA, or shared/data)")
    ] = None,
    json_file: JsonFileOption = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="where the report goes")] = CHAPTER6_FOLDER,
) -> None:
    """Repeat thesis chapter 6: an arm tracked in action space by one to four cameras, on rendered movements.

    Writes report.html and chapter6.json, and prints which goals are met; those for which the chosen clips have no
    data are not judged. Ctrl-C and the same command again: goes on where it was. Exit codes: 0 all judged goals
    are met; 3 not all; 66 clips or recordings are missing; 130 interrupted.
    """
    from sim.persons.performances import KINDS
    from studies.chapter6.experiments import Selection

    console = Console(highlight=False, emoji=False)
    names = tuple(kinds) if kinds else tuple(kind.name for kind in KINDS)
    selection = Selection(split.value, names, 1 if quick else first, quick)
    work = _prepared(selection, clips.resolve() if clips is not None else None, data, console)
    cache = user_cache_path("paramove") / "chapter6" / "tracks"
    results = stored_results(work, [one.key() for one in work], cache, "tracks", console, jobs=jobs)
    _report(work, results, out.resolve(), json_file, console)


def _prepared(selection: Selection, clips: Path | None, data: Path | None, console: Console) -> list[Piece]:
    """All tracks, after checking the clips and training the models."""
    from paramove.demonstrations import RecordingsError
    from paramove.documents import InputError
    from studies.chapter6.experiments import pieces, train

    try:
        work = pieces(selection, clips, data)
        with console.status("training models"):
            train(selection, data)
    except InputError as error:
        print_error(str(error))
        raise typer.Exit(exit_codes.INPUT_MISSING if error.missing else exit_codes.USAGE) from error
    except RecordingsError as error:
        print_error(f"{error}; without them, leave kind 'recorded' out: name the others with --kind")
        raise typer.Exit(exit_codes.INPUT_MISSING) from error
    return work


def _report(
    work: Sequence[Piece], results: list[dict[str, Any]], folder: Path, json_file: Path | None, console: Console
) -> None:
    from sim.persons.clips import read_clip
    from studies.chapter6.report import write_results

    with console.status("drawing"):
        clips = {piece.folder.name: read_clip(piece.folder) for piece in work}
        numbers, goals = write_results(results, folder, clips)
    _print_findings(numbers["findings"], console)
    _print_goals(goals, console)
    write_numbers(json_file, numbers, console)
    console.print(f"report: {folder / 'report.html'}", markup=False, soft_wrap=True)
    judged = [goal.met for goal in goals if goal.met is not None]
    raise typer.Exit(exit_codes.OK if judged and all(judged) else exit_codes.JUDGED_A_FAILURE)


def _print_findings(findings: Sequence[dict[str, str]], console: Console) -> None:
    table = Table(title="compared with the thesis", show_edge=False, pad_edge=False, show_lines=True)
    for head in ("where", "here", "the same"):
        table.add_column(head)
    for one in findings:
        table.add_row(one["where"], one["seen"], marked(one["verdict"]))
    console.print(table)


def _print_goals(goals: Sequence[Goal], console: Console) -> None:
    from studies.chapter6.tables import met

    table = Table(title="goals", show_edge=False, pad_edge=False)
    for head in ("goal", "required", "measured", "of", "met"):
        table.add_column(head)
    for goal in goals:
        if goal.met is not None:
            table.add_row(*goal[:4], marked(met(goal)))
    console.print(table)
    unjudged = sum(goal.met is None for goal in goals)
    if unjudged:
        console.print(f"{unjudged} more goals are not judged: the chosen clips have none or too few of these")
