"""`paramove arm teach` on an emulated arm that is led by hand, with the keys of a person who presses them in time."""

from __future__ import annotations

import os

import numpy as np
import pytest
from typer.testing import CliRunner

from dynamixel_emulator.emulator import DynamixelEmulator
from paramove.cli.arm import teach as arm_teach
from paramove.cli.arm.terminal_person import TerminalPerson
from paramove.cli.main import build
from paramove.demonstrations import DemonstrationSet
from paramove.robots.description import RobotDescription
from paramove.robots.dynamixel.arm.gravity_compensated_arm import TorqueOffArm
from paramove.robots.dynamixel.calibration.arm_calibration import ArmCalibration, CalibratedBus, JointCalibration
from paramove.robots.dynamixel.calibration.path import calibration_path
from tests.robots.dynamixel.koch_arm import KOCH, PLAN, koch_servos
from tests.robots.dynamixel.small_arm import LINK, SERIAL

ROBOT = RobotDescription.load(KOCH)
SHIFT = 100
"""Counts by which this arm's zeros are beside the described ones."""


class Interrupt:
    """A person presses Ctrl-C."""


class Desk:
    """An emulated Koch v1.1; `teach` runs the command while steps are done, one before each look at the servos.

    A step is a posture, rad by joint, a key, an Interrupt, or what happens to the arm; then q is pressed.
    """

    def __init__(self, folder, emulator, monkeypatch):
        self.folder, self.emulator, self._patch = folder, emulator, monkeypatch

    def calibrate(self):
        joints = {}
        for servo in PLAN.servos:
            joints[servo.joint] = JointCalibration(
                id=servo.number, model=servo.model, firmware=46, sign=1, operating_mode=3, homing_offset=0,
                zero_counts=2048 + SHIFT, min_counts=200, max_counts=3900,
            )  # fmt: skip
        bus = CalibratedBus(serial=SERIAL, baud_rate=PLAN.baud_rate)
        made = ArmCalibration(created="2026-11-23", tool="paramove", robot=PLAN.robot, bus=bus, joints=joints)
        made.save(calibration_path(SERIAL, self.folder / "data"))

    def teach(self, steps, *words, name="set"):
        read, write = os.pipe()
        os.write(write, b"\n")
        steps, look = iter(steps), TorqueOffArm.measured

        def measured(torque_off):
            step = next(steps, None)
            if isinstance(step, Interrupt):
                raise KeyboardInterrupt
            if step is None:
                os.write(write, b"q")
            elif callable(step):
                with self.emulator.lock:
                    step()
            elif isinstance(step, str):
                os.write(write, step.encode())
            else:
                self._lead(step)
            return look(torque_off)

        with self._patch.context() as patch, os.fdopen(read) as source:
            patch.setattr(arm_teach, "TerminalPerson", lambda: TerminalPerson(source))
            patch.setattr(arm_teach, "PERIOD_S", 0.002)
            patch.setattr(TorqueOffArm, "measured", measured)
            places = ["--by-id", self.folder / "by-id", "--data", self.folder / "data", "--robot", KOCH]
            texts = ["arm", "teach", self.folder / name, "--action", "reaching", *places, *words]
            done = CliRunner().invoke(build("arm"), [str(text) for text in texts])
        os.close(write)
        return done

    def _lead(self, angles):
        with self.emulator.lock:
            for servo, joint in zip(self.emulator.bus.servos, ROBOT.joint_names, strict=True):
                servo.turned(2048.0 + SHIFT + 4096 / (2 * np.pi) * angles.get(joint, 0.0))


@pytest.fixture
def desk(tmp_path, monkeypatch):
    (tmp_path / "by-id").mkdir()
    with DynamixelEmulator(koch_servos(), tmp_path / "by-id" / LINK) as emulator:
        yield Desk(tmp_path, emulator, monkeypatch)


def segment(end):
    """The first joint is led from 0 to an angle."""
    pan = ROBOT.joint_names[0]
    return [{pan: 0.0}, " ", *({pan: angle} for angle in np.linspace(0.0, end, 8)), " ", {pan: end}]


def test_segments_are_recorded_dropped_and_counted(desk):
    desk.calibrate()
    with desk.emulator.lock:
        for servo in desk.emulator.bus.servos:
            servo.memory["Torque Enable"] = 1
    done = desk.teach([*segment(0.3), *segment(0.5), "d", {}, " ", {}])
    assert done.exit_code == 0, done.output
    assert "dropped taught_002.mcap" in done.stdout
    assert "the segment that had not ended is left out" in done.stdout
    assert "1 new" in done.stdout
    (movement,) = DemonstrationSet.load(desk.folder / "set")
    chain = ROBOT.chain
    angles = np.zeros(len(chain.joints))
    angles[0] = 0.3
    expected = chain.kinematics.forward(angles).position
    np.testing.assert_allclose(movement.theta, expected, rtol=0.0, atol=2e-3)
    assert [servo.memory["Torque Enable"] for servo in desk.emulator.bus.servos] == [0] * 6


def test_ctrl_c_keeps_the_segments_that_have_ended(desk):
    desk.calibrate()
    done = desk.teach([*segment(0.3), " ", {}, Interrupt()])
    assert done.exit_code == 130
    assert "interrupted" in done.stderr
    assert "1 new" in done.stdout
    assert len(DemonstrationSet.load(desk.folder / "set")) == 1


def test_a_set_is_added_to_only_if_asked_for(desk):
    desk.calibrate()
    assert desk.teach(segment(0.3)).exit_code == 0
    done = desk.teach(segment(0.4))
    assert done.exit_code == 78
    assert "holds a demonstration set already; choose another folder, or --append to it" in done.stderr
    assert desk.teach(segment(0.4), "--append").exit_code == 0
    assert len(DemonstrationSet.load(desk.folder / "set")) == 2


def test_without_a_segment_there_is_no_set(desk):
    desk.calibrate()
    done = desk.teach([" ", {}, " ", "d", {}])
    assert done.exit_code == 1
    assert "moved by less than" in done.stdout
    assert "no segment of this session is left to drop" in done.stdout
    assert "no segment was recorded" in done.stdout
    assert not (desk.folder / "set").exists()


def test_an_arm_that_has_to_be_calibrated_is(desk):
    done = desk.teach([])
    assert done.exit_code == 66
    assert "run `paramove arm calibrate`" in done.stderr


def test_a_servo_that_falls_silent_ends_it_and_loses_nothing(desk, monkeypatch):
    monkeypatch.setattr("paramove.robots.dynamixel.bus.position_watch.GIVES_UP", 3)
    desk.calibrate()

    def unplug():
        desk.emulator.bus.servos = desk.emulator.bus.servos[:-1]

    def rest():
        """The person waits."""

    done = desk.teach([*segment(0.3), unplug, *[rest] * 40])
    assert done.exit_code == 69
    assert "servo 6 no longer answers" in done.stderr
    assert "1 new" in done.stdout
    assert len(DemonstrationSet.load(desk.folder / "set")) == 1


def test_an_arm_that_cannot_float_is_told_before_anything_is_asked(desk):
    desk.calibrate()
    done = desk.teach([], "--float")
    assert done.exit_code == 78
    assert "has no current mode: lead this arm without --float" in done.stderr
    assert "Hold the arm" not in done.stdout


def test_a_set_that_cannot_be_written_is_refused_before_the_arm_is_led(desk):
    desk.calibrate()
    (desk.folder / "file").write_text("in the place of a folder")
    done = desk.teach([], name="file/set")
    assert done.exit_code == 77
    assert "Hold the arm" not in done.stdout
    assert f"{desk.folder / 'file'}: Not a directory" in done.stderr
