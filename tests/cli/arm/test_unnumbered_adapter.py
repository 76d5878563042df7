"""Two arms of one kit, one after the other behind an adapter that has no serial number."""

import pytest

from paramove.robots.dynamixel.calibration.arm_calibration import ArmCalibration
from tests.cli.arm.arm_desk import Bench
from tests.robots.dynamixel.koch_arm import KOCH, hands, koch_servos

LINK = "usb-1a86_USB_Serial-if00-port0"


@pytest.fixture
def desk(tmp_path):
    with Bench(tmp_path) as desk:
        desk.plug_in(*koch_servos(), link=LINK)
        yield desk


def calibrate(desk, zero):
    return desk.arm("calibrate", "--robot", KOCH, steps=hands(desk.emulator, zero))


def limits(servos):
    return [servo.memory[name] for servo in servos for name in ("Min Position Limit", "Max Position Limit")]


def test_a_second_arm_gets_neither_the_settings_of_the_first_nor_its_file(desk):
    assert calibrate(desk, 2048.0).exit_code == 0
    [path] = (desk.data / "calibration").iterdir()
    first = path.read_text()

    second = koch_servos()
    desk.connect(*second)
    before = limits(second)
    for option in ("--write", "--adopt"):
        done = desk.arm("verify", option)
        assert done.exit_code == 78
        assert "another arm" in done.stderr
    assert limits(second) == before
    assert path.read_text() == first
    done = desk.arm("verify")
    assert done.exit_code == 3
    assert "another arm" in done.stderr

    done = calibrate(desk, 2348.0)
    assert done.exit_code == 0, done.output
    kept = path.with_suffix(".1.yaml")
    assert f"kept as {kept}" in done.output
    assert kept.read_text() == first
    assert ArmCalibration.read(path).joints["elbow_flex"].zero_counts == 2348


def test_one_servo_that_was_reset_is_set_again(desk):
    """The others show that it is the arm of the file."""
    assert calibrate(desk, 2048.0).exit_code == 0
    desk.connect(koch_servos()[0], *desk.emulator.bus.servos[1:])
    assert desk.arm("verify", "--write").exit_code == 0
    assert desk.arm("verify").exit_code == 0
