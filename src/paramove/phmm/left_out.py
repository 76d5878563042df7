"""Folds of cross-validation over groups, and inflation of covariances of theta by errors of left-out movements."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri  # scipy.stats would take half a second to import

from paramove.documents import Floats, Ints

MAX_FOLDS = 10


class LeftOut(NamedTuple):
    """What models of other movements find for each of K movements; NaN where it was in no fold.

    Attributes:
        missed: errors of theta, shape (K, P).
        covariances: those predicted for it, shape (K, P, P).
        distances: of the movement from the model, shape (K,).
    """

    missed: Floats
    covariances: Floats
    distances: Floats

    @property
    def squares(self) -> Floats:
        """Squared errors in predicted deviations, of the movements in a fold."""
        missed, covariances = (one[np.isfinite(self.distances)] for one in (self.missed, self.covariances))
        result: Floats = (missed * np.linalg.solve(covariances, missed[..., None])[..., 0]).sum(axis=1)
        return result


def folds_of(groups: Ints, least: int = 3) -> Iterator[tuple[Ints, Ints]]:
    """Tested movements and the others, of up to `MAX_FOLDS` folds that leave at least two others.

    Movements of a group (K,) stay together; those of fewer than `least` groups do not.
    """
    different = np.unique(groups)
    each = np.searchsorted(different, groups) if len(different) >= least else np.arange(len(groups))
    numbers = each % MAX_FOLDS
    for fold in np.unique(numbers):
        tested, others = np.flatnonzero(numbers == fold), np.flatnonzero(numbers != fold)
        if len(others) > 1:
            yield tested, others


def one_theta_each(theta: Floats, groups: Ints) -> bool:
    """Whether movements of a group have the same theta, up to a tenth of its range; false for persons."""
    widths = np.maximum(np.ptp(theta, axis=0), 1e-300)
    within = (np.ptp(theta[groups == group], axis=0) for group in np.unique(groups))
    return bool(max(float((one / widths).max()) for one in within) < 0.1)


def inflation_of(tests: Sequence[Floats], dimension: int, n_persons: int | None) -> float:
    """Factor on covariances of theta that gives regions their nominal coverage.

    It lies between what the mean and the 95 % quantile of the errors need, where that is more.

    Args:
        tests: squared errors of left-out movements in predicted deviations, (K,), of one or several ways to leave out;
            the largest factor counts. None or empty if nothing could be left out.
        dimension: P.
        n_persons: how many persons the errors are from: few determine tails badly. Of two, each was predicted from one
            alone, whose habits are errors too: that is wide enough. None: errors are independent.
    """
    few = 1.0 if n_persons is None or n_persons == 2 else (n_persons + dimension) / max(1, n_persons - 1)
    factors = []
    for excess in tests:
        if len(excess):
            level = min(1.0, 0.95 * (1.0 + 1.0 / len(excess)))
            mean = float(excess.mean()) / dimension
            tail = float(np.quantile(excess, level)) / float(chdtri(dimension, 0.05))
            factors.append(mean + 0.5 * max(0.0, tail - mean))
    return few * max(factors) if factors else few
