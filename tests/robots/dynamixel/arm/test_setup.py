"""A servo arm as a launch file names it: with which zeros it is driven, and what is refused."""

import contextlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.wire_faults import WireFaults
from paramove.documents.input_error import InputError
from paramove.msgs.safety_state_pb2 import SafetyState
from paramove.robots.description import DescriptionError, RobotDescription
from paramove.robots.dynamixel.arm.servo_arm import Timeouts
from paramove.robots.dynamixel.arm.setup import ServoArmSetup, calibrated, joint_servos, servo_port, uncalibrated
from paramove.robots.dynamixel.calibration.arm_calibration import CalibrationError, JointCalibration
from paramove.robots.this_launch import ThisLaunch
from sim.emulated_arm import emulated_servos
from tests.robots.dynamixel.person import Person
from tests.robots.dynamixel.small_arm import calibration
from tests.robots.one_process import HERE

FOLDER = Path("robot_description")
KOCH, OPEN = (RobotDescription.load(FOLDER / name) for name in ("koch_v1_1", "open_manipulator_x"))
TIMEOUTS = Timeouts(silent_s=2.0, watchdog_s=2.54, read_s=0.4)


def one_of(place: int) -> JointCalibration:
    """A joint of which only a half of the travel was shown, and whose zero is somewhere else."""
    return JointCalibration(
        id=place + 1, model=KOCH.motors[place], firmware=46, sign=1, operating_mode=3, homing_offset=0,
        zero_counts=2000 + place, min_counts=1500, max_counts=2010 + place,
    )  # fmt: skip


LIMITS = {"timeouts": TIMEOUTS, "nominal": True}


def setup(port: Path, **parameters) -> ServoArmSetup:
    return ServoArmSetup(robot=FOLDER / "koch_v1_1", port=port, **parameters)


ORPHAN = """
import os, sys
parent = os.getpid()
if os.fork():
    os._exit(0)
while os.getppid() == parent:
    os.sched_yield()
ours, theirs = os.openpty()
print(os.getpid(), os.ttyname(theirs), flush=True)
sys.stdin.read()
"""


@contextlib.contextmanager
def stranger_serves():
    """Process id of one that this one did not start, as its parent has ended, and the terminal that it serves."""
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", ORPHAN], stdin=pipe, stdout=pipe, text=True) as process:
        pid, terminal = process.stdout.readline().split()
        yield int(pid), terminal
        process.stdin.close()


def test_grippers_hold_with_a_limited_current_and_other_joints_by_position():
    assert [servo.mode for servo in joint_servos(OPEN)] == [3, 3, 3, 3, 5]
    assert joint_servos(OPEN)[-1].grip_current == round(200 / 2.69)
    assert joint_servos(KOCH)[-1].grip_current == 400


def test_no_servo_turns_faster_than_its_joint_may_whatever_it_is_told():
    for robot in (OPEN, KOCH):
        rev_per_minute = np.array([0.229 * servo.profile_velocity for servo in joint_servos(robot)])
        allowed = robot.velocity * 60.0 / (2.0 * np.pi)
        assert (rev_per_minute >= allowed).all()  # a movement that is allowed is not held up
        assert (rev_per_minute < allowed + 0.23).all()


def test_an_arm_that_everybody_assembles_differently_is_not_armed_uncalibrated(tmp_path):
    assert uncalibrated(OPEN) == ()
    link = tmp_path / "usb-FTDI_0001-if00-port0"
    with DynamixelEmulator(emulated_servos(KOCH), link), setup(link, timeouts=TIMEOUTS).driven_arm(tmp_path) as arm:
        person = Person(arm)
        person.waits_for("DISARMED")
        person.arms()
        person.hears_until(lambda: person.safety.faults)
        assert person.codes() == [("not_calibrated", "")]
        assert "`paramove arm calibrate`" in person.safety.faults[0].detail


def test_in_simulation_its_zeros_are_those_of_the_description(tmp_path):
    link = tmp_path / "usb-FTDI_0001-if00-port0"
    with DynamixelEmulator(emulated_servos(KOCH), link), setup(link, emulated=LIMITS).driven_arm(tmp_path, HERE) as arm:
        arm_sees = Person(arm)
        arm_sees.arms_and_waits()
        np.testing.assert_allclose(arm_sees.angles[-1], KOCH.base_pose, rtol=0, atol=np.deg2rad(0.1))


def test_limits_of_emulated_servos_are_for_no_others(tmp_path):
    link = tmp_path / "usb-FTDI_0001-if00-port0"
    stranger = ThisLaunch(2**22)
    with (
        DynamixelEmulator(emulated_servos(KOCH), link),
        setup(link, emulated=LIMITS).driven_arm(tmp_path, stranger) as arm,
    ):
        person = Person(arm)
        person.hears_until(lambda: "counts as a real arm" in arm.trouble)
        person.waits_for("DISARMED")
        person.arms()
        person.hears_until(lambda: person.safety.faults)
        assert {"not_calibrated", "robot_silent"} & {code for code, _ in person.codes()}


def test_a_port_that_leads_elsewhere_when_it_is_opened_again_is_not_driven(tmp_path):
    link = tmp_path / "usb-FTDI_0001-if00-port0"
    with contextlib.ExitStack() as opened:
        emulator = opened.enter_context(DynamixelEmulator(emulated_servos(KOCH), link))
        arm = opened.enter_context(setup(link, emulated=LIMITS).driven_arm(tmp_path, HERE))
        person = Person(arm)
        person.arms_and_waits()
        emulator.unplug()
        person.hears_until(lambda: "plugged in" in arm.trouble or "no serial port" in arm.trouble)
        ours, theirs = opened.enter_context(stranger_serves())
        link.symlink_to(theirs)
        person.hears_until(lambda: "does not lead to the servos of this launch" in arm.trouble)
        assert f"pid {ours} " in arm.trouble
        link.unlink()
        emulator.plug_in()
        person.hears_until(lambda: arm.trouble == "")
        person.arms()
        person.waits_for("ARMED")


def test_an_arm_whose_servos_are_always_late_is_heard_if_it_may_be_read_slowly(tmp_path):
    """Each answer comes after the next period's question."""
    link = tmp_path / "usb-FTDI_0001-if00-port0"
    servos = emulated_servos(KOCH)
    with DynamixelEmulator(servos, link) as late, setup(link, emulated=LIMITS).driven_arm(tmp_path, HERE) as arm:
        person = Person(arm)
        person.arms_and_waits()
        late.faults = WireFaults(delay_s=0.02)
        heard = len(person.angles)
        person.hears_until(lambda: len(person.angles) > heard + 100)
        assert person.safety.state == SafetyState.STATE_ARMED
        assert arm.trouble == ""


def test_another_arms_calibration_is_refused(tmp_path):
    path = tmp_path / "arm.yaml"
    calibration().save(path)
    with pytest.raises(CalibrationError, match="of the arm behind adapter"):
        setup(tmp_path / "usb-FTDI_9999-if00-port0", calibration=path).driven_arm(tmp_path)


def test_a_calibrated_arm_has_its_own_zeros_and_keeps_to_the_travel_that_was_shown():
    shown = calibration().model_copy(
        update={"joints": {name: one_of(place) for place, name in enumerate(KOCH.joint_names)}}
    )
    arm = calibrated(KOCH, shown)
    assert (arm.soft_lower >= KOCH.soft_lower).all()
    assert (arm.soft_upper <= arm.upper).all()
    for place, name in enumerate(KOCH.joint_names):
        assert arm.units.zero_counts[place] == shown.joints[name].zero_counts
        low, high = shown.joints[name].travel
        assert low - 1e-9 <= arm.lower[place] < arm.upper[place] <= high + 1e-9


def test_the_line_of_a_stop_button_that_is_not_there_is_pressed_from_the_start(tmp_path):
    link, line = tmp_path / "usb-FTDI_0001-if00-port0", tmp_path / "value"
    parameters = {"emulated": LIMITS, "stop_line": line, "stop_line_pressed": 0}
    with DynamixelEmulator(emulated_servos(KOCH), link), setup(link, **parameters).driven_arm(tmp_path, HERE) as arm:
        person = Person(arm)
        person.waits_for("ESTOP")
        assert arm.trouble == f"the emergency stop counts as pressed: {line} cannot be read (No such file or directory)"
        line.write_text("1\n")
        person.arms_and_waits()
    with pytest.raises(ValidationError, match="stop_line_pressed"):
        setup(link, stop_line_pressed=2)


def test_where_an_arm_may_go_limp_must_be_told_for_joints_that_it_has(tmp_path):
    with pytest.raises(DescriptionError, match="needs `rest_deg`: where can the arm go limp"):
        setup(tmp_path / "port", on_exit="rest_then_off").driven_arm(tmp_path)
    with pytest.raises(DescriptionError, match=r"'shoulder_pam'.*'shoulder_pan'"):
        setup(tmp_path / "port", on_exit="rest_then_off", rest_deg={"shoulder_pam": 3.0}).driven_arm(tmp_path)
    with pytest.raises(ValidationError, match="finite"):
        setup(tmp_path / "port", on_exit="rest_then_off", rest_deg={"shoulder_pan": float("nan")})


def test_with_on_exit_it_goes_limp_there(tmp_path):
    link, rest = tmp_path / "usb-FTDI_0001-if00-port0", {"wrist_flex": 30.0}
    with DynamixelEmulator(emulated_servos(KOCH), link) as emulator:
        with setup(link, emulated=LIMITS, on_exit="rest_then_off", rest_deg=rest).driven_arm(tmp_path, HERE) as arm:
            person = Person(arm)
            person.arms_and_waits()
        servo = emulator.bus.servos[KOCH.index("wrist_flex")]
        pose = KOCH.base_pose.copy()
        pose[KOCH.index("wrist_flex")] = np.deg2rad(30.0)
        assert servo.memory["Goal Position"] == KOCH.units.to_counts(pose)[KOCH.index("wrist_flex")]
        assert [one.memory["Torque Enable"] for one in emulator.bus.servos] == [0] * 6


def test_a_robot_without_a_servo_bus_is_refused():
    with pytest.raises(DescriptionError, match="hoap3 has no servo bus"):
        servo_port(RobotDescription.load(FOLDER / "hoap3"), "/dev/null")
    with pytest.raises(DescriptionError, match="hoap3 has no servo bus"):
        ServoArmSetup(robot=FOLDER / "hoap3", port=Path("/dev/null")).driven_arm(Path("/"))


@pytest.mark.parametrize("wrong", [{"silent_s": 0.0}, {"watchdog_s": 3.0}, {"watchdog_s": 0.001}])
def test_impossible_timeouts_is_refused(wrong):
    with pytest.raises((InputError, ValidationError), match=r"watchdog_s 0\.02 to 2\.54 s"):
        ServoArmSetup(robot=FOLDER / "koch_v1_1", port=Path("x"), timeouts=wrong)
