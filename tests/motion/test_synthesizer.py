"""Goals become motions, one goal at a time, whatever driver and hand do."""

from __future__ import annotations

import itertools
import re

import numpy as np
import pytest

from paramove.motion.synthesizer import REMEMBERED_GOALS, RESEND_NS
from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from tests.motion.fake_driver import (
    FAILED,
    OFFER,
    PERIOD_NS,
    PLACE,
    REJECTED,
    SUCCEEDED,
    Cell,
    FakeDriver,
    goal,
    relocate,
)
from tests.motion.reaching import planner

ACCEPTED, EXECUTING = RelocationStatus.STATE_ACCEPTED, RelocationStatus.STATE_EXECUTING


def test_relocates() -> None:
    cell = Cell()
    last = cell.do(relocate())
    assert last.state == SUCCEEDED, last.reason
    assert cell.driver.at_base
    assert not cell.driver.held
    states, phases = zip(*cell.said(), strict=True)
    assert states[0] == ACCEPTED
    assert set(states[1:-1]) == {EXECUTING}
    told = [phase for phase, _ in itertools.groupby(phase for phase in phases if phase)]
    order = ["approach", "lower", "reach", "grasp", "lift", "carry", "place", "release", "withdraw", "retreat"]
    assert told == order
    assert [trajectory.id for trajectory in cell.driver.heard] == ["g/1", "g/2"]
    holding = {status.phase: status.holding for status in cell.statuses}
    assert not holding["approach"]
    assert holding["carry"]
    assert not holding["retreat"]


def test_says_whether_the_places_lie_within_the_training() -> None:
    """The opening is nearer than the nearest demonstrated target; what is refused is told of as well."""
    cell = Cell()
    cell.do(relocate())
    inside, outside = RelocationStatus.HULL_INSIDE, RelocationStatus.HULL_OUTSIDE
    movement = planner().movement
    expected = [
        inside if movement.within_training([place.x, place.y, place.z]) else outside
        for place in (getattr(relocate(), "from"), relocate().to)
    ]
    assert {(status.from_hull, status.to_hull) for status in cell.statuses} == {tuple(expected)}
    far = cell.do(relocate("far", source=(0.30, 0.0)))
    assert (far.state, far.from_hull) == (REJECTED, outside)
    offered = cell.do(goal(RelocationGoal.KIND_OFFER_HAND, "offer", source=OFFER))
    assert offered.to_hull == RelocationStatus.HULL_UNSPECIFIED


def test_every_trajectory_goes_from_rest_to_rest_with_increasing_times() -> None:
    cell = Cell()
    cell.do(relocate())
    for trajectory in cell.driver.heard:
        times = np.array([point.time_s for point in trajectory.points])
        assert times[0] == 0.0
        assert (np.diff(times) > 0).all()
        assert {len(point.position_rad) for point in trajectory.points} == {len(trajectory.joints)} == {6}
        assert trajectory.HasField("captured")


def test_the_same_id_is_answered_and_not_done_again() -> None:
    cell = Cell()
    wanted = relocate()
    cell.synthesizer.on_goal(wanted)
    cell.synthesizer.on_goal(wanted)
    cell.tick()
    assert cell.said() == [(ACCEPTED, ""), (ACCEPTED, "")]
    assert len(cell.driver.heard) == 1
    cell.do(wanted)
    done = len(cell.driver.heard)
    cell.synthesizer.on_goal(wanted)
    for _ in range(30):
        cell.tick()
    assert cell.statuses[-1].state == SUCCEEDED
    assert len(cell.driver.heard) == done


def test_another_goal_meanwhile_is_refused_as_busy() -> None:
    cell = Cell()
    cell.synthesizer.on_goal(relocate("first"))
    cell.tick()
    cell.synthesizer.on_goal(relocate("second"))
    cell.tick()
    assert cell.statuses[-1].goal_id == "second"
    assert cell.statuses[-1].state == REJECTED
    assert "busy with goal first" in cell.statuses[-1].reason
    assert len(cell.driver.heard) == 1


def test_feeling_nothing_fails_and_brings_the_arm_home() -> None:
    cell = Cell(FakeDriver(graspable=False))
    last = cell.do(relocate())
    assert last.state == FAILED
    assert "felt nothing in the hand at (17.7, -2.0) cm" in last.reason
    assert cell.driver.at_base
    assert cell.said()[-2][1] == "retreat"
    cell.driver.graspable = True
    assert cell.do(relocate("again")).state == SUCCEEDED


def test_an_object_that_slips_on_the_way_is_noticed() -> None:
    cell = Cell(FakeDriver(slips_at="carry"))
    last = cell.do(relocate())
    assert last.state == FAILED
    assert "slipped out of the hand on the way to (13.5, -3.8) cm" in last.reason
    assert cell.driver.at_base
    cell.driver.slips_at = ""
    assert cell.do(relocate("again")).state == SUCCEEDED


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"avoid": [(0.177, -0.005)]}, r"would come within -?[\d.]+ mm of standing_0 in \w+ \(allowed 5 mm\)"),
        ({"source": (0.30, 0.0)}, r"gripper at .* cm is .* cm from the shoulder; the arm reaches"),
        ({"target": (0.135, 0.30)}, "gripper at"),
        ({"source": (0.177, -0.02, -0.130)}, "would come within .* of surface"),
        ({"source": (np.nan, 0.0)}, "finite numbers"),
    ],
)
def test_what_is_not_clear_or_not_reachable_is_refused_before_the_arm_moves(changes: dict, words: str) -> None:
    cell = Cell()
    last = cell.do(relocate(**changes))
    assert last.state == REJECTED
    assert re.search(words, last.reason), last.reason
    assert cell.driver.heard == []
    assert cell.do(relocate("other")).state == SUCCEEDED


def test_goals_that_make_no_sense_are_refused_with_what_would_work() -> None:
    cell = Cell()
    elsewhere = relocate("frame")
    elsewhere.frame = "world"
    assert "this arm's goals are in 'right_shoulder'" in cell.do(elsewhere).reason
    assert "none of RELOCATE, OFFER_HAND, TAKE" in cell.do(goal(RelocationGoal.KIND_UNSPECIFIED, "kind")).reason
    assert "lacks its position 'to'" in cell.do(goal(RelocationGoal.KIND_RELOCATE, "place", source=PLACE)).reason
    assert "offer the hand first" in cell.do(goal(RelocationGoal.KIND_TAKE, "take")).reason
    assert "nothing is held" in cell.do(goal(RelocationGoal.KIND_PLACE_HELD, "put", target=PLACE)).reason
    assert cell.driver.heard == []


def test_an_open_hand_that_waits_holds_nothing() -> None:
    cell = Cell()
    cell.do(goal(RelocationGoal.KIND_OFFER_HAND, "offer", source=OFFER))
    assert not cell.synthesizer.holding
    last = cell.do(goal(RelocationGoal.KIND_PLACE_HELD, "put", target=(0.19, -0.10)))
    assert (last.state, last.reason) == (REJECTED, "nothing is held; take an object first")


def test_objects_beside_the_way_are_kept_clear_of() -> None:
    cell = Cell()
    last = cell.do(relocate(avoid=[(0.177, 0.06), (0.177, -0.09)]))
    assert last.state == SUCCEEDED, last.reason


def test_offer_take_put() -> None:
    cell = Cell()
    assert cell.do(goal(RelocationGoal.KIND_OFFER_HAND, "offer", source=OFFER)).state == SUCCEEDED
    assert not cell.driver.at_base
    assert cell.do(goal(RelocationGoal.KIND_TAKE, "take")).state == SUCCEEDED
    assert cell.driver.held
    assert cell.do(goal(RelocationGoal.KIND_PLACE_HELD, "put", target=(0.19, -0.10))).state == SUCCEEDED
    assert cell.driver.at_base
    assert not cell.driver.held


def test_taking_nothing_fails_with_an_open_hand_that_waits() -> None:
    cell = Cell(FakeDriver(graspable=False))
    cell.do(goal(RelocationGoal.KIND_OFFER_HAND, "offer", source=OFFER))
    last = cell.do(goal(RelocationGoal.KIND_TAKE, "take"))
    assert last.state == FAILED
    assert "felt nothing" in last.reason
    assert "felt_opening is 0.12" in last.reason
    assert cell.driver.opening > 0.7
    cell.driver.graspable = True
    assert cell.do(goal(RelocationGoal.KIND_TAKE, "again")).state == SUCCEEDED


def test_rest_brings_the_arm_home_and_is_done_at_once_there() -> None:
    cell = Cell()
    assert cell.do(goal(RelocationGoal.KIND_REST, "home")).state == SUCCEEDED
    assert cell.driver.heard == []
    cell.do(goal(RelocationGoal.KIND_OFFER_HAND, "offer", source=OFFER))
    assert cell.do(goal(RelocationGoal.KIND_REST, "back")).state == SUCCEEDED
    assert cell.driver.at_base


def test_release_opens_the_hand_where_it_is() -> None:
    cell = Cell()
    cell.do(goal(RelocationGoal.KIND_OFFER_HAND, "offer", source=OFFER))
    cell.do(goal(RelocationGoal.KIND_TAKE, "take"))
    arm = cell.driver.angles[:5].copy()
    assert cell.do(goal(RelocationGoal.KIND_RELEASE, "release")).state == SUCCEEDED
    np.testing.assert_allclose(cell.driver.angles[:5], arm, rtol=0, atol=1e-6)
    assert not cell.driver.held


def test_a_relocation_from_a_waiting_hand_is_refused() -> None:
    cell = Cell()
    cell.do(goal(RelocationGoal.KIND_OFFER_HAND, "offer", source=OFFER))
    last = cell.do(relocate("too soon"))
    assert last.state == REJECTED
    assert "send a goal of kind REST first" in last.reason


@pytest.mark.parametrize("deaf", [1, 4])
def test_a_trajectory_is_sent_again_until_it_is_acknowledged(deaf: int) -> None:
    cell = Cell(FakeDriver(deaf=deaf))
    assert cell.do(relocate()).state == SUCCEEDED
    assert [trajectory.id for trajectory in cell.driver.heard] == ["g/1"] * (deaf + 1) + ["g/2"]
    sent = [trajectory.captured.ToNanoseconds() for trajectory in cell.driver.heard[1 : deaf + 1]]
    apart = np.diff(sent)
    assert ((apart >= RESEND_NS) & (apart < RESEND_NS + 2 * PERIOD_NS)).all()


def test_words_about_other_trajectories_are_passed_over() -> None:
    cell = Cell(FakeDriver(deaf=1))
    cell.synthesizer.on_goal(relocate())
    cell.tick()
    cell.synthesizer.on_trajectory_status(
        TrajectoryStatus(trajectory_id="old/1", state=TrajectoryStatus.STATE_SUCCEEDED)
    )
    cell.tick()
    assert cell.said() == [(ACCEPTED, "")]
    assert cell.do(relocate()).state == SUCCEEDED


def test_a_refused_motion_fails_the_goal_and_the_next_one_is_done() -> None:
    cell = Cell(FakeDriver(refuses=1))
    last = cell.do(relocate())
    assert last.state == FAILED
    assert "not armed" in last.reason
    assert cell.driver.at_base
    cell.driver.refuses = 0
    assert cell.do(relocate("again")).state == SUCCEEDED


def test_only_so_many_goals_are_remembered() -> None:
    cell = Cell()
    for number in range(REMEMBERED_GOALS + 5):
        cell.do(goal(RelocationGoal.KIND_REST, f"rest-{number}"))
    assert len(cell.synthesizer._latest) == REMEMBERED_GOALS
