"""The same tests for a real arm (`make test-hardware PORT=/dev/serial/by-id/…`) and for an emulated one."""

from pathlib import Path

import pytest

from paramove.robots.description import RobotDescription
from paramove.robots.dynamixel.driven_arm import joint_servos, servo_port
from paramove.robots.dynamixel.emulated_servo import EmulatedServo
from paramove.robots.dynamixel.emulator import DynamixelEmulator

ROOT = Path(__file__).parents[2]
PATIENT_S = 0.3
"""Other programs may keep the emulator waiting."""


def pytest_addoption(parser):
    """Known where these tests are named on the command line; without them the arm is emulated."""
    parser.addoption("--servo-port", help="of a real arm; its joints move by a few degrees")
    parser.addoption("--robot", default="open_manipulator_x", help="which arm it is")


@pytest.fixture(scope="session")
def robot(request):
    name = request.config.getoption("--robot", default="open_manipulator_x")
    return RobotDescription.load(ROOT / "robot_description" / name)


@pytest.fixture
def port(request, robot):
    """A closed port of the arm's bus."""
    name = request.config.getoption("--servo-port", default=None)
    if name is not None:
        yield servo_port(robot, name)
        return
    places = robot.units.to_counts(robot.base_pose)
    servos = [
        EmulatedServo(joint.model, joint.number, robot.bus.baud_rate, float(place))
        for joint, place in zip(joint_servos(robot), places, strict=True)
    ]
    with DynamixelEmulator(servos) as emulator:
        port = servo_port(robot, emulator.port)
        port.latency_s = PATIENT_S
        yield port
