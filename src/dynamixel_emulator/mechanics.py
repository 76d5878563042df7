"""What the servos of a chain move, one millisecond a step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from dynamixel_emulator.motor import Effort


class Mechanics(Protocol):
    """What a chain of servos moves. Shafts are in the order of the chain, pulses from the zeros of their encoders."""

    def shafts(self) -> list[tuple[float, float]]:
        """Where they are, and how fast they turn, pulses per second."""

    def step(self, efforts: Sequence[Effort], blocked: Sequence[bool]) -> None:
        """One millisecond with these efforts; something holds the blocked ones."""


@dataclass(frozen=True)
class DrivenJoint:
    """A joint of a model and the servo that drives it.

    Attributes:
        name: Of the joint, which is a hinge or a slide.
        counts_per_rad: Pulses of the servo for one radian, or metre, of the joint; negative where they turn in opposite
            directions. 4096 / (2 pi) without gears between them.
        zero_counts: Pulses at which the joint is at 0.
    """

    name: str
    counts_per_rad: float
    zero_counts: float = 2048.0
