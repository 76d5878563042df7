"""Arms that can be emulated by name, with servos set up for public drivers."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dynamixel_emulator.errors import EmulatorError, suggestion
from dynamixel_emulator.mechanics import DrivenJoint
from dynamixel_emulator.models import BAUD_RATES, PULSES_PER_TURN, model_named
from dynamixel_emulator.servo import EmulatedServo

COUNTS_PER_RAD = PULSES_PER_TURN / (2.0 * math.pi)
BAUD_RATE = 1_000_000


@dataclass(frozen=True)
class Chain:
    """Servos on one bus.

    Attributes:
        servos: Model, ID and joint name of each servo.
        baud_rate: bit/s.
    """

    servos: tuple[tuple[str, int, str], ...]
    baud_rate: int = BAUD_RATE

    def emulated(self) -> list[EmulatedServo]:
        """Servos at mid-range. Raises EmulatorError for an unknown model or baud rate."""
        if self.baud_rate not in BAUD_RATES:
            rates = ", ".join(map(str, BAUD_RATES))
            raise EmulatorError(f"servos have the baud rates {rates}, found {self.baud_rate}")
        return [EmulatedServo(model, number, self.baud_rate) for model, number, _ in self.servos]

    def joints(self) -> list[DrivenJoint]:
        """Joints of a MuJoCo model that the servos drive without gears; 2048 pulses at joint position 0."""
        return [DrivenJoint(name, COUNTS_PER_RAD) for _, _, name in self.servos]

    @property
    def numbers(self) -> dict[str, int]:
        """IDs by joint name."""
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
"""Koch v1.1 follower, numbered as in LeRobot; OpenMANIPULATOR-X as shipped by ROBOTIS."""


def chain_of(words: list[str], baud_rate: int) -> Chain:
    """An arm of `ARMS`, or servos such as `xl430_w250:1 xl330_m288:2`. Raises EmulatorError for anything else."""
    if len(words) == 1 and words[0] in ARMS:
        return Chain(ARMS[words[0]].servos, baud_rate)
    servos = []
    for word in words:
        model, _, number = word.partition(":")
        if not number and model not in ARMS:
            raise EmulatorError(f"{word!r} is neither an arm ({suggestion(word, ARMS)}) nor a servo, MODEL:ID")
        if not (number.isdecimal() and int(number) <= 252):
            raise EmulatorError(f"{word!r}: a servo is MODEL:ID with an ID from 0 to 252, such as xl430_w250:1")
        servos.append((model_named(model).name, int(number), f"servo_{number}"))
    return Chain(tuple(servos), baud_rate)
