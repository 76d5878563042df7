"""From a joint moved by hand to its calibration: positions are unwrapped, and the encoder's seam is located.

Pure arithmetic over positions as a servo presents them, with Homing Offset (20) at 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from paramove.robots.dynamixel.bus.position_watch import difference
from paramove.robots.dynamixel.bus.scan import DetectedServo
from paramove.robots.dynamixel.bus.servo_models import PULSES_PER_TURN
from paramove.robots.dynamixel.calibration.arm_calibration import (
    COUNTS_PER_RAD,
    CURRENT_BASED,
    EXTENDED,
    LONGEST_TRAVEL,
    POSITION,
    SEAM_MARGIN,
    CalibrationError,
    JointCalibration,
)
from paramove.robots.dynamixel.calibration.arm_plan import PlannedServo

LARGEST_STEP = PULSES_PER_TURN // 4
"""Between two readings; with half a turn the direction would be ambiguous."""
SMALLEST_TRAVEL = 57
"""Counts, 5 degrees: less is a joint that was not moved."""
SMALLEST_MOVE = 34
"""Counts, 3 degrees, that show a direction."""
TRAVEL_TOLERANCE = float(np.deg2rad(3.0))
"""By which the demonstrated travel may fall short of the described range without a remark."""
MIN_FRACTION = 0.5
"""Of the described range that must lie in the travel: less, and posture or direction were not as described."""


@dataclass(frozen=True)
class Travel:
    """Counts between which a joint was moved; `lowest` is within the encoder's turn, `highest` may be beyond it."""

    lowest: int
    highest: int

    @property
    def has_seam(self) -> bool:
        """Whether the encoder's seam lies in it or too near."""
        return self.lowest < SEAM_MARGIN or self.highest >= PULSES_PER_TURN - SEAM_MARGIN


class JointSweep:
    """Follows a joint that a person moves through its travel.

    Attributes:
        joint: Name.
        lowest, present, highest: Unwrapped counts so far.
    """

    def __init__(self, joint: str, position: int) -> None:
        self.joint = joint
        self.lowest = self.present = self.highest = position
        self._widest_step = 0

    def add(self, position: int) -> None:
        """A later position, in whatever turn it is presented."""
        step = difference(position, self.present)
        self._widest_step = max(self._widest_step, abs(step))
        self.present += step
        self.lowest, self.highest = min(self.lowest, self.present), max(self.highest, self.present)

    def travel(self) -> Travel:
        """The demonstrated travel. Raises CalibrationError if it cannot be used."""
        length = self.highest - self.lowest
        if self._widest_step > LARGEST_STEP:
            raise CalibrationError(
                f"joint {self.joint} moved by {self._widest_step} counts between two readings, at most {LARGEST_STEP} "
                "can be followed: move it more slowly"
            )
        if length < SMALLEST_TRAVEL:
            raise CalibrationError(
                f"joint {self.joint} was moved by {length} counts, at least {SMALLEST_TRAVEL} are expected: move it "
                "from one end to the other"
            )
        if length > LONGEST_TRAVEL:
            raise CalibrationError(
                f"joint {self.joint} was moved by {length} counts, but after power was off its encoder distinguishes "
                f"only {LONGEST_TRAVEL} of the {PULSES_PER_TURN} of a turn: turn it by at most "
                f"{LONGEST_TRAVEL * 360 // PULSES_PER_TURN} deg"
            )
        lowest = self.lowest % PULSES_PER_TURN
        return Travel(lowest, lowest + length)


def calibrated_joint(
    servo: DetectedServo, planned: PlannedServo, travel: Travel, held: int, step: int
) -> JointCalibration:
    """A joint's calibration from the person's movements.

    Args:
        servo: As it was detected.
        planned: As the arm's description has it.
        travel: From a sweep.
        held: Position in the posture for calibration.
        step: Counts by which the joint was then moved in the direction of a growing angle.

    Raises:
        CalibrationError: It was not moved, or range, posture and direction do not fit the description.
    """
    if abs(step) < SMALLEST_MOVE:
        raise CalibrationError(
            f"joint {planned.joint} was moved by {abs(step)} counts, at least {SMALLEST_MOVE} show a direction: move "
            "it further"
        )
    mode: Literal[3, 4, 5] = CURRENT_BASED if planned.grips else EXTENDED if travel.has_seam else POSITION
    joint = JointCalibration(
        id=servo.number,
        model=servo.model,
        firmware=servo.firmware,
        sign=1 if step > 0 else -1,
        operating_mode=mode,
        homing_offset=0,
        zero_counts=0,
        min_counts=travel.lowest,
        max_counts=travel.highest,
    )
    counts = joint.counts(held)
    if not travel.lowest - SEAM_MARGIN <= counts <= travel.highest + SEAM_MARGIN:
        raise CalibrationError(
            f"joint {planned.joint}: the posture is at {counts} counts, outside of the demonstrated travel of "
            f"{travel.lowest} to {travel.highest}: calibrate again, and move the joint to both of its ends"
        )
    zero = round(counts - joint.sign * planned.posture * COUNTS_PER_RAD)
    joint = joint.model_copy(update={"zero_counts": zero})
    low, high = joint.travel
    if min(high, planned.upper) - max(low, planned.lower) < MIN_FRACTION * (planned.upper - planned.lower):
        raise CalibrationError(
            f"joint {planned.joint} would reach from {_degrees(low, high)}, its description has "
            f"{_degrees(planned.lower, planned.upper)}: the posture was not the described one, the joint was moved in "
            "the opposite direction, or not to both of its ends; calibrate again"
        )
    return joint


def remarks(joint: JointCalibration, planned: PlannedServo) -> list[str]:
    """Remarks on a joint's calibration for a person, if any."""
    messages = []
    low, high = joint.travel
    if low > planned.lower + TRAVEL_TOLERANCE or high < planned.upper - TRAVEL_TOLERANCE:
        messages.append(
            f"joint {planned.joint} was moved from {_degrees(low, high)} of {_degrees(planned.lower, planned.upper)}: "
            "it will stay within that"
        )
    if joint.sign != planned.sign:
        messages.append(
            f"joint {planned.joint} counts in the opposite direction to the description: its servo is mounted mirrored"
        )
    if joint.operating_mode == EXTENDED:
        messages.append(
            f"joint {planned.joint} crosses the seam of its encoder: it works in the extended mode, in which the servo "
            "itself has no limits"
        )
    return messages


def _degrees(low: float, high: float) -> str:
    return f"{np.rad2deg(low):.0f} to {np.rad2deg(high):.0f} deg"
