"""Folds of cross-validation over groups, and inflation of covariances of theta by errors of left-out movements."""

from collections.abc import Iterator

import numpy as np
from scipy.special import chdtri  # scipy.stats would take half a second to import

from paramove.documents import Floats, Ints

MAX_FOLDS = 10


def fold_numbers(groups: Ints) -> Ints:
    """Number below `MAX_FOLDS` of each movement's fold, from its group (K,); groups stay together. Shape (K,).

    For one or two groups, parts of their movements.
    """
    different = np.unique(groups)
    numbers = np.searchsorted(different, groups) if len(different) > 2 else np.arange(len(groups))
    return np.asarray(numbers % MAX_FOLDS, dtype=np.int64)


def folds_of(groups: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Tested movements and the others, for each fold of `fold_numbers` that leaves at least two others."""
    numbers = fold_numbers(groups)
    for fold in np.unique(numbers):
        tested, others = np.flatnonzero(numbers == fold), np.flatnonzero(numbers != fold)
        if len(others) > 1:
            yield tested, others


def inflation_of(excess: Floats, dimension: int, n_groups: int, minimum: float) -> float:
    """Factor on covariances of theta that gives regions their nominal coverage.

    Args:
        excess: squared errors of left-out movements in predicted deviations, (K,); none if nothing could be left out.
        dimension: P. n_groups: how many different groups those are from. minimum: lower bound of the result.
    """
    few = (n_groups + dimension) / max(1, n_groups - 1)  # few groups determine the tails badly
    if not len(excess):
        return few
    level = min(1.0, 0.95 * (1.0 + 1.0 / len(excess)))
    tail = float(np.quantile(excess, level)) / float(chdtri(dimension, 0.05))
    return few * max(minimum, float(excess.mean()) / dimension, tail)
