"""Synthesis under conditions: poses that a movement passes.

Whole executions of one theta deviate from their mean with the covariance C of `movement_parts`. Between the middles of
the parts and the last frame, deviations follow a cubic spline, which is continuous to the acceleration; so a movement
is Gaussian in its whole course, and conditions on poses are linear.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from paramove.documents import Floats
from paramove.phmm.performance import PARTS

TIMES = (*((np.arange(PARTS) + 0.5) / PARTS).tolist(), 1.0)
"""Fractions of a movement at which deviations are known: middles of the parts, and the end."""
EXACT = 1e-9
"""Variance of a condition, relative to that of the movement there."""


def deviation(missed_at: Mapping[float, Floats], covariance: Floats, n_samples: int) -> Floats:
    """The most likely deviation from the mean movement under all conditions. Shape (n_samples, D).

    Args:
        missed_at: what the mean movement lacks (D,) at fractions of it; NaN: anything. As many as the six times of
            `movement_parts` can meet; others are met as well as possible.
        covariance: of `movement_parts`, (6 D, 6 D). n_samples: of the movement.
    """
    dimension = len(covariance) // len(TIMES)
    rows = np.kron(_splines()(list(missed_at)), np.eye(dimension))
    missed = np.concatenate(list(missed_at.values()))
    known = np.isfinite(missed)
    rows, missed = rows[known], missed[known]
    crossed = covariance @ rows.T
    own = rows @ crossed
    weights = np.linalg.solve(own + EXACT * np.diag(np.diagonal(own)), missed)
    moved = (crossed @ weights).reshape(len(TIMES), dimension)
    result: Floats = _splines()(np.linspace(0.0, 1.0, n_samples)) @ moved
    return result


@lru_cache(maxsize=1)
def _splines() -> Any:
    from scipy.interpolate import CubicSpline  # half a second, which only those who need it should wait

    return CubicSpline(TIMES, np.eye(len(TIMES)))
