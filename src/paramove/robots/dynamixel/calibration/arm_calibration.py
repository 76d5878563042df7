"""Calibration of one arm: how its servos' counts become joint angles. A file that may be edited, one for each adapter.

Present Position of a Dynamixel servo is the angle of its encoder within one turn, plus Homing Offset (20), whenever
torque is switched on in Position Control Mode, and after every start in the other modes (ROBOTIS e-Manual, "Present
Position"). The seam of the encoder thus does not depend on the offset, which stays 0. A joint whose travel crosses it
works in Extended Position Control Mode, and `JointCalibration.turns` gives the turns by which its counts are off.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from ruamel.yaml import YAML

from paramove.documents import InputError, findings, read_document, replacing
from paramove.robots import JointUnits
from paramove.robots.dynamixel.bus.servo_models import POSITION_MODE, PULSES_PER_TURN, difference, model_named

SEAM_MARGIN = 64
"""Counts that a travel must stay away from the encoder's seam, 5.6 degrees: joints sag, and stops give way."""
LONGEST_TRAVEL = PULSES_PER_TURN - 2 * SEAM_MARGIN
COUNTS_PER_RAD = PULSES_PER_TURN / (2.0 * math.pi)
HEADER = """\
# How the servos of one arm are mounted, written by `paramove arm calibrate`. It may be edited:
# afterwards `paramove arm verify --sign` renews the line sha256, which tells damage from intent.
# angle = sign * (counts - zero_counts) * 2 pi / 4096, for counts from min_counts to max_counts.
"""


class CalibrationError(InputError):
    """A calibration that cannot be used or made; the message has the cause and the remedy."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class JointCalibration(_Part):
    """One joint's servo; what it is, how it is set, and what its counts mean.

    Counts begin in the turn in which the servo starts at `min_counts`; where the travel crosses the encoder's seam they
    go on beyond 4095.
    """

    id: int = Field(ge=0, le=252)
    model: str
    firmware: int = Field(ge=0, le=255)
    sign: Literal[1, -1]
    operating_mode: Literal[3, 4, 5]
    homing_offset: Literal[0]
    zero_counts: int = Field(ge=-4 * PULSES_PER_TURN, le=4 * PULSES_PER_TURN)
    min_counts: int = Field(ge=0, lt=PULSES_PER_TURN)
    max_counts: int = Field(ge=0, lt=2 * PULSES_PER_TURN)

    def counts(self, position: int) -> int:
        """A Present Position as counts of this file, whichever turn the servo began in."""
        middle = (self.min_counts + self.max_counts) // 2
        return middle + difference(position, middle)

    def turns(self, position: int) -> int:
        """Whole turns by which a servo that presents this position is beyond the counts of this file.

        They stay the same until it is switched off, rebooted, or its mode or torque changes; add that many times 4096
        to a goal.
        """
        return (position - self.counts(position)) // PULSES_PER_TURN

    def angle(self, position: int) -> float:
        """Of the joint at a Present Position, rad."""
        return self.sign * (self.counts(position) - self.zero_counts) / COUNTS_PER_RAD

    @property
    def travel(self) -> tuple[float, float]:
        """Minimum and maximum angle, rad."""
        ends = [self.sign * (end - self.zero_counts) / COUNTS_PER_RAD for end in (self.min_counts, self.max_counts)]
        return min(ends), max(ends)


class CalibratedBus(_Part):
    """The adapter by its USB serial number, or what identifies it without one, and the servos' baud rate, bit/s."""

    serial: str = Field(min_length=1)
    baud_rate: int = Field(gt=0)


class ArmCalibration(_Part):
    """All of the file. `created` is a time as ISO 8601 has it, `tool` what wrote it, `robot` the description's name."""

    version: Literal[1] = 1
    created: str
    tool: str
    robot: str
    bus: CalibratedBus
    joints: dict[str, JointCalibration]
    sha256: str = ""

    @classmethod
    def load(cls, path: Path, serial: str) -> Self:
        """Read and check a file.

        Raises:
            CalibrationError: It is missing, damaged, contradicts itself, is of another adapter than `serial`, or was
                edited and not signed.
        """
        calibration = cls.read(path)
        if calibration.bus.serial != serial:
            raise CalibrationError(
                f"{path} is of the arm behind adapter {calibration.bus.serial}, this one is {serial}: run `paramove "
                "arm calibrate` for it; if only the adapter was exchanged, change bus.serial and run `paramove arm "
                "verify --sign`"
            )
        if calibration.sha256 != calibration.content_sha256():
            raise CalibrationError(
                f"{path} is not as it was written (sha256 differs): if you edited it, run `paramove arm verify "
                "--sign`; if not, it is damaged: run `paramove arm calibrate`"
            )
        return calibration

    @classmethod
    def read(cls, path: Path) -> Self:
        """As `load`, but of whatever adapter and signature."""
        try:
            calibration = cls.model_validate(
                read_document(path, "calibration of an arm", CalibrationError, _REMEDY).data
            )
        except ValidationError as error:
            raise CalibrationError(f"{path}: {findings(error)}; {_REMEDY}") from error
        calibration.check(str(path))
        return calibration

    def check(self, where: str) -> None:
        """Raises CalibrationError, which begins with `where`, if the numbers contradict each other."""
        if not self.joints:
            raise CalibrationError(f"{where}: expected joints, found none; {_REMEDY}")
        numbers = [joint.id for joint in self.joints.values()]
        twice = sorted({number for number in numbers if numbers.count(number) > 1})
        if twice:
            raise CalibrationError(f"{where}: ID {twice[0]} is given twice; {_REMEDY}")
        for name, joint in self.joints.items():
            wrong = _contradiction(joint)
            if wrong:
                raise CalibrationError(f"{where}: joint {name}: {wrong}; {_REMEDY}")

    def content_sha256(self) -> str:
        """Of all numbers and names, but not of comments or layout."""
        content = self.model_dump(exclude={"sha256"})
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    def save(self, path: Path) -> None:
        """Check, sign and write it; an existing file is replaced at once. Raises CalibrationError and OSError."""
        self.check(str(path))
        content = self.model_dump() | {"sha256": self.content_sha256()}
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as unfinished, unfinished.open("w", encoding="utf-8") as file:
            file.write(HEADER)
            YAML().dump(content, file)

    def units(self, joint_names: Sequence[str], lower: ArrayLike, upper: ArrayLike) -> JointUnits:
        """Units of these joints, each within its described range and the demonstrated travel, whichever is less.

        Args:
            joint_names: J of them.
            lower, upper: Described range, shape [J], rad.

        Raises:
            CalibrationError: A joint is not in the file, or nothing is left of its range.
        """
        missing = [name for name in joint_names if name not in self.joints]
        if missing:
            raise CalibrationError(
                f"joint {missing[0]} is not calibrated, found {', '.join(self.joints)}: run `paramove arm calibrate`"
            )
        joints = [self.joints[name] for name in joint_names]
        travels = np.array([joint.travel for joint in joints], dtype=np.float64).reshape(-1, 2)
        minimum, maximum = np.maximum(travels[:, 0], lower), np.minimum(travels[:, 1], upper)
        for name, low, high in zip(joint_names, minimum, maximum, strict=True):
            if not low < high:
                raise CalibrationError(f"joint {name}: its calibrated travel lies outside of its range; {_REMEDY}")
        return JointUnits(
            names=tuple(joint_names),
            counts_per_rad=np.array([joint.sign * COUNTS_PER_RAD for joint in joints]),
            zero_counts=np.array([joint.zero_counts for joint in joints], dtype=np.float64),
            lower=minimum,
            upper=maximum,
        )


_REMEDY = "correct it and run `paramove arm verify --sign`, or run `paramove arm calibrate`"


def sign_again(path: Path) -> ArmCalibration:
    """Renew the signature of a file that was edited; comments and layout stay. Raises CalibrationError and OSError."""
    calibration = ArmCalibration.read(path)
    text, sha256 = path.read_text(encoding="utf-8"), calibration.content_sha256()
    unsigned = re.sub(r"^sha256:.*\n?", "", text, flags=re.M)
    with replacing(path) as unfinished:
        unfinished.write_text(f"{unsigned.rstrip()}\nsha256: {sha256}\n", encoding="utf-8")
    return calibration.model_copy(update={"sha256": sha256})


def _contradiction(joint: JointCalibration) -> str:
    """What is wrong, "" if nothing is."""
    modes = model_named(joint.model).modes
    travel = joint.max_counts - joint.min_counts
    if travel <= 0:
        return f"expected min_counts below max_counts, found {joint.min_counts} and {joint.max_counts}"
    if travel > LONGEST_TRAVEL:
        return f"expected at most {LONGEST_TRAVEL} counts from min_counts to max_counts, found {travel}"
    if joint.operating_mode == POSITION_MODE and joint.max_counts >= PULSES_PER_TURN:
        return f"max_counts {joint.max_counts} is beyond the one turn of operating mode {POSITION_MODE}"
    if joint.operating_mode not in modes:
        return f"{joint.model} has no operating mode {joint.operating_mode}"
    return ""
