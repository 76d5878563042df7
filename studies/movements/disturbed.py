"""Movements that a person did not finish, made of finished ones."""

from __future__ import annotations

import numpy as np

from paramove.documents import Floats

SENSOR_NOISE_M = 0.001


def aborted(x: Floats) -> Floats:
    """Cut half-way and taken back along the same path at the same pace. Shapes (T, D) -> (T, D)."""
    half = x[: (len(x) + 1) // 2]
    return np.concatenate([half, half[::-1]])[: len(x)]


def stopped(x: Floats, rng: np.random.Generator) -> Floats:
    """Cut half-way and held until the normal length, with the noise of a sensor. Shapes (T, D) -> (T, D), m."""
    half = x[: (len(x) + 1) // 2]
    held = np.repeat(half[-1:], len(x) - len(half), axis=0)
    return np.concatenate([half, held + SENSOR_NOISE_M * rng.standard_normal(held.shape)])
