"""People made up of straight lines: they sit at a table, touch places on it, and their hand stays there."""

from __future__ import annotations

from functools import cache

import numpy as np

from paramove.motion.modelled_movement import ModelledMovement
from paramove.motion.relocation import RelocationPlanner
from paramove.motion.timing import minimum_jerk
from paramove.phmm import MovementDescription, PolynomialPHMM
from tests.motion.reaching import ARM, HOAP3, solver

POINTS = ("shoulder", "elbow", "knuckle", "index", "thumb")
DESCRIPTION = MovementDescription("touching", POINTS, frame="body", duration=0.8, arrival=1.0)
REST = np.array([0.30, 0.02, -0.24])
"""m; where the hand lies, and the box of the touched places."""
NEAR, FAR = np.array([0.36, -0.15, -0.28]), np.array([0.50, 0.20, -0.20])
UPPER_ARM, FOREARM, FINGER = 0.28, 0.30, 0.08
FRAMES = 40


def touch(target: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """One movement, [40, 15], m: origin in the shoulder."""
    u = np.linspace(0.0, 1.0, FRAMES)[:, None]
    start = REST + rng.normal(0.0, 0.004, 3)
    index = start + minimum_jerk(u) * (target - start) + 0.05 * np.sin(np.pi * u) * [0.0, 0.0, 1.0]
    ahead = index * [1.0, 1.0, 0.0]
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    knuckle, thumb = index - FINGER * ahead, index - 0.5 * FINGER * ahead + [0.0, 0.03, 0.01]
    distance = np.linalg.norm(knuckle, axis=1, keepdims=True)
    along = knuckle / distance
    middle = (UPPER_ARM**2 + distance**2 - FOREARM**2) / (2.0 * distance)
    down = np.array([0.0, -0.3, -1.0]) - along * (along @ [0.0, -0.3, -1.0])[:, None]
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    elbow = middle * along + np.sqrt(UPPER_ARM**2 - middle**2) * down
    points = np.concatenate([np.zeros_like(index), elbow, knuckle, index, thumb], axis=1)
    return np.asarray(points + rng.normal(0.0, 0.001, points.shape))


def touches(repetitions: int = 2) -> tuple[list[np.ndarray], np.ndarray]:
    """Movements to a raster of 3 x 3 x 2 places, and the places."""
    rng = np.random.default_rng(0)
    lines = [np.linspace(low, high, n) for low, high, n in zip(NEAR, FAR, (3, 3, 2), strict=True)]
    places = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    theta = np.repeat(places, repetitions, axis=0)
    return [touch(target, rng) for target in theta], theta


@cache
def touching_model(degree: int = 1) -> PolynomialPHMM:
    model = PolynomialPHMM(
        20, 2, 3, degree=degree, resampled_frames=50, residuals="independent", description=DESCRIPTION
    )
    return model.fit(*touches())


@cache
def touching(degree: int = 1) -> ModelledMovement:
    return ModelledMovement(touching_model(degree), solver().length)


@cache
def touching_planner(degree: int = 1) -> RelocationPlanner:
    return RelocationPlanner(touching(degree), solver(), HOAP3, ARM)
