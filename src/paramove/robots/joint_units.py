"""Joint angles to the integer units that a robot is commanded in, and back.

Thesis table 5.1: +-209 counts per degree for the geared joints, 0 to 120 for the wrist and the fingers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.documents import Floats

INT16_RANGE = (-32768, 32767)


class JointRangeError(ValueError):
    """A joint value that cannot be commanded: not finite, beyond the joint's range, or not an integer unit."""


@dataclass(frozen=True)
class JointUnits:
    """Linear units of J joints: counts = zero_counts + counts_per_rad * angle.

    Attributes:
        names: Joint names, J of them.
        counts_per_rad: Signed factors, shape [J].
        zero_counts: Counts at the angle 0, shape [J].
        lower, upper: Mechanical range, rad, shape [J].
    """

    names: tuple[str, ...]
    counts_per_rad: Floats
    zero_counts: Floats
    lower: Floats
    upper: Floats

    def counts_range(self) -> tuple[Floats, Floats]:
        """Minimum and maximum counts that keep each joint inside its mechanical range, each [J]."""
        ends = np.stack([self.zero_counts + self.counts_per_rad * end for end in (self.lower, self.upper)])
        # The manual's ends are whole counts; rounding must not shut them out.
        return np.ceil(ends.min(axis=0) - 1e-6), np.floor(ends.max(axis=0) + 1e-6)

    def to_counts(self, angles: ArrayLike, beyond: float = 0.0) -> NDArray[np.int16]:
        """Nearest integer units of joint angles.

        Args:
            angles: Shape [..., J], rad.
            beyond: That a joint may lie beyond its range, rad: one that rests against its stop is measured there.

        Returns:
            Shape [..., J].

        Raises:
            JointRangeError: Wrong number of joints, a value that is not finite, or one farther beyond the joint's
                range than by half a count. Nothing is clipped: a clipped NaN would be full travel.
        """
        values = self._checked(angles, "angles")
        counts = np.rint(self.zero_counts + self.counts_per_rad * values)
        low, high = self.counts_range()
        slack = np.abs(self.counts_per_rad) * beyond
        self._reject_first(
            values,
            (counts < low - slack) | (counts > high + slack),
            lambda joint, angle: f"{np.rad2deg(angle):.3f} deg is outside its range {self._range_deg(joint)}",
        )
        return counts.astype(np.int16)

    def to_radians(self, counts: ArrayLike) -> Floats:
        """Joint angles of integer units. Measured joints may lie a little beyond their range, so that is no error.

        Args:
            counts: Shape [..., J], integers that fit in 16 bits.

        Returns:
            Shape [..., J], rad.

        Raises:
            JointRangeError: Wrong number of joints, not finite, not an integer, or beyond 16 bits.
        """
        values = self._checked(counts, "counts")
        low, high = INT16_RANGE
        self._reject_first(
            values,
            (values != np.rint(values)) | (values < low) | (values > high),
            lambda _, value: f"{value!r} is not an integer unit of 16 bits ({low} to {high})",
        )
        return np.asarray((values - self.zero_counts) / self.counts_per_rad, dtype=np.float64)

    def _range_deg(self, joint: int) -> str:
        return f"{np.rad2deg(self.lower[joint]):.3f} to {np.rad2deg(self.upper[joint]):.3f} deg"

    def _checked(self, values: ArrayLike, what: str) -> Floats:
        array = np.asarray(values, dtype=np.float64)
        if array.ndim == 0 or array.shape[-1] != len(self.names):
            raise JointRangeError(f"{what} have shape {array.shape}; the last axis must hold {len(self.names)} joints")
        self._reject_first(array, ~np.isfinite(array), lambda _, value: f"{value} is not a finite number")
        return array

    def _reject_first(self, values: Floats, bad: NDArray[np.bool_], why: Callable[[int, float], str]) -> None:
        """Raise for the first bad value; `why` gets the index of its joint and the value."""
        if bad.any():
            index = tuple(int(i) for i in np.argwhere(bad)[0])
            raise JointRangeError(f"joint {self.names[index[-1]]}: {why(index[-1], values[index])}")
