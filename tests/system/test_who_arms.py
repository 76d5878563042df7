"""Who may arm a running application: its own operator node for the servos that it emulates, else a person alone."""

import pytest

from dynamixel_emulator.emulator import DynamixelEmulator
from paramove.robots.description import RobotDescription
from sim.emulated_arm import emulated_servos
from tests.docs.terminal import ENVIRONMENT, at_terminal, heard, launched
from tests.robots.dynamixel.small_arm import LINK

LAUNCH = "paramove launch dynamixel_arm --headless --with emulated"
ENABLE = "paramove arm enable --yes"
ROBOT = RobotDescription.load("robot_description/open_manipulator_x")
REJECTED = "operator node is a program and may not arm"

pytestmark = pytest.mark.slow


def test_servos_that_somebody_else_emulates_are_armed_by_no_program(tmp_path):
    environment = ENVIRONMENT | {"PARAMOVE_DOMAIN": "who-else"}
    link = tmp_path / LINK
    with DynamixelEmulator(emulated_servos(ROBOT), link) as emulator:
        command = f"{LAUNCH} --set arm_driver.port={link} --runs {tmp_path / 'runs'}"
        with launched(command, environment) as running:
            heard(
                running,
                "arm_driver",
                "degraded",
                f"{link} counts as a real arm",
                "was not started by the launcher of this run",
            )
            heard(running, "waiting until a person arms the arm", REJECTED)
            with emulator.lock:
                assert [servo.memory["Torque Enable"] for servo in emulator.bus.servos] == [0] * ROBOT.n_joints


def test_the_release_of_an_emergency_stop_arms_nothing(tmp_path):
    environment = ENVIRONMENT | {"PARAMOVE_DOMAIN": "who-after"}
    pressed = tmp_path / "pressed"
    pressed.touch()
    with launched(f"{LAUNCH} --set arm_driver.stop_file={pressed} --runs {tmp_path / 'runs'}", environment) as running:
        heard(running, "operator", "ready")
        heard(running, "waiting until a person arms the arm", "the emergency stop is pressed")
        pressed.unlink()
        heard(running, "arm_driver", "ready", "safety gate")  # an emergency stop, until the next report
        code, output = at_terminal("sleep 2 && paramove topic echo arm/safety --count 1", "", environment)
        assert code == 0, output
        assert "STATE_DISARMED" in output
        code, output = at_terminal(ENABLE, "", environment)
        assert code == 0, output
        heard(running, "task 1 of 2")
