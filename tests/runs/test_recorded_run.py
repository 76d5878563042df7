"""Runs whose recorder or judge was started again in the middle."""

import pytest

from paramove.recording.parts import next_part
from paramove.recording.reader import read
from paramove.recording.writer import RecordingWriter
from paramove.runs.recorded_run import RecordingGap, load_run
from paramove.runs.rule_learning.report import page
from paramove.runs.rule_learning.summary import RunEvaluation
from paramove.workspace import Workspace
from tests.runs.conftest import ROOT
from tests.runs.synthetic_run import END_S, SyntheticRun

KILLED_S, BACK_S = 2.0, 3.0


@pytest.mark.parametrize("name", ["recording", "truth"])
def test_parts_are_read_as_one_and_the_gap_is_told(tmp_path, robot, name):
    assert BACK_S < END_S
    path = SyntheticRun(tmp_path, robot).write() / f"{name}.mcap"
    said = list(read(path))
    path.unlink()
    parts = (
        [one for one in said if one.publish_ns < KILLED_S * 1e9],
        [one for one in said if one.publish_ns > BACK_S * 1e9],
    )
    for part in parts:
        with RecordingWriter(next_part(path), "test") as recording:
            for one in part:
                recording.write(one.topic, one.message, one.log_ns, one.publish_ns, one.sequence)
    run = load_run(tmp_path)
    gap = RecordingGap(name, parts[0][-1].publish_ns * 1e-9, parts[1][0].publish_ns * 1e-9)
    assert run.gaps == (gap,)
    assert run.done
    evaluation = RunEvaluation(run, robot, Workspace.at(ROOT))
    assert evaluation.summary["gaps"] == [{"recording": name, "begin_s": gap.begin_s, "end_s": gap.end_s}]
    told = f"Nothing was recorded of the {name} from {gap.begin_s:.2f} to {gap.end_s:.2f} s: its process was"
    assert told in page(evaluation, None)
    assert (evaluation.summary["loss"]["total"] > 0) == (name == "recording")
