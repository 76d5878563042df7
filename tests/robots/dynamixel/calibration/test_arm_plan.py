"""What the descriptions of the servo arms ask of their servos, and that the words for directions are true."""

from pathlib import Path

import numpy as np
import pytest

from paramove.documents.input_error import InputError
from paramove.robots.description import RobotDescription
from paramove.robots.dynamixel.calibration.arm_plan import PITCH, ROLL, ROOM, YAW, load_plan

DESCRIPTIONS = Path(__file__).parents[4] / "robot_description"
ARMS = ["koch_v1_1", "open_manipulator_x"]


@pytest.mark.parametrize("name", ARMS)
def test_the_plan_is_that_of_the_description(name):
    plan, robot = load_plan(DESCRIPTIONS / name), RobotDescription.load(DESCRIPTIONS / name)
    assert plan.robot == name
    assert plan.baud_rate == 1_000_000
    assert tuple(servo.joint for servo in plan.servos) == robot.joint_names
    assert tuple(servo.number for servo in plan.servos) == robot.servo_ids
    for servo in plan.servos:
        assert servo.lower < 0.0 < servo.upper
        end = servo.upper if servo.grows else servo.lower
        assert abs(end) >= ROOM  # it can be moved as it is asked


@pytest.mark.parametrize("name", ARMS)
def test_the_words_for_directions_are_true(name):
    chain = RobotDescription.load(DESCRIPTIONS / name).chain
    plan = load_plan(DESCRIPTIONS / name).servos
    words = {servo.joint: servo.direction for servo in plan}
    way = {servo.joint: 1.0 if servo.grows else -1.0 for servo in plan}
    zero = np.zeros(len(chain.joints))
    held = chain.kinematics.forward(zero)
    for place, joint in enumerate(chain.joints):
        moved = chain.kinematics.forward(zero + 0.1 * way[joint] * (np.arange(len(zero)) == place))
        step = moved.position - held.position
        rolled = moved.roll - held.roll if abs(step[0]) < 1e-9 else 0.0
        true = {YAW[0]: step[1] > 0.0, PITCH[0]: step[2] < 0.0, ROLL[0]: rolled > 0.0}
        true |= {YAW[1]: step[1] < 0.0, PITCH[1]: step[2] > 0.0, ROLL[1]: rolled < 0.0}
        assert true[words[joint]], joint
    opens = (chain.gripper_open > chain.gripper_closed) is (way[chain.gripper] > 0.0)
    assert words[chain.gripper] == ("the gripper opens" if opens else "the gripper closes")


def test_a_robot_without_servos_is_refused():
    with pytest.raises(InputError, match="hoap3 has no servos on a bus"):
        load_plan(DESCRIPTIONS / "hoap3")
