"""Evaluates a run of the pointing application: `run.json`, `report.html`, `pointing.mp4` in its folder.

Called by the launcher after the run, or by hand: `python -m paramove.runs.pointing RUN_FOLDER [--no-video]`.
Exit codes: 0 the targets were recognised, or the true ones are unknown; 3 they were not; 66 no such run.
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
from paramove.runs.pointing.run import FARTHEST_M, MEDIAN_M, load_pointing_run


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    return evaluated("paramove.runs.pointing", __doc__, {}, _evaluate, arguments)


def _evaluate(options: argparse.Namespace, console: Console) -> tuple[bool | None, list[Path | None]]:
    run = load_pointing_run(options.run_folder)
    from paramove.runs.pointing.report import write_pointing_report
    from paramove.runs.pointing.video import write_pointing_video

    summary = run.summary()
    numbers = write_run_json(run.folder, summary)
    video = None if options.no_video else write_pointing_video(run.folder, console)
    report = write_pointing_report(run, summary, video)
    show(summary, console)
    return summary["success"], [report, video, numbers]


def show(summary: dict[str, Any], console: Console) -> None:
    """Print the verdict and the numbers of a run."""
    if summary["success"] is None:
        console.print(f"{summary['gestures']} targets in {summary['seconds']:.0f} s; the true ones are unknown")
    else:
        answered = sum(one["answers"] > 0 for one in summary["pointings"])
        console.print(
            f"\n{verdict(summary['success'])}: {answered} of {len(summary['pointings'])} pointings were answered "
            f"{summary['reason']}"
        )
        table = Table(show_edge=False, pad_edge=False)
        for name, side in (("pointing", "left"), ("target, cm", "right"), ("error", "right"), ("after", "right")):
            table.add_column(name, justify=side)  # type: ignore[arg-type]
        for number, one in enumerate(summary["pointings"], start=1):
            x, y, _ = (100 * value for value in one["target"])
            errors = ("-", "-") if one["error_cm"] is None else (f"{one['error_cm']:.1f} cm", f"{one['delay_s']:.2f} s")
            table.add_row(str(number), f"({x:.1f}, {y:.1f})", *errors)
        console.print(table)
        error, hand = summary["target_error_cm"], summary["hand_rms_cm"]
        console.print(
            f"targets: median {error['median']} cm (goal {100 * MEDIAN_M:.0f}), worst {error['worst']} cm "
            f"(goal {100 * FARTHEST_M:.0f}); hand: RMS {', '.join(map(str, hand))} cm along x, y, z"
        )


if __name__ == "__main__":
    sys.exit(main())
