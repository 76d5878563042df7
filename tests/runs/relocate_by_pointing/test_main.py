"""Relocation by pointing is judged by the recorded truth: synthetic runs of which the errors are known."""

import json
from dataclasses import replace

import pytest

from paramove.msgs.relocation_pb2 import RelocationStatus
from paramove.runs.recorded_run import load_run
from paramove.runs.relocate_by_pointing.__main__ import main
from paramove.runs.relocate_by_pointing.run import GOAL, SCALE, pointed_relocations_of, summary_of
from sim import small_person
from tests.runs.synthetic_relocations import GOOD, REJECTED, write_run

FAR = replace(GOOD, final=(0.16, 0.013))


def judged(folder, puts, **options):
    run = load_run(write_run(folder, puts, **options))
    return summary_of(run, pointed_relocations_of(run))


def test_scale_and_goal_are_those_of_the_simulated_person():
    assert small_person.SCALE == SCALE
    assert pytest.approx(0.0126) == GOAL


def test_objects_at_the_places_pointed_at_are_a_success(tmp_path):
    other = replace(GOOD, pointed=(0.14, -0.05), recognised=(0.14, -0.05), final=(0.14, -0.042))
    found = judged(tmp_path / "run", [GOOD, other])
    assert (found["success"], found["good"], found["reason"]) == (True, 2, "")
    first, second = found["relocations"]
    assert first["error_mm"] == pytest.approx(5.657, abs=1e-3)
    assert first["recognition_error_mm"] == pytest.approx(5.0, abs=1e-3)
    assert first["placing_error_mm"] == pytest.approx(1.0, abs=1e-3)
    assert second["error_mm"] == pytest.approx(8.0, abs=1e-3)
    assert second["error_cm_at_human_scale"] == pytest.approx(0.8 / 0.42, abs=1e-3)
    assert first["pointed"] == [0.16, 0.0]
    assert first["recognised_after_s"] == pytest.approx(0.5, abs=0.07)
    assert (found["error_mm"]["worst"], found["seed"], found["asked"], found["pointings"]) == (8.0, 7, 2, 2)


@pytest.mark.parametrize(
    ("put", "reason"),
    [
        (FAR, "place 2: the object stands 13.0 mm from the place pointed at (goal 12.6 mm)"),
        (replace(GOOD, lying=True), "place 2: the object does not stand"),
        (replace(GOOD, by_person=True), "place 2: the object does not stand"),
        (replace(GOOD, state=RelocationStatus.STATE_FAILED), "place 2: it slipped"),
    ],
)
def test_an_object_elsewhere_is_a_failure_with_the_reason(tmp_path, put, reason):
    found = judged(tmp_path / "run", [GOOD, put])
    assert (found["success"], found["good"], found["reason"]) == (False, 1, reason)


def test_putting_the_object_where_nobody_pointed_is_a_failure(tmp_path):
    found = judged(tmp_path / "run", [replace(GOOD, pointed=None)])
    assert (found["success"], found["reason"]) == (False, "place 1: nobody had pointed")
    assert found["relocations"][0]["pointed"] is None
    assert found["relocations"][0]["error_mm"] is None


def test_an_earlier_pointing_does_not_stand_for_one_that_was_not_answered(tmp_path):
    """The second time nobody points, and the robot puts the object elsewhere: it is far from the last place."""
    found = judged(tmp_path / "run", [GOOD, replace(GOOD, pointed=None, recognised=(0.14, -0.08), final=(0.14, -0.08))])
    assert not found["success"]
    assert found["relocations"][1]["error_mm"] > 50


def test_a_refused_goal_is_no_relocation(tmp_path):
    found = judged(tmp_path / "run", [REJECTED, GOOD])
    assert (found["success"], len(found["relocations"]), found["refused"], found["asked"]) == (True, 1, 1, 2)


def test_a_run_that_did_not_come_to_its_end_is_a_failure(tmp_path):
    found = judged(tmp_path / "run", [GOOD], done=False)
    assert (found["success"], found["reason"]) == (False, "after 1 places the run ended")
    assert judged(tmp_path / "none", [REJECTED])["reason"] == "the object was put nowhere"


@pytest.mark.parametrize(("put", "code"), [(GOOD, 0), (FAR, 3)])
def test_command_writes_numbers_report_and_video(tmp_path, capsys, put, code):
    folder = write_run(tmp_path / "run", [put], view=True)
    assert main([str(folder)]) == code
    shown = capsys.readouterr().out
    assert ("SUCCESS: 1 of 1" if code == 0 else "FAILURE: 0 of 1") in shown
    assert "the scale is 0.42" in shown
    report = (folder / "report.html").read_text()
    assert report.count("data:image/jpeg;base64") == 1
    assert "<video" in report
    assert "Place 1" in report
    assert json.loads((folder / "run.json").read_text())["success"] is (code == 0)
    assert (folder / "relocations.mp4").stat().st_size > 1000


def test_a_run_without_view_has_no_video(tmp_path):
    folder = write_run(tmp_path / "run", [GOOD])
    assert main([str(folder)]) == 0
    assert not (folder / "relocations.mp4").exists()
    assert "<video" not in (folder / "report.html").read_text()


def test_a_folder_without_a_run_is_told(tmp_path, capsys):
    assert main([str(tmp_path)]) == 66
    assert "holds no recording.mcap" in capsys.readouterr().err
    folder = write_run(tmp_path / "run", [GOOD], with_table=False)
    assert main([str(folder)]) == 66
    assert "world_from_table" in capsys.readouterr().err
