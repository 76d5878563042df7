"""What the descriptions of the servo arms ask of their servos, and that the words for directions are true."""

from pathlib import Path

import numpy as np
import pytest

from paramove.input_error import InputError
from paramove.robots.description import RobotDescription
from paramove.robots.dynamixel.arm_plan import PITCH, ROLL, YAW, load_plan

DESCRIPTIONS = Path(__file__).parents[3] / "robot_description"
ARMS = ["koch_v1_1", "open_manipulator_x"]


@pytest.mark.parametrize("name", ARMS)
def test_the_plan_is_that_of_the_description(name):
    plan, robot = load_plan(DESCRIPTIONS / name), RobotDescription.load(DESCRIPTIONS / name)
    assert plan.robot == name
    assert plan.baud_rate == 1_000_000
    assert tuple(servo.joint for servo in plan.servos) == robot.joint_names
    assert tuple(servo.number for servo in plan.servos) == robot.servo_ids
    for servo in plan.servos:
        assert servo.lower < servo.posture < servo.upper
        assert servo.direction


@pytest.mark.parametrize("name", ARMS)
def test_the_words_for_directions_are_true(name):
    chain = RobotDescription.load(DESCRIPTIONS / name).chain
    words = {servo.joint: servo.direction for servo in load_plan(DESCRIPTIONS / name).servos}
    zero = np.zeros(len(chain.joints))
    held = chain.kinematics.forward(zero)
    for place, joint in enumerate(chain.joints):
        moved = chain.kinematics.forward(zero + 0.1 * (np.arange(len(zero)) == place))
        step = moved.position - held.position
        true = {YAW: step[1] > 0.0, PITCH: step[2] < 0.0, ROLL: moved.roll > held.roll and abs(step[0]) < 1e-9}
        assert true[words[joint]], joint
    opens = chain.gripper_open > chain.gripper_closed
    assert words[chain.gripper] == ("the gripper opens" if opens else "the gripper closes")


def test_a_robot_without_servos_is_refused():
    with pytest.raises(InputError, match="hoap3 has no servos on a bus"):
        load_plan(DESCRIPTIONS / "hoap3")
