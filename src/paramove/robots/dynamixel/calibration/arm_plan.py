"""The servos of an arm by its description: which one drives which joint, and how it is calibrated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from paramove.documents import InputError
from paramove.robots import Chain, RobotDescription

YAW = (
    "the hand swings to the left, seen from behind the arm",
    "the hand swings to the right, seen from behind the arm",
)
PITCH = ("what it carries goes down in front", "what it carries goes up in front")
ROLL = (
    "the hand turns clockwise, seen from behind the arm",
    "the hand turns counterclockwise, seen from behind the arm",
)
ANGLE = ("its angle grows, as its description has it", "its angle falls, as its description has it")
"""How a joint moves with a growing and with a falling angle."""
ROOM = math.radians(15.0)
"""That a joint needs to demonstrate its direction."""


@dataclass(frozen=True)
class PlannedServo:
    """The servo of one joint.

    Attributes:
        joint: Name. number: ID. model: Name of its kind, as in `servo_models.MODELS`.
        lower, upper: Range of the joint, rad.
        sign: 1 where the servo counts up with the angle in the arm as it is described, else -1.
        grows: Whether its direction is demonstrated with a growing angle; not where the posture has no room for it.
        direction: Where the joint moves then, in words.
        grips: Whether it holds with a limited current, in Current-based Position Control Mode.
    """

    joint: str
    number: int
    model: str
    lower: float
    upper: float
    sign: int = 1
    grows: bool = True
    direction: str = ANGLE[0]
    grips: bool = False


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


def load_plan(folder: Path) -> ArmPlan:
    """Of the description in a folder; the posture for calibration is its zero pose.

    Raises:
        InputError: It is missing or wrong, or is not one of servos whose tables are known.
    """
    robot = RobotDescription.load(folder)
    if robot.bus is None:
        raise InputError(
            f"{folder}: {robot.name} has no servos on a bus, expected `bus` and a `servo_id` of every joint"
        )
    directions = {} if robot.chain is None else _directions(robot.chain)
    servos = []
    for index, joint in enumerate(robot.joint_names):
        grows = bool(robot.upper[index] >= ROOM)
        servo = PlannedServo(
            joint=joint,
            number=robot.servo_ids[index],
            model=robot.motors[index],
            lower=float(robot.lower[index]),
            upper=float(robot.upper[index]),
            sign=1 if robot.units.counts_per_rad[index] > 0 else -1,
            grows=grows,
            direction=directions.get(joint, ANGLE)[0 if grows else 1],
            grips=robot.chain is not None and robot.chain.grip_current_ma is not None and joint == robot.chain.gripper,
        )
        servos.append(servo)
    return ArmPlan(robot.name, robot.bus.baud_rate, tuple(servos))


def _directions(chain: Chain) -> dict[str, tuple[str, str]]:
    """Of a yaw, three pitches, perhaps a roll, and the gripper."""
    directions = dict(zip(chain.joints, (YAW, PITCH, PITCH, PITCH, ROLL), strict=False))
    opens, closes = "the gripper opens", "the gripper closes"
    return directions | {
        chain.gripper: (opens, closes) if chain.gripper_open > chain.gripper_closed else (closes, opens)
    }
