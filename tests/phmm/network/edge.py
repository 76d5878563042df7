"""A movement that depends nonlinearly on its parameter: a hand that passes an edge below or above it.

A shelf stands between a person and the target; theta is the height of the target. To a target well below
the edge the hand goes straight, to one well above it goes over the edge, and in a narrow range it changes from the one
to the other. A polynomial follows such a change badly, a grid only with many lines.
"""

import numpy as np

from paramove.documents import Floats
from paramove.hmm import minimum_jerk

EDGE_HEIGHT = 0.05
EDGE_WIDTH = 0.06
"""Range of heights within which the path changes, m."""
DETOUR = 0.20
SHARED_DEVIATION, SENSOR_DEVIATION = 0.006, 0.001
N_FRAMES = 100


def strongly_nonlinear_movement(height: float, rng: np.random.Generator | None = None) -> Floats:
    """One movement to a target at this height, -0.3 to 0.3 m from the shelf's middle. Shape (T, 6), m.

    Without a generator it is the prototype, without any variation.
    """
    rate = 1.0 if rng is None else float(np.clip(1.0 + 0.05 * rng.standard_normal(), 0.85, 1.15))
    frames = round(N_FRAMES * rate)
    progress = np.linspace(0.0, 1.0, frames)
    out = minimum_jerk(progress, 0.05, 0.95)
    over = 0.5 * (1.0 + np.tanh((height - EDGE_HEIGHT) / EDGE_WIDTH))
    bend = np.sin(np.pi * out) ** 2
    hand = np.column_stack([0.5 * out - 0.12 * over * bend, 0.10 * bend * (1.0 - 2.0 * over), height * out])
    hand[:, 2] += DETOUR * over * bend - 0.05 * (1.0 - over) * bend
    elbow = 0.5 * hand + np.column_stack([-0.05 * over * bend, np.full(frames, -0.20), -0.15 + 0.10 * over * bend])
    movement = np.column_stack([hand, elbow])
    if rng is not None:
        shared = rng.standard_normal((3, 6)) * SHARED_DEVIATION
        movement += shared[0] + np.outer(out, shared[1]) + np.outer(bend, shared[2])
        movement += SENSOR_DEVIATION * rng.standard_normal(movement.shape)
    return movement
