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
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.hmm import interpolate
from paramove.phmm.correlated_regression import CorrelatedRegression
from paramove.phmm.performance import OUTLIER_SHRINKAGE, PARTS

FOLLOWED = 0.9
"""Fraction of the correlations of executions that conditions follow."""
START = 0.05
"""Conditions up to this fraction of a movement are conditions on its start."""
TIMES = (*((np.arange(PARTS) + 0.5) / PARTS).tolist(), 1.0)
"""Fractions of a movement at which deviations are known: middles of the parts, and the end."""
EXACT = 1e-9
"""Variance of a condition, relative to that of the movement there."""


def passing(mean: Floats, via: Mapping[float, ArrayLike], executions: CorrelatedRegression) -> Floats:
    """The most likely movement (n, D) that passes poses `via`, see `ParametricHMM.synthesize_through`.

    Args:
        mean: the movement without conditions, (n, D).
        via: poses (D,) by fractions of the movement.
        executions: how whole executions vary, `Performances.complete`.

    Raises ValueError for poses and fractions that do not fit.
    """
    missed: dict[float, Floats] = {}
    for progress, pose in via.items():
        wanted = np.asarray(pose, dtype=np.float64)
        if wanted.shape != mean.shape[1:] or np.isinf(wanted).any() or not 0.0 <= progress <= 1.0:
            raise ValueError(
                f"via has poses of {mean.shape[1]} numbers by fractions from 0 to 1, found shape {wanted.shape} at "
                f"{progress}"
            )
        missed[progress] = wanted - interpolate(mean, np.array([progress * (len(mean) - 1)]))[0]
    if not missed:
        return mean
    if min(missed) > START:
        missed[0.0] = np.zeros(mean.shape[1])
    covariance = executions.root @ executions.root.T
    diagonal = np.diag(np.diagonal(covariance))
    # Detection of outliers takes half of the correlations for chance; synthesis follows nearly all of them.
    followed = diagonal + FOLLOWED / (1.0 - OUTLIER_SHRINKAGE) * (covariance - diagonal)
    result: Floats = mean + deviation(missed, followed, len(mean))
    return result


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
