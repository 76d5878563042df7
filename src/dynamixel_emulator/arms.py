"""Arms that are emulated by name, as their servos are set up to work with public drivers."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dynamixel_emulator.errors import EmulatorError, nearest
from dynamixel_emulator.mechanics import DrivenJoint
from dynamixel_emulator.models import BAUD_RATES, PULSES_PER_TURN, model_named
from dynamixel_emulator.servo import EmulatedServo

COUNTS_PER_RAD = PULSES_PER_TURN / (2.0 * math.pi)
BAUD_RATE = 1_000_000


@dataclass(frozen=True)
class Chain:
    """Servos on one bus.

    Attributes:
        servos: Model, ID and the name of the joint of each.
        baud_rate: bit/s.
    """

    servos: tuple[tuple[str, int, str], ...]
    baud_rate: int = BAUD_RATE

    def emulated(self) -> list[EmulatedServo]:
        """The servos, in the middle of their range. Raises EmulatorError for an unknown model."""
        if self.baud_rate not in BAUD_RATES:
            rates = ", ".join(map(str, BAUD_RATES))
            raise EmulatorError(f"servos have the baud rates {rates}, found {self.baud_rate}")
        return [EmulatedServo(model, number, self.baud_rate) for model, number, _ in self.servos]

    def joints(self) -> list[DrivenJoint]:
        """The joints that they drive without gears in a MuJoCo model, at 0 with 2048 pulses."""
        return [DrivenJoint(name, COUNTS_PER_RAD) for _, _, name in self.servos]

    @property
    def numbers(self) -> dict[str, int]:
        """IDs by the names of joints."""
        return {name: number for _, number, name in self.servos}


ARMS = {
    "koch": Chain(
        (
            ("xl430_w250", 1, "shoulder_pan"),
            ("xl430_w250", 2, "shoulder_lift"),
            ("xl330_m288", 3, "elbow_flex"),
            ("xl330_m288", 4, "wrist_flex"),
            ("xl330_m288", 5, "wrist_roll"),
            ("xl330_m288", 6, "gripper"),
        )
    ),
    "open_manipulator_x": Chain(tuple(("xm430_w350", 11 + i, name) for i, name in enumerate(
        ("joint1", "joint2", "joint3", "joint4", "gripper")
    ))),
}  # fmt: skip
"""Koch v1.1, the follower, as LeRobot numbers it; OpenMANIPULATOR-X as ROBOTIS ships it."""


def chain_of(words: list[str], baud_rate: int) -> Chain:
    """An arm of `ARMS`, or servos such as `xl430_w250:1 xl330_m288:2`. Raises EmulatorError for anything else."""
    if len(words) == 1 and words[0] in ARMS:
        return Chain(ARMS[words[0]].servos, baud_rate)
    servos = []
    for word in words:
        model, _, number = word.partition(":")
        if not number and model not in ARMS:
            raise EmulatorError(f"{word!r} is no arm ({nearest(word, ARMS)}) and no servo, which is MODEL:ID")
        if not (number.isdecimal() and int(number) <= 252):
            raise EmulatorError(f"{word!r}: a servo is MODEL:ID with an ID from 0 to 252, such as xl430_w250:1")
        servos.append((model_named(model).name, int(number), f"servo_{number}"))
    return Chain(tuple(servos), baud_rate)
