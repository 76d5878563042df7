"""What an arm cannot reach, and why."""

from __future__ import annotations

import numpy as np

from paramove.documents import Floats


class OutOfReachError(ValueError):
    """A pose that an arm cannot take; the message names the cause and the nearest that is reachable.

    Attributes:
        pitch: Nearest reachable pitch at the same position, rad, if there is one.
        position: If not, a reachable point [3] nearer to the shoulder, frame of the base, m, if there is one.
    """

    def __init__(self, message: str, pitch: float | None = None, position: Floats | None = None) -> None:
        super().__init__(message)
        self.pitch = pitch
        self.position = position


def describe_miss(names: tuple[str, ...], lower: Floats, upper: Floats, solutions: Floats) -> str:
    """Why none of the solutions [S, J], some of them nan, is within the limits: the joint of the smallest excess."""
    finite = solutions[np.isfinite(solutions).all(axis=-1)]
    beyond = np.maximum(lower - finite, finite - upper)
    best = beyond.max(axis=-1).argmin()
    joint = int(beyond[best].argmax())
    angle, minimum, maximum = np.rad2deg([finite[best, joint], lower[joint], upper[joint]])
    return f"{names[joint]} would have to turn to {angle:.1f} deg, its range is {minimum:.1f} to {maximum:.1f} deg"
