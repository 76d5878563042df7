"""How a hand moves from one place to another: minimum jerk along a gently curved path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats


def minimum_jerk(phase: float) -> float:
    """Fraction of the path after the fraction `phase`, 0 to 1, of the time (Flash and Hogan 1985)."""
    s = min(1.0, max(0.0, phase))
    return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)


@dataclass(frozen=True)
class HandPath:
    """A path of the fingertip from rest to rest.

    Attributes:
        start, goal: Fingertip, [3], m.
        backward_start, backward_goal: Direction from the fingertip to the wrist, [3].
        bulge: Offset of the middle of the path from the straight line, [3], m.
        duration_s: Of the whole path.
    """

    start: Floats
    goal: Floats
    backward_start: Floats
    backward_goal: Floats
    bulge: Floats
    duration_s: float

    def at(self, time_s: float) -> tuple[Floats, Floats]:
        """Fingertip [3] and backward direction [3] (not normalised) after `time_s`."""
        fraction = minimum_jerk(time_s / self.duration_s)
        fingertip = self.start + fraction * (self.goal - self.start) + 4 * fraction * (1 - fraction) * self.bulge
        backward = self.backward_start + fraction * (self.backward_goal - self.backward_start)
        return fingertip, backward


def natural_bulge(draw: np.random.Generator, start: Floats, goal: Floats) -> Floats:
    """A random sideways and upward bulge, [3], m: people's reaching paths bend by about a twentieth of their length."""
    way = goal - start
    length = float(np.hypot(way[0], way[1]))
    if length < 0.01:
        return np.zeros(3)
    sideways = np.array((-way[1], way[0], 0.0)) / length
    return np.asarray(length * (draw.normal(0.0, 0.05) * sideways + np.array((0.0, 0.0, draw.uniform(0.0, 0.03)))))
