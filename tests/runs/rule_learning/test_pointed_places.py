"""Places told by tracking in action space, beside the objects that the person pointed at."""

from __future__ import annotations

import pytest

from paramove.bus import topics
from paramove.msgs.action_estimate_pb2 import ActionEstimate
from paramove.msgs.gesture_pb2 import Gesture
from paramove.runs.batch_table import table_of, totals_of
from paramove.runs.recorded_run import load_run
from paramove.runs.rule_learning.report import page
from paramove.runs.rule_learning.summary import RunEvaluation
from paramove.runs.verdict_table import rows_of
from paramove.workspace import Workspace
from tests.runs.conftest import ROOT
from tests.runs.synthetic_run import PERIOD_NS, SyntheticRun

YELLOW, GREEN = (0.15, 0.0), (0.18, 0.05)
SPACING_MM = 58.309519


class PointedRun(SyntheticRun):
    """The person points at green from 1.9 to 3.5 s and at yellow from 4 to 6 s.

    Args:
        told: Time, s, and place of each gesture.
        pointing: Object and span of each pointing, s.
    """

    def __init__(self, folder, robot, told, pointing=(("green", 1.9, 3.5), ("yellow", 4.0, 6.0)), tracked=True):
        super().__init__(folder, robot)
        self.told, self.pointing, self.tracked = told, pointing, tracked

    def _state(self, number):
        message = super()._state(number)
        now_s = number * PERIOD_NS * 1e-9
        doing = [f"points at {name}" for name, begin_s, end_s in self.pointing if begin_s <= now_s <= end_s]
        message.instructor = doing[0] if doing else "waits"
        return message

    def _said(self, after_end):
        yield from super()._said(after_end)
        if self.tracked:
            yield topics.ACTION_ESTIMATE, 0, ActionEstimate(frame="right_shoulder")
        for time_s, (x, y) in self.told:
            gesture = Gesture(kind=Gesture.KIND_POINTED_AT, located=True, frame="right_shoulder", x=x, y=y)
            gesture.captured.FromNanoseconds(round(time_s * 1e9))
            gesture.confidence = 0.9
            yield topics.GESTURES, round(time_s * 1e9), gesture


@pytest.fixture
def evaluate(tmp_path, robot):
    def make(told, **more):
        PointedRun(tmp_path, robot, told, **more).write()
        return RunEvaluation(load_run(tmp_path), robot, Workspace.at(ROOT))

    return make


def test_each_pointing_gets_its_error_and_that_of_the_spacing(evaluate):
    summary = evaluate([(3.0, (0.183, 0.054)), (5.0, (0.15, 0.012))]).summary
    green, yellow = summary["pointing_list"]
    assert (green["meant"], green["nearest"], green["right"]) == ("green", "green", True)
    assert green["error_mm"] == pytest.approx(5.0)
    assert green["spacing_mm"] == pytest.approx(SPACING_MM)
    assert yellow["error_of_spacing"] == pytest.approx(12.0 / SPACING_MM)
    assert (summary["pointings"], summary["pointings_told"], summary["pointings_right"]) == (2, 2, 2)
    assert summary["pointing_error_mm"] == {"median": pytest.approx(8.5), "max": pytest.approx(12.0), "samples": 2}


def test_a_place_nearer_to_another_object_is_wrong_and_a_missing_one_is_counted(evaluate):
    summary = evaluate([(3.0, (0.152, 0.004))]).summary
    assert (summary["pointings"], summary["pointings_told"], summary["pointings_right"]) == (2, 1, 0)
    wrong, missing = summary["pointing_list"]
    assert (wrong["nearest"], wrong["right"]) == ("yellow", False)
    assert missing["believed"] is None
    assert missing["error_mm"] is None


def test_what_is_told_while_nobody_points_is_told_apart(evaluate):
    summary = evaluate([(3.0, GREEN), (3.8, YELLOW), (5.0, YELLOW)]).summary
    assert (summary["pointings_right"], summary["pointings_by_nobody"]) == (2, 1)
    assert summary["pointing_list"][-1]["meant"] == ""


def test_an_object_that_was_not_pointed_at_is_an_unasked_fetch(evaluate):
    """The synthetic run fetches yellow at 2 s."""
    summary = evaluate([(3.0, GREEN)]).summary
    assert [one["object"] for one in summary["unasked_fetches"]] == ["yellow"]
    rows = {name: (found, good) for name, found, _, good in rows_of(summary)}
    assert rows["fetched without being pointed at"] == ("1", False)


def test_an_object_that_was_pointed_at_is_none(evaluate):
    summary = evaluate([(1.95, YELLOW)], pointing=(("yellow", 1.9, 3.0),)).summary
    assert summary["unasked_fetches"] == []


def test_report_and_tables_show_it(evaluate):
    evaluation = evaluate([(3.0, GREEN), (5.0, YELLOW)])
    assert "Where the person pointed" in page(evaluation, None)
    rows = {name: found for name, found, _, _ in rows_of(evaluation.summary)}
    assert rows["pointings, object recognised"] == "2, 2"
    results = [{"seed": 0, "success": True} | evaluation.summary]
    assert totals_of(results)["pointings_right (total)"] == 2
    assert any(str(column.header).startswith("pointed") for column in table_of(results).columns)


def test_without_tracking_in_action_space_nothing_of_it_is_said(evaluate):
    evaluation = evaluate([], tracked=False)
    assert "pointings" not in evaluation.summary
    assert "Where the person pointed" not in page(evaluation, None)
    assert not any("pointing" in name for name, *_ in rows_of(evaluation.summary))
    assert "pointings (total)" not in totals_of([{"seed": 0, "success": True}])
