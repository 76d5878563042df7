"""Keys become small trajectories that the safety gate of a servo arm accepts, one at a time."""

from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.operator.jogging import OVERDUE_S, Jogging
from paramove.robots.description import RobotDescription
from paramove.safety.trajectory_check import check_trajectory

ROBOTS = Path(__file__).parents[2] / "robot_description"
STEP = float(np.deg2rad(2.0))


def states(angles):
    return JointStates(joints=[JointState(name=name, position=angle) for name, angle in angles.items()])


def told(message, state, reason=""):
    return TrajectoryStatus(trajectory_id=message.id, state=state, reason=reason)


@pytest.fixture
def jogging():
    jogging = Jogging("jog", STEP)
    jogging.handle_states(states({"pan": 0.1, "lift": -0.2}))
    return jogging


@pytest.mark.parametrize("name", ["koch_v1_1", "open_manipulator_x", "hoap3"])
@pytest.mark.parametrize("degrees", [0.5, 2.0, 10.0])
def test_every_step_keeps_to_the_limits(name, degrees):
    robot = RobotDescription.load(ROBOTS / name)
    limits, step = robot.motion_limits, float(np.deg2rad(degrees))
    jogging = Jogging("jog", step)
    jogging.handle_states(states(dict(zip(robot.joint_names, robot.base_pose, strict=True))))
    for place, joint in enumerate(robot.joint_names):
        jogging.choose(place)
        up = robot.base_pose[place] + step < robot.soft_upper[place]
        message = jogging.step(1 if up else -1, 0)
        path = check_trajectory(
            [joint], [p.time_s for p in message.points], [p.position_rad for p in message.points], robot.base_pose,
            limits, 0.01,
        )  # fmt: skip
        assert abs(path.rows[-1] - robot.base_pose)[place] == pytest.approx(step)
        jogging.handle_status(told(message, TrajectoryStatus.STATE_SUCCEEDED))


def test_a_step_of_a_driver_that_is_gone_is_waited_for_no_longer(jogging):
    duration_s = jogging.step(1, 0).points[-1].time_s
    jogging.tick(int(1e9 * (duration_s + OVERDUE_S)))
    assert jogging.is_moving
    jogging.tick(int(1e9 * (duration_s + OVERDUE_S)) + 1)
    assert "was it restarted?" in jogging.detail
    assert jogging.step(1, 0).points[0].position_rad[0] == pytest.approx(0.1)


def test_one_step_at_a_time(jogging):
    first = jogging.step(1, 0)
    assert jogging.is_moving
    assert jogging.step(1, 0) is None
    jogging.handle_status(TrajectoryStatus(trajectory_id="another", state=TrajectoryStatus.STATE_SUCCEEDED))
    jogging.handle_status(told(first, TrajectoryStatus.STATE_EXECUTING))
    assert jogging.step(1, 0) is None
    jogging.handle_status(told(first, TrajectoryStatus.STATE_SUCCEEDED))
    second = jogging.step(-1, 0)
    assert second.id != first.id


def test_steps_add_up_although_the_joint_sags(jogging):
    for _ in range(3):
        message = jogging.step(1, 0)
        jogging.handle_status(told(message, TrajectoryStatus.STATE_SUCCEEDED))
        jogging.handle_states(states({"pan": 0.05, "lift": -0.2}))
    assert message.points[-1].position_rad[0] == pytest.approx(0.1 + 3 * STEP)


def test_after_a_refusal_it_begins_where_the_joint_is(jogging):
    message = jogging.step(1, 0)
    jogging.handle_status(told(message, TrajectoryStatus.STATE_REJECTED, "trajectory refused (joint_limit)"))
    assert jogging.detail == "trajectory refused (joint_limit)"
    jogging.handle_states(states({"pan": 0.3, "lift": -0.2}))
    assert jogging.step(-1, 0).points[0].position_rad[0] == pytest.approx(0.3)


def test_joints_are_chosen_by_their_place(jogging):
    jogging.choose(1)
    jogging.choose(7)
    assert jogging.joint == "lift"
    assert list(jogging.step(1, 0).joints) == ["lift"]


def test_before_the_arm_is_heard_nothing_moves():
    jogging = Jogging("jog", STEP)
    assert (jogging.step(1, 0), jogging.joint) == (None, "")
