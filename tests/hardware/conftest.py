"""The same tests for a real arm (`make test-hardware PORT=/dev/serial/by-id/…`) and for an emulated one."""

from pathlib import Path

import pytest

from dynamixel_emulator.emulator import DynamixelEmulator
from paramove.robots.description import RobotDescription
from paramove.robots.dynamixel.arm.setup import servo_port
from sim.emulated_arm import emulated_servos

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
    with DynamixelEmulator(emulated_servos(robot)) as emulator:
        port = servo_port(robot, emulator.port)
        port.latency_s = PATIENT_S
        yield port
