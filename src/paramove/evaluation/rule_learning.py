"""Evaluates a run of the rule-learning application: `run.json`, `report.html`, `demo.mp4` in its folder.

Called by the launcher after the run, or by hand: `python -m paramove.evaluation.rule_learning RUN_FOLDER [--no-video]`.
Exit codes: 0 the robot did what it should, by the recorded truth; 3 it did not; 66 no such run.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from paramove.evaluation.recorded_run import RunFolderError, load_run
from paramove.evaluation.run_summary import RunEvaluation, as_json
from paramove.evaluation.verdict_table import show_verdict
from paramove.robots.description import RobotDescription
from paramove.supervision import exit_codes

JUDGED_A_FAILURE = 3
ROBOT = Path("robot_description/hoap3")


def evaluate(folder: Path, workspace: Path) -> RunEvaluation:
    """Read a run; raises RunFolderError or DescriptionError."""
    return RunEvaluation(load_run(folder), RobotDescription.load(workspace / ROBOT), workspace)


def write_summary(evaluation: RunEvaluation) -> Path:
    """Write `run.json` into the run's folder."""
    path = evaluation.run.folder / "run.json"
    path.write_text(as_json(evaluation.summary), encoding="utf-8")
    return path


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m paramove.evaluation.rule_learning", description=__doc__)
    parser.add_argument("run_folder", type=Path)
    parser.add_argument("--no-video", action="store_true", help="write no demo.mp4")
    parser.add_argument("--no-report", action="store_true", help="write run.json alone")
    options = parser.parse_args(arguments)
    console = Console(highlight=False, emoji=False)
    try:
        evaluation = evaluate(options.run_folder.resolve(), Path.cwd())
    except RunFolderError as error:
        Console(stderr=True, highlight=False, markup=False).print(str(error), soft_wrap=True)
        return exit_codes.INPUT_MISSING
    written = [write_summary(evaluation)]
    if not options.no_report:
        from paramove.evaluation.demo_video import write_video
        from paramove.evaluation.report import write_report

        video = None if options.no_video else write_video(evaluation, console)
        written = [write_report(evaluation, video), *([video] if video is not None else []), *written]
    show_verdict(evaluation.summary, written, console)
    return exit_codes.OK if evaluation.summary["success"] else JUDGED_A_FAILURE


if __name__ == "__main__":
    sys.exit(main())
