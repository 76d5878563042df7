"""What sequences have in common with those of the training: unit, frame rate, and whether they are complete."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from paramove.documents import Floats, Ints
from paramove.phmm.performance import part_means

OTHER_UNIT = 50.0
"""Values of that many times the largest of the training have another unit: cm or mm for m."""
OTHER_RATE = 1.6
"""Durations in frames and speeds per frame that differ by this factor are reported; another frame rate is often half or
double."""
PARTS, PART_FRAMES = 10, 10


class UnlikelyMovementWarning(UserWarning):
    """A sequence is hardly a complete movement at the frame rate of the training: its estimate means little."""


class ExtrapolationWarning(UserWarning):
    """Theta lies farther outside the training than the training is wide: what is synthesised means little."""


def far_outside(theta: Floats, bounds: Floats) -> Ints:
    """Components of theta (P,) that lie farther outside the bounds (2, P) than these are apart. Their indices."""
    low, high = bounds
    width = high - low
    slack = 1e-9 * np.maximum(np.abs(low), np.abs(high))
    far = (theta < low - width - slack) | (theta > high + width + slack)
    return np.flatnonzero(far).astype(np.int64)


@dataclass(frozen=True)
class TrainingRange:
    """Of the movements of the training, as they were recorded.

    Attributes:
        largest: absolute value. shortest, longest: number of frames. fastest: `peak_step` of all.
    """

    largest: float
    shortest: float
    longest: float
    fastest: float

    @classmethod
    def of(cls, sequences: Sequence[Floats]) -> Self:
        """Of movements (T_k, D)."""
        lengths = [float(len(sequence)) for sequence in sequences]
        largest = max(float(np.abs(sequence).max()) for sequence in sequences)
        return cls(largest, min(lengths), max(lengths), max(map(peak_step, sequences)))

    def check_unit(self, sequence: Floats) -> None:
        """Raises ValueError for values that are too large for the unit of the training."""
        found = float(np.abs(sequence).max())
        if found > self.largest * OTHER_UNIT:
            raise ValueError(
                f"the largest value is {found:.3g}, in the training {self.largest:.3g}: give the unit of the training"
            )

    def remarks(self, sequence: Floats, finished: bool) -> tuple[str, ...]:
        """What is unusual about a movement (T, D), or about a beginning, in words."""
        found, n_frames, step = [], len(sequence), peak_step(sequence)
        largest = float(np.abs(sequence).max())
        if finished and largest * OTHER_UNIT < self.largest:
            found.append(
                f"its largest value is {largest:.3g}, in the training {self.largest:.3g}: is it in their unit?"
            )
        usual = f"movements of the training have {self.shortest:g} to {self.longest:g}"
        if finished and n_frames * OTHER_RATE < self.shortest:
            found.append(f"it has {n_frames} frames, {usual}: is it complete, and at their frame rate?")
        if n_frames > self.longest * OTHER_RATE:
            found.append(f"it has {n_frames} frames, {usual}: is it one movement, and at their frame rate?")
        if step > self.fastest * OTHER_RATE:
            ratio = step / max(self.fastest, 1e-300)
            found.append(
                f"it moves {ratio:.1f} times as far in a frame as any of the training: is it at their frame rate?"
            )
        return tuple(found)


def peak_step(sequence: Floats) -> float:
    """Largest distance between the means of successive tenths of the time, per frame: noise of frames hardly counts."""
    steps = np.linalg.norm(np.diff(part_means(sequence, PARTS, PART_FRAMES), axis=0), axis=1)
    return float(steps.max()) * PARTS / len(sequence)
