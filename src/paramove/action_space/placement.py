"""Where a person sits and how large the person is: from the frame of the models to the world and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from paramove.demonstrations import RESTING_SHOULDER, ArmLengths
from paramove.documents import Floats, InputError

SCALES = (0.3, 2.0)
"""Arm lengths relative to the demonstrator's: from a small humanoid robot to more than any person. Lengths in mm are
far outside."""


@dataclass(frozen=True)
class PersonPlacement:
    """A similarity about the resting shoulder (thesis 6.4.1, where persons and models differ in position only).

    World and model have the same directions: x forward, y left, z up, m.

    Attributes:
        shoulder: the person's resting shoulder in the world, m.
        scale: arm length of the person divided by that of the demonstrator.
    """

    shoulder: tuple[float, float, float] = tuple(map(float, RESTING_SHOULDER))  # type: ignore[assignment]
    scale: float = 1.0

    def __post_init__(self) -> None:
        """Raises InputError for a position that is not finite or a scale out of range."""
        if len(self.shoulder) != 3 or not np.isfinite(self.shoulder).all():
            raise InputError(f"expected three finite coordinates of the shoulder in m, found {self.shoulder}")
        if not SCALES[0] <= self.scale <= SCALES[1]:
            raise InputError(
                f"an arm is {SCALES[0]} to {SCALES[1]} times as long as the demonstrator's, found {self.scale:.3g}; "
                "lengths are in m"
            )

    @classmethod
    def of_arm(cls, shoulder: ArrayLike, arm_length: float) -> PersonPlacement:
        """From the resting shoulder (3,) and the length from shoulder to finger tip of the stretched arm, both in m."""
        x, y, z = np.asarray(shoulder, dtype=np.float64)
        usual = ArmLengths()
        return cls((float(x), float(y), float(z)), arm_length / (usual.upper_arm + usual.forearm + usual.fingertip))

    def in_world(self, points: Floats) -> Floats:
        """Points (..., 3 n), stacked or single, of the models' frame in the world."""
        stacked = points.reshape(*points.shape[:-1], -1, 3)
        placed = np.asarray(self.shoulder) + self.scale * (stacked - RESTING_SHOULDER)
        return np.asarray(placed.reshape(points.shape))

    def in_model(self, points: Floats) -> Floats:
        """Points (..., 3 n) of the world in the models' frame; the inverse of `in_world`."""
        stacked = points.reshape(*points.shape[:-1], -1, 3)
        placed = RESTING_SHOULDER + (stacked - np.asarray(self.shoulder)) / self.scale
        return np.asarray(placed.reshape(points.shape))
