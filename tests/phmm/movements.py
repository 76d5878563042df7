"""Small movements and models on which the tests of parametric HMMs agree."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from paramove.hmm import TrainingOptions
from paramove.phmm import CubicPHMM, InterpolativePHMM, LinearPHMM, NeuralPHMM, ParametricHMM, QuadraticPHMM

CLASSES: tuple[type[ParametricHMM], ...] = (LinearPHMM, QuadraticPHMM, CubicPHMM, InterpolativePHMM, NeuralPHMM)
"""Every model that a user may choose."""
FEW = TrainingOptions(max_iterations=8)


def wave(theta: np.ndarray, rng: np.random.Generator, n_frames: int = 40) -> np.ndarray:
    """Three dimensions that depend on any number of parameters, a little curved; shape (n_frames, 3)."""
    progress = np.linspace(0.0, 1.0, n_frames)
    pull = theta @ np.arange(1.0, len(theta) + 1.0) / len(theta)
    points = np.column_stack(
        [
            np.sin(np.pi * progress) * theta[0],
            progress * pull + 0.2 * np.sin(2.0 * np.pi * progress) * pull**2,
            progress + 0.5 * np.sin(np.pi * progress) * theta[-1],
        ]
    )
    return points + 0.01 * rng.standard_normal(3) + 0.004 * rng.standard_normal(points.shape)


def raster(lines: int, dimension: int, repetitions: int) -> np.ndarray:
    """Every point of a grid over [0, 1]^P, several times. Shape (lines^P repetitions, P)."""
    mesh = np.meshgrid(*[np.linspace(0.0, 1.0, lines)] * dimension, indexing="ij")
    return np.repeat(np.stack([axis.ravel() for axis in mesh], axis=1), repetitions, axis=0)


def shown(seed: int, lines: int = 3, dimension: int = 2, repetitions: int = 4) -> tuple[list[np.ndarray], np.ndarray]:
    """Movements at a grid, with theta."""
    rng = np.random.default_rng(seed)
    theta = raster(lines, dimension, repetitions)
    return [wave(one, rng) for one in theta], theta


def untrained(kind: type[ParametricHMM], **parameters: object) -> ParametricHMM:
    """A small model of a class: 8 states of 4 to 6 frames."""
    return kind(8, 4, 6, options=FEW, **parameters)


def trained(kind: type[ParametricHMM], seed: int = 0, **parameters: object) -> ParametricHMM:
    """The same after training on a 3 x 3 grid."""
    return untrained(kind, **parameters).fit(*shown(seed))


def numerical_gradient(function: Callable[[np.ndarray], float], place: np.ndarray, step: float = 1e-5) -> np.ndarray:
    """Central differences, shape of the place."""
    result = np.empty(place.size)
    for number in range(place.size):
        moved = np.zeros(place.size)
        moved[number] = step
        moved = moved.reshape(place.shape)
        result[number] = (function(place + moved) - function(place - moved)) / (2.0 * step)
    return result.reshape(place.shape)
