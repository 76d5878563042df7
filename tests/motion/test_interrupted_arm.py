"""A synthesizer that does not know where its arm is: after its own restart, and after a motion that was stopped."""

from __future__ import annotations

import re

import numpy as np
import pytest
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.motion.arm_state import REST_NS
from paramove.motion.clear_plans import joined, joint_motion
from paramove.motion.synthesizer import RESTARTED, STATUS_TIMEOUT_NS
from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from tests.motion.fake_driver import (
    FAILED,
    OFFER,
    PERIOD_NS,
    REJECTED,
    SUCCEEDED,
    Cell,
    FakeDriver,
    goal,
    relocate,
)
from tests.motion.reaching import ARM, GRASP_Z, HOAP3, JOINTS, planner


def rest(name: str = "home") -> RelocationGoal:
    return goal(RelocationGoal.KIND_REST, name)


def begun(cell: Cell, phase: str) -> None:
    """Begins a relocation and ticks until the arm is in a phase of it."""
    cell.synthesizer.on_goal(relocate())
    while (RelocationStatus.STATE_EXECUTING, phase) not in cell.said():
        cell.tick()


def test_restarted_at_the_base_pose_it_goes_on_at_once() -> None:
    cell = Cell()
    cell.restart()
    cell.feel()
    cell.synthesizer.on_goal(relocate())
    cell.tick()
    assert cell.said() == [(RelocationStatus.STATE_ACCEPTED, "")]
    assert cell.do(relocate()).state == SUCCEEDED


def test_before_any_joint_is_heard_a_goal_waits() -> None:
    cell = Cell()
    cell.restart()
    cell.synthesizer.on_goal(relocate())
    assert cell.synthesizer.tick(PERIOD_NS).trajectories == ()
    assert "waits until the arm rests" in cell.synthesizer.detail
    assert cell.do(relocate()).state == SUCCEEDED


def test_restarted_with_the_hand_offered_it_takes_what_it_is_given() -> None:
    cell = Cell()
    cell.do(goal(RelocationGoal.KIND_OFFER_HAND, "offer", source=OFFER))
    cell.restart()
    assert cell.do(goal(RelocationGoal.KIND_TAKE, "take")).state == SUCCEEDED
    assert cell.driver.held
    assert cell.do(goal(RelocationGoal.KIND_PLACE_HELD, "put", target=(0.19, -0.10))).state == SUCCEEDED
    assert cell.driver.at_base


def test_restarted_away_from_the_base_pose_it_asks_for_rest_and_brings_the_arm_home() -> None:
    cell = Cell()
    cell.do(goal(RelocationGoal.KIND_OFFER_HAND, "offer", source=OFFER))
    cell.restart()
    for again in (relocate("one"), goal(RelocationGoal.KIND_OFFER_HAND, "two", source=OFFER)):
        last = cell.do(again)
        assert (last.state, last.reason) == (
            REJECTED,
            "the arm is not at its base pose; send a goal of kind REST first",
        )
    assert cell.do(rest()).state == SUCCEEDED
    assert cell.driver.at_base
    assert cell.do(relocate("three")).state == SUCCEEDED


@pytest.mark.parametrize("phase", ["approach", "carry"])
def test_restarted_in_motion_it_waits_until_the_arm_rests_and_brings_it_home(phase: str) -> None:
    cell = Cell()
    begun(cell, phase)
    cell.restart()
    heard = len(cell.driver.heard)
    cell.synthesizer.on_goal(rest())
    while cell.driver.playing is not None:
        cell.tick()
        assert len(cell.driver.heard) == heard, "nothing is sent while the arm moves"
    assert cell.do(rest()).state == SUCCEEDED
    assert cell.driver.at_base
    assert not cell.driver.held
    assert cell.do(relocate("again")).state == SUCCEEDED


@pytest.mark.parametrize(("motion", "share"), [(1, 0.08), (1, 0.3), (1, 0.7), (2, 0.2), (2, 0.6), (2, 0.9)])
def test_stopped_anywhere_it_brings_the_arm_home(motion: int, share: float) -> None:
    cell = Cell(FakeDriver(stops=motion, stops_at=share))
    last = cell.do(relocate())
    assert last.state == FAILED
    assert "joint right_elbow stuck" in last.reason
    cell.driver.stops = 0
    last = cell.do(rest())
    assert last.state == SUCCEEDED, last.reason
    assert cell.driver.at_base
    assert not cell.driver.held
    assert cell.do(relocate("again")).state == SUCCEEDED


def test_what_it_holds_is_put_down_before_the_hand_opens() -> None:
    cell = Cell()
    begun(cell, "lift")
    cell.restart()
    assert cell.do(rest()).state == SUCCEEDED
    home = cell.driver.heard[-1]
    released = next(phase.start_s for phase in home.phases if phase.name == "release")
    at = next(point for point in home.points if point.time_s >= released)
    assert ARM.kinematics.forward(list(at.position_rad[:5])).gripper[2] == pytest.approx(GRASP_Z, abs=0.002)


def test_a_goal_that_the_dead_process_had_accepted_has_failed() -> None:
    cell = Cell()
    begun(cell, "approach")
    cell.restart()
    asked = relocate()
    asked.asked_again = True
    last = cell.do(asked)
    assert (last.state, last.reason) == (FAILED, RESTARTED)


def test_a_known_goal_that_is_asked_for_again_is_answered() -> None:
    cell = Cell()
    begun(cell, "carry")
    asked = relocate()
    asked.asked_again = True
    assert cell.do(asked).state == SUCCEEDED
    assert [trajectory.id for trajectory in cell.driver.heard] == ["g/1", "g/2"]


def test_a_motion_of_somebody_else_is_waited_for() -> None:
    """As one that was given up here and that the driver had accepted all the same."""
    cell = Cell()
    other = TrajectoryStatus(trajectory_id="other/1", state=TrajectoryStatus.STATE_EXECUTING)
    cell.synthesizer.on_trajectory_status(other)
    cell.synthesizer.on_goal(relocate())
    for _ in range(REST_NS // PERIOD_NS):
        cell.tick()
        assert cell.driver.heard == []
    assert cell.do(relocate()).state == SUCCEEDED


def test_a_trajectory_that_came_too_late_is_said_again_with_the_time_of_now() -> None:
    cell = Cell(FakeDriver(stale=2))
    assert cell.do(relocate()).state == SUCCEEDED
    assert [trajectory.id for trajectory in cell.driver.heard] == ["g/1", "g/1", "g/1", "g/2"]
    said = [trajectory.captured.ToNanoseconds() for trajectory in cell.driver.heard]
    assert said == sorted(set(said))


def test_a_driver_that_finds_everything_too_late_fails_the_goal() -> None:
    cell = Cell(FakeDriver(stale=100))
    last = cell.do(relocate())
    assert last.state == FAILED
    assert "allowed up to 1 s" in last.reason


@pytest.mark.parametrize(
    "joints",
    [
        [],
        [JointState(name=name, position=float("nan")) for name in HOAP3.joint_names],
        [JointState(name=name, position=float("inf")) for name in HOAP3.joint_names],
    ],
    ids=["none", "nan", "inf"],
)
def test_joints_that_are_missing_or_not_finite_are_not_taken_for_a_pose(joints: list[JointState]) -> None:
    cell = Cell()
    cell.restart()
    cell.synthesizer.on_joint_states(JointStates(joints=joints))
    cell.synthesizer.on_goal(rest())
    assert cell.synthesizer.tick(PERIOD_NS).statuses == ()
    assert "waits until the arm rests" in cell.synthesizer.detail
    assert cell.do(rest()).state == SUCCEEDED


def test_a_goal_for_another_arm_than_the_drivers_is_rejected_with_what_helps() -> None:
    cell = Cell()
    cell.restart()
    cell.synthesizer.on_goal(rest())
    cell.synthesizer.on_joint_states(JointStates(joints=[JointState(name="right_elbow", position=0.0)]))
    (last,) = cell.synthesizer.tick(PERIOD_NS).statuses
    assert last.state == REJECTED
    assert "right_shoulder_pitch" in last.reason
    assert "same `robot` as the arm's driver" in last.reason


def test_a_driver_that_says_nothing_of_a_motion_ends_the_goal() -> None:
    cell = Cell(FakeDriver(deaf=1000))
    last = cell.do(relocate())
    assert last.state == FAILED
    assert "no status of the motion" in last.reason
    assert cell.now_ns > STATUS_TIMEOUT_NS


def test_a_status_with_a_time_that_is_no_number_is_passed_over() -> None:
    cell = Cell()
    begun(cell, "approach")
    cell.synthesizer.on_trajectory_status(
        TrajectoryStatus(trajectory_id="g/1", state=TrajectoryStatus.STATE_EXECUTING, time_s=float("nan"))
    )
    assert cell.do(relocate()).state == SUCCEEDED


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        (RelocationGoal(), "a goal without an id"),
        (RelocationGoal(id="empty"), "this arm's goals are in 'right_shoulder'"),
        (RelocationGoal(id="none", frame="right_shoulder"), "kind 0 is none of RELOCATE"),
        (relocate("avoid", avoid=[(float("nan"), 0.0)]), "to avoid are .*nan.*; finite numbers in m"),
        (relocate("many", avoid=[(0.2, 0.01 * k) for k in range(9)]), "9 objects .* at most 8"),
        (relocate("up", target=(0.135, -0.038, float("inf"))), "finite numbers in m"),
    ],
    ids=["default", "no frame", "no kind", "nan to avoid", "too many to avoid", "infinite height"],
)
def test_empty_and_impossible_goals_are_refused_and_the_arm_stays(wanted: RelocationGoal, words: str) -> None:
    cell = Cell()
    last = cell.do(wanted)
    assert last.state == REJECTED
    assert re.search(words, last.reason), last.reason
    assert cell.driver.heard == []


def test_a_joint_motion_keeps_half_the_limits_and_ends_at_rest() -> None:
    plan = planner()
    end = HOAP3.base_pose[JOINTS] + np.deg2rad([-60.0, -20.0, 30.0, -40.0, -50.0, -60.0])
    motion = joint_motion(plan, HOAP3.base_pose[JOINTS], end, "retreat")
    speed = np.diff(motion.angles, axis=0) / np.diff(motion.times)[:, None]
    assert (np.abs(speed) <= 0.5 * plan.velocity * 1.001).all()
    bend = np.diff(speed, axis=0) / np.diff(motion.times)[1:, None]
    assert (np.abs(bend) <= 0.5 * plan.acceleration * 1.01).all()
    np.testing.assert_allclose(motion.angles[-1], end, rtol=0, atol=1e-12)
    with pytest.raises(ValueError, match="begins where the first does not end"):
        joined(motion, motion)
