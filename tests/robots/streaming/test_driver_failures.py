"""The arm driver killed, stopped or fed nonsense: the robot never jumps, and only a person arms again."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.msgs.hoap3_wire_pb2 import Hoap3State
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryPoint, TrajectoryStatus
from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState
from paramove.robots.hoap3.wire import state_of
from paramove.robots.streaming.driver import ArmDriver
from paramove.safety.gate_io import State
from tests.robots.hoap3.movements import HOAP3
from tests.robots.streaming.fake_robot import Rig, trajectory
from tests.robots.streaming.test_driver import GOAL, armed, expect_within_limits

NAN = float("nan")
SUCCEEDED, STOPPED, REJECTED = (
    TrajectoryStatus.STATE_SUCCEEDED,
    TrajectoryStatus.STATE_STOPPED,
    TrajectoryStatus.STATE_REJECTED,
)


def in_motion() -> Rig:
    rig = armed()
    rig.send("one", GOAL, duration_s=3.0)
    for _ in range(15):
        rig.tick()
    assert not rig.robot.reader.at_rest
    return rig


def from_where_it_is(rig: Rig, name: str) -> JointTrajectory:
    """A trajectory from the frame that the robot holds back to its base pose."""
    here = HOAP3.units.to_radians(rig.robot.reader.target)
    joints = list(GOAL)
    message = JointTrajectory(id=name, joints=joints)
    for k in range(151):
        u = k / 150
        share = 10 * u**3 - 15 * u**4 + 6 * u**5
        at = HOAP3.indices(joints)
        message.points.append(
            TrajectoryPoint(time_s=k * 0.01, position_rad=here[at] + share * (HOAP3.base_pose[at] - here[at]))
        )
    return message


def test_restarted_in_motion_it_is_disarmed_and_goes_on_from_rest_once_a_person_arms() -> None:
    rig = in_motion()
    word_ns = rig.now_ns - 10
    rig.driver = ArmDriver(HOAP3)
    rig.driver.on_arm_request(
        ArmRequest(source="test", armed=True, by_person=True), word_ns
    )  # the latched word of the old life
    for _ in range(20):
        rig.tick()
        assert rig.driver.state is State.DISARMED
    assert rig.robot.reader.at_rest
    rig.driver.on_trajectory(from_where_it_is(rig, "early"), rig.now_ns)
    rig.tick()
    assert rig.statuses[-1].code == "not_armed"
    rig.arm()
    assert rig.driver.state is State.ARMED
    rig.driver.on_trajectory(from_where_it_is(rig, "home"), rig.now_ns)
    rig.run_until_rest()
    assert rig.statuses[-1].state == SUCCEEDED
    np.testing.assert_array_equal(rig.robot.reader.target, HOAP3.units.to_counts(HOAP3.base_pose))
    assert rig.robot.reader.rejected_batches == 0
    expect_within_limits(rig)


def test_a_restarted_driver_is_not_armed_while_the_robot_still_moves() -> None:
    rig = in_motion()
    rig.driver = ArmDriver(HOAP3)
    rig.tick()
    rig.arm()
    assert rig.driver.state is State.DISARMED
    assert rig.output is not None
    assert [fault.code for fault in rig.output.safety.faults] == ["arming_moving"]
    expect_within_limits(rig)


def test_stopped_for_a_second_in_motion_it_holds_and_drops_what_waited() -> None:
    rig = in_motion()
    before = rig.now_ns
    for _ in range(15):
        rig.tick(driver_runs=False)
    assert rig.robot.reader.at_rest, "the stop ramp has brought the robot to rest"
    rig.driver.on_trajectory(trajectory("queued", GOAL, 1.0), before + 500_000_000)
    for _ in range(8):
        rig.tick()
    assert rig.driver.state is State.HOLD
    assert rig.output is not None
    assert "stalled for 1.0" in rig.output.safety.faults[0].detail
    assert rig.output.safety.faults[0].code == "driver_stalled"
    assert "arm again" in rig.output.safety.faults[0].detail
    said = {status.trajectory_id: status for status in rig.statuses}
    assert (said["queued"].state, said["queued"].code) == (REJECTED, "stale")
    assert said["one"].state == STOPPED
    rig.driver.on_trajectory(from_where_it_is(rig, "later"), rig.now_ns)
    rig.tick()
    assert rig.statuses[-1].code == "not_armed"
    expect_within_limits(rig)


def test_stopped_at_rest_it_stays_armed_but_drops_what_waited() -> None:
    rig = armed()
    for _ in range(15):
        rig.tick(driver_runs=False)
    rig.driver.on_trajectory(trajectory("queued", GOAL, 1.0), rig.now_ns - 300_000_000)
    rig.tick()
    assert rig.driver.state is State.ARMED
    assert (rig.statuses[-1].trajectory_id, rig.statuses[-1].code) == ("queued", "stale")
    rig.send("queued", GOAL)
    rig.run_until_rest()
    assert rig.statuses[-1].state == SUCCEEDED


def test_an_arm_word_that_waited_too_long_does_not_arm() -> None:
    rig = Rig()
    rig.tick()
    said_ns = rig.now_ns + 1
    for _ in range(16):
        rig.tick(driver_runs=False)
    rig.driver.on_arm_request(ArmRequest(source="test", armed=True, by_person=True), said_ns)
    rig.tick()
    assert rig.driver.state is State.DISARMED
    assert rig.output is not None
    assert [fault.code for fault in rig.output.safety.faults] == ["arming_stale"]
    rig.arm()
    assert rig.driver.state is State.ARMED


def test_fingers_may_begin_where_they_are_measured() -> None:
    """They rest on an object, far from where they are commanded; the command goes there smoothly."""
    rig = armed()
    close = {"right_fingers": 55.0}
    rig.send("close", close)
    rig.run_until_rest()
    rig.driver.on_trajectory(
        JointTrajectory(
            id="open",
            joints=["right_fingers"],
            points=[
                TrajectoryPoint(time_s=t, position_rad=[np.deg2rad(angle)])
                for t, angle in ((0.0, 9.0), (1.0, 9.0), (2.0, -30.0))
            ],
        ),
        rig.now_ns,
    )
    rig.run_until_rest()
    assert rig.statuses[-1].state == SUCCEEDED, rig.statuses[-1].reason
    expect_within_limits(rig)


@pytest.mark.parametrize(
    ("message", "code"),
    [
        (JointTrajectory(), "id"),
        (JointTrajectory(id="x"), "joints"),
        (JointTrajectory(id="x", joints=["right_elbow"]), "times"),
        (JointTrajectory(id="x", joints=["right_elbow"], points=[TrajectoryPoint(), TrajectoryPoint()]), "joints"),
        (
            JointTrajectory(
                id="x",
                joints=["right_elbow"],
                points=[TrajectoryPoint(position_rad=[NAN]), TrajectoryPoint(time_s=1.0, position_rad=[NAN])],
            ),
            "not_finite",
        ),
        (
            JointTrajectory(
                id="x",
                joints=["right_elbow"],
                points=[TrajectoryPoint(position_rad=[0.0]), TrajectoryPoint(time_s=NAN, position_rad=[0.0])],
            ),
            "not_finite",
        ),
        (
            JointTrajectory(
                id="x",
                joints=["right_elbow"],
                points=[TrajectoryPoint(position_rad=[0.0]), TrajectoryPoint(time_s=1.0, position_rad=[0.0])],
            ),
            "start",
        ),
    ],
    ids=["default", "no joints", "no points", "q = []", "nan angle", "nan time", "zeros"],
)
def test_empty_and_impossible_trajectories_are_refused_and_never_read_as_zero(
    message: JointTrajectory, code: str
) -> None:
    rig = armed()
    rig.driver.on_trajectory(message, rig.now_ns)
    for _ in range(5):
        output = rig.tick()
        assert output is not None
        assert output.stream is None
    assert (rig.statuses[-1].state, rig.statuses[-1].code) == (REJECTED, code)
    assert "allowed" in rig.statuses[-1].reason
    np.testing.assert_array_equal(rig.robot.reader.target, HOAP3.units.to_counts(HOAP3.base_pose))


def test_empty_words_and_states_move_nothing() -> None:
    rig = armed()
    rig.driver.on_robot_state(state_of(Hoap3State()), rig.now_ns)
    assert rig.driver.state is State.ARMED
    rig.driver.on_arm_request(ArmRequest(), rig.now_ns + 1)
    rig.tick()
    assert rig.driver.state is State.DISARMED, "an empty arm word disarms"


def test_a_robot_that_says_nothing_of_its_joints_is_not_taken_to_be_at_zero() -> None:
    rig = Rig()
    driver = ArmDriver(HOAP3)
    driver.on_robot_state(state_of(Hoap3State()), rig.now_ns)
    output = driver.tick(rig.now_ns)
    assert output.joint_states is None
    assert output.safety.state == SafetyState.STATE_DISCONNECTED
