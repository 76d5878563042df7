"""Interface to the mechanics that a chain of servos moves, in steps of one millisecond."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from dynamixel_emulator.motor import Effort


class Mechanics(Protocol):
    """Mechanics driven by a chain of servos. Shafts are in the order of the chain, pulses from the encoder zero."""

    def shafts(self) -> list[tuple[float, float]]:
        """Position, pulses, and velocity, pulses per second, of each shaft."""

    def step(self, efforts: Sequence[Effort], blocked: Sequence[bool]) -> None:
        """Advances one millisecond with these efforts; blocked shafts do not move."""


@dataclass(frozen=True)
class DrivenJoint:
    """A joint of a model and the servo that drives it.

    Attributes:
        name: Name of the joint, a hinge or a slide.
        counts_per_rad: Pulses of the servo per radian, or metre, of the joint; negative if they turn in opposite
            directions. 4096 / (2 pi) without a gear between them.
        zero_counts: Pulses at joint position 0.
    """

    name: str
    counts_per_rad: float
    zero_counts: float = 2048.0
