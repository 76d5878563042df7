"""Evaluates a run of the rule-learning application: `run.json`, `report.html`, `demo.mp4` in its folder.

Called by the launcher after the run, or by hand: `python -m paramove.runs.rule_learning RUN_FOLDER [--no-video]`.
Exit codes: 0 the robot did what it should, by the recorded truth; 3 it did not; 66 no such run.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from paramove.documents import replacing
from paramove.robots import RobotDescription
from paramove.runs.after_a_run import evaluated, write_report
from paramove.runs.recorded_run import load_run
from paramove.runs.rule_learning.summary import RunEvaluation, as_json
from paramove.runs.verdict_table import show_verdict
from paramove.workspace import Workspace

ROBOT = Path("robot_description/hoap3")


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    flags = {"--no-report": "write run.json alone"}
    return evaluated("paramove.runs.rule_learning", __doc__, flags, _evaluate, arguments)


def _evaluate(options: argparse.Namespace, console: Console) -> tuple[bool, list[Path | None]]:
    workspace = Workspace.here()
    run = load_run(options.run_folder)
    evaluation = RunEvaluation(run, RobotDescription.load(workspace.find(ROBOT)), workspace)
    numbers = run.folder / "run.json"
    with replacing(numbers) as unfinished:
        unfinished.write_text(as_json(evaluation.summary), encoding="utf-8")
    report = video = None
    if not options.no_report:
        from paramove.runs.rule_learning.report import page
        from paramove.runs.rule_learning.video import write_video

        video = None if options.no_video else write_video(evaluation, console)
        report = write_report(run.folder, page(evaluation, video))
    show_verdict(evaluation.summary, console)
    return evaluation.summary["success"], [report, video, numbers]


if __name__ == "__main__":
    sys.exit(main())
