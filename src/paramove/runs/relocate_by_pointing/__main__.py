"""Evaluates a run of relocation by pointing: `run.json`, `report.html`, `relocations.mp4` in its folder.

Called by the launcher after the run, or by hand:
`python -m paramove.runs.relocate_by_pointing RUN_FOLDER [--no-video]`. Exit codes: 0 the object ended at every
target pointed at, by the recorded truth; 3 it did not; 66 no such run.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from paramove.runs.after_a_run import evaluated, verdict, write_run_json
from paramove.runs.recorded_run import load_run
from paramove.runs.relocate_by_pointing.run import GOAL, SCALE, pointed_relocations_of, summary_of


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    return evaluated("paramove.runs.relocate_by_pointing", __doc__, {}, _evaluate, arguments)


def _evaluate(options: argparse.Namespace, console: Console) -> tuple[bool, list[Path | None]]:
    run = load_run(options.run_folder)
    relocations = pointed_relocations_of(run)
    summary = summary_of(run, relocations)
    from paramove.runs.relocate_by_pointing.report import write_relocation_report
    from paramove.runs.relocate_by_pointing.video import write_relocation_video

    numbers = write_run_json(run.folder, summary)
    video = None if options.no_video else write_relocation_video(run, console)
    report = write_relocation_report(run, relocations, summary, video)
    show(summary, console)
    return summary["success"], [report, video, numbers]


def show(summary: dict[str, Any], console: Console) -> None:
    """Print the verdict and the numbers of a run."""
    relocations = summary["relocations"]
    console.print(
        f"\n{verdict(summary['success'])}: {summary['good']} of {len(relocations)} times the object ended "
        f"within {1e3 * GOAL:.1f} mm of the place pointed at",
        soft_wrap=True,
    )
    console.print(f"1 mm here is {1 / SCALE:.1f} mm for a grown person at a table: the scale is {SCALE}", style="dim")
    if summary["reason"]:
        console.print(summary["reason"], markup=False, soft_wrap=True)
    table = Table(show_edge=False, pad_edge=False)
    heads = ("place", "pointed at, cm", "recognised, cm", "ended, cm", "certain", "error", "at human scale")
    for number, head in enumerate(heads):
        table.add_column(head, justify="left" if number == 0 else "right")
    for number, one in enumerate(relocations, start=1):
        error = "-" if one["error_mm"] is None else f"{one['error_mm']:.1f} mm"
        human = "-" if one["error_cm_at_human_scale"] is None else f"{one['error_cm_at_human_scale']:.1f} cm"
        places = (_cm(one[name]) for name in ("pointed", "recognised", "final"))
        mark = error if one["good"] else f"[yellow]{error}[/]"
        table.add_row(str(number), *places, f"{100 * one['certainty']:.0f} %", mark, human)
    console.print(table)
    console.print(
        f"requests to point: {summary['asked']}; goals rejected {summary['refused']}, failed {summary['failed']}; "
        f"unwanted contacts {summary['unwanted_contacts']}; {summary['simulated_s']:.0f} s of simulated time",
        soft_wrap=True,
    )


def _cm(place: list[float] | None) -> str:
    return "-" if place is None else f"({100 * place[0]:.1f}, {100 * place[1]:.1f})"


if __name__ == "__main__":
    sys.exit(main())
