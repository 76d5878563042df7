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
from paramove.runs.after_a_run import evaluated
from paramove.runs.recorded_run import load_run
from paramove.runs.rule_learning.summary import RunEvaluation, as_json
from paramove.runs.verdict_table import show_verdict
from paramove.workspace import Workspace

ROBOT = Path("robot_description/hoap3")


def evaluate(folder: Path, workspace: Workspace) -> RunEvaluation:
    """Read a run; raises RunFolderError or DescriptionError."""
    return RunEvaluation(load_run(folder), RobotDescription.load(workspace.find(ROBOT)), workspace)


def write_summary(evaluation: RunEvaluation) -> Path:
    """Write `run.json` into the run's folder."""
    path = evaluation.run.folder / "run.json"
    with replacing(path) as unfinished:
        unfinished.write_text(as_json(evaluation.summary), encoding="utf-8")
    return path


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    flags = {"--no-report": "write run.json alone"}
    return evaluated("paramove.runs.rule_learning", __doc__, flags, _evaluate, arguments)


def _evaluate(options: argparse.Namespace, console: Console) -> bool:
    evaluation = evaluate(options.run_folder, Workspace.here())
    written = [write_summary(evaluation)]
    if not options.no_report:
        from paramove.runs.rule_learning.report import write_report
        from paramove.runs.rule_learning.video import write_video

        video = None if options.no_video else write_video(evaluation, console)
        written = [write_report(evaluation, video), *([video] if video is not None else []), *written]
    show_verdict(evaluation.summary, written, console)
    return bool(evaluation.summary["success"])


if __name__ == "__main__":
    sys.exit(main())
