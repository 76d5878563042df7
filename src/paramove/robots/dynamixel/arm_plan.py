"""What an arm's description asks of its servos: which one drives which joint, and how it is calibrated."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PlannedServo:
    """The servo of one joint.

    Attributes:
        joint: Name. number: ID. model: Name of its kind, as in `servo_models.MODELS`.
        lower, upper: Range of the joint, rad.
        posture: Its angle in the posture in which the arm is held for calibration, rad.
        sign: 1 where the servo counts up with the angle in the arm as it is described, else -1.
        direction: Where the joint moves with a growing angle, in words.
    """

    joint: str
    number: int
    model: str
    lower: float
    upper: float
    posture: float = 0.0
    sign: int = 1
    direction: str = ""


@dataclass(frozen=True)
class ArmPlan:
    """All servos of an arm, in the order of its joints.

    Attributes:
        robot: Name of the description.
        baud_rate: Of the bus, bit/s.
    """

    robot: str
    baud_rate: int
    servos: tuple[PlannedServo, ...]
