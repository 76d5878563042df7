"""Pointing movements of the synthetic demonstrator over the table (thesis 4.2.1), for tests of accuracy."""

from __future__ import annotations

import numpy as np

from paramove.demonstrations import demonstrations_at, table_targets
from paramove.hmm import resample

RASTER_CM = np.array([80.0, 30.0])


def table_movements(columns: int, rows: int, repetitions: int, seed: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Movements of 100 frames at a raster, shape (100, 21), and their (u, v)."""
    targets, places = table_targets(columns, rows)
    rng = np.random.default_rng(seed)
    shown = demonstrations_at(targets, rng, action="pointing", repetitions=repetitions).sequences
    return [resample(one, 100) for one in shown], np.repeat(places, repetitions, axis=0)
