"""Where an arm rests: only from recent measurements over a while, the same for all arms."""

from __future__ import annotations

import numpy as np
import pytest
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.motion.arm_state import REST_NS, STALE_NS, ArmState
from paramove.motion.gripper_arm import GripperArm
from tests.motion.reaching import HOAP3
from tests.motion.servo_reaching import description
from tests.robots.servo_arms import ARMS

PERIOD_NS = 66_666_667
ROBOTS = [HOAP3, *ARMS]
each_robot = pytest.mark.parametrize("robot", ROBOTS, ids=[robot.name for robot in ROBOTS])
KOCH = GripperArm.of(description("koch_v1_1"), "right")


def measured(arm: GripperArm, angles: np.ndarray) -> JointStates:
    others = [JointState(name="another", position=9.0)]
    rows = zip(arm.joints, angles.tolist(), strict=True)
    return JointStates(joints=[*others, *(JointState(name=name, position=angle) for name, angle in rows)])


def after(arm: GripperArm, rows: np.ndarray) -> tuple[ArmState, int]:
    """A state that received these angles, one a period, and the time of the last."""
    state = ArmState(arm)
    for number, row in enumerate(rows):
        state.handle(measured(arm, row), number * PERIOD_NS)
    return state, (len(rows) - 1) * PERIOD_NS


def away(arm: GripperArm) -> np.ndarray:
    return arm.base_angles + np.deg2rad(8.0)


@each_robot
def test_finds_the_pose_at_rest_and_at_the_base_pose_at_once(robot) -> None:
    arm = GripperArm.of(robot, "right")
    state, now_ns = after(arm, np.repeat(away(arm)[None], 20, axis=0))
    assert state.estimate_pose(now_ns)
    assert state.pose is not None
    assert state.pose.measured
    np.testing.assert_allclose(state.pose.angles, away(arm), rtol=0, atol=1e-12)
    np.testing.assert_allclose(state.pose.gripper, arm.position(away(arm)), rtol=0, atol=1e-12)
    state, now_ns = after(arm, arm.base_angles[None])
    assert state.estimate_pose(now_ns)
    assert state.known
    assert state.pose is None


@each_robot
def test_finds_nothing_too_early_while_moving_or_when_stale(robot) -> None:
    arm = GripperArm.of(robot, "right")
    rests = np.repeat(away(arm)[None], 20, axis=0)
    assert not ArmState(arm).estimate_pose(0)
    state, now_ns = after(arm, rests[: REST_NS // PERIOD_NS])
    assert not state.estimate_pose(now_ns)
    state, now_ns = after(arm, rests + np.deg2rad(0.2) * np.arange(20)[:, None])
    assert not state.estimate_pose(now_ns)
    state, now_ns = after(arm, rests)
    assert not state.estimate_pose(now_ns + STALE_NS + 1)
    assert state.estimate_pose(now_ns)


@each_robot
@pytest.mark.parametrize(("opening", "holds"), [(0.4, True), (0.0, False), (0.9, False)])
def test_a_gripper_that_rests_where_objects_stop_it_is_taken_to_be_closed_on_one(robot, opening, holds) -> None:
    arm = GripperArm.of(robot, "right")
    angles = away(arm)
    angles[-1] = arm.angle_of(opening)
    state, now_ns = after(arm, np.repeat(angles[None], 20, axis=0))
    assert state.estimate_pose(now_ns)
    assert state.opening == pytest.approx(0.0 if holds else opening, abs=1e-9)
    assert (state.opening < arm.felt_opening < state.measured) == holds


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_what_is_no_angle_counts_for_nothing(bad: float) -> None:
    state, now_ns = after(KOCH, np.repeat(away(KOCH)[None], 20, axis=0))
    angles = away(KOCH)
    angles[2] = bad
    assert not state.handle(measured(KOCH, angles), now_ns)
    assert not state.handle(JointStates(joints=[JointState(name="elbow_flex", position=0.0)]), now_ns)
    assert state.missing == tuple(name for name in KOCH.joints if name != "elbow_flex")
    assert state.estimate_pose(now_ns)
    assert state.pose is not None
    np.testing.assert_allclose(state.pose.angles, away(KOCH), rtol=0, atol=1e-12)
