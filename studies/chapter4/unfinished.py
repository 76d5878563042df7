"""Out-and-back movements that a person did not finish, made of finished ones.

Half-way is half of the fingertip's path out, not half of the time: such a movement rests at its target.
"""

from __future__ import annotations

import numpy as np

from paramove.demonstrations import POINT_NAMES
from paramove.documents import Floats
from studies.movements.disturbed import SENSOR_NOISE_M

TIP = POINT_NAMES.index("index")


def half_way(x: Floats) -> int:
    """Frame in which the fingertip has gone half of its path to its farthest position from the start."""
    tip = x.reshape(len(x), -1, 3)[:, TIP]
    farthest = int(np.linalg.norm(tip - tip[0], axis=1).argmax())
    length = np.cumsum(np.linalg.norm(np.diff(tip[: farthest + 1], axis=0), axis=1))
    return 1 + int(np.searchsorted(length, 0.5 * length[-1])) if len(length) else 0


def aborted(x: Floats, rng: np.random.Generator) -> Floats:
    """Cut half-way, taken back along the same path, then at rest until the normal length. (T, 21) -> (T, 21), m."""
    out = x[: half_way(x) + 1]
    return _held(np.concatenate([out, out[-2::-1]])[: len(x)], len(x), rng)


def stopped(x: Floats, rng: np.random.Generator) -> Floats:
    """Cut half-way and held there until the normal length. (T, 21) -> (T, 21), m."""
    return _held(x[: half_way(x) + 1], len(x), rng)


def _held(x: Floats, n_frames: int, rng: np.random.Generator) -> Floats:
    rest = np.repeat(x[-1:], n_frames - len(x), axis=0)
    return np.concatenate([x, rest + SENSOR_NOISE_M * rng.standard_normal(rest.shape)])
