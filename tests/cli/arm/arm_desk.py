"""A desk with an emulated arm on it, at which a person types commands of `paramove arm`."""

from __future__ import annotations

import contextlib

import pytest
from typer.testing import CliRunner

from dynamixel_emulator.emulator import DynamixelEmulator
from paramove.cli.arm.terminal_person import TerminalPerson
from paramove.cli.main import build
from paramove.robots.dynamixel.bus.servo_setup import only_servo
from paramove.robots.dynamixel.calibration.path import calibration_path
from tests.robots.dynamixel.koch_arm import KOCH, PLAN, hands, koch_servos, rest
from tests.robots.dynamixel.small_arm import LINK, SERIAL

RATE = PLAN.baud_rate


class Script:
    """What a person types and does, in the place of the standard input: an action comes before each line."""

    def __init__(self, steps):
        self._steps = iter(steps)

    def isatty(self):
        return False

    def fileno(self):
        raise OSError("not a file of the system")

    def readline(self):
        act, line = next(self._steps, (rest, ""))
        act()
        return line


class Bench:
    """A desk with the emulated arm on it.

    Attributes:
        by_id, data: Folders of links and of calibrations.
    """

    def __init__(self, folder):
        self.by_id, self.data = folder / "by-id", folder / "data"
        self.by_id.mkdir()
        self._opened = contextlib.ExitStack()
        self.emulator = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._opened.close()

    def plug_in(self, *servos, link=LINK):
        self.emulator = self._opened.enter_context(DynamixelEmulator(servos, self.by_id / link))
        return servos

    def plug_in_koch(self):
        return self.plug_in(*koch_servos())

    def connect(self, *servos):
        with self.emulator.lock:
            self.emulator.bus.servos = servos

    def arm(self, *words, steps=()):
        places = ["--by-id", self.by_id, "--data", self.data]
        texts = [str(word) for word in ("arm", *words, *places)]
        app = build("arm")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("paramove.robots.dynamixel.only_servo", few_rates)
            patch.setattr("paramove.robots.dynamixel.bus.servo_chain.TURN_S", 0.0)  # emulated servos answer at once
            for module in ("setup", "calibrate"):
                patch.setattr(f"paramove.cli.arm.{module}.TerminalPerson", lambda: TerminalPerson(Script(steps)))
            return CliRunner().invoke(app, texts)

    def calibrated(self):
        """A calibration of the arm as it is described, whose settings the servos have."""
        done = self.arm("calibrate", "--robot", KOCH, steps=hands(self.emulator))
        assert done.exit_code == 0, done.output
        return calibration_path(SERIAL, self.data)


def few_rates(chain, baud_rates=(RATE, 2_000_000)):
    """To be quick; that all are asked, the tests of scans show."""
    return only_servo(chain, baud_rates)
