"""Ridge regression of movements on monomials of theta; what holds the slopes back is chosen by leaving out groups."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

STRENGTHS = np.append(10.0 ** np.arange(-5.0, 1.1, 0.5), 1e4)
"""Candidates for the ridge of each degree, as a share of the number of movements."""
MOST_ROUNDS = 4
SIMPLER = 0.02
"""A degree above 1 is held back as far as possible while errors grow by no more than this share."""


def smoothed(features: Floats, degrees: Ints, values: Floats, groups: Ints) -> Floats:
    """Coefficients (m, F) that predict the values (K, m) of left-out groups best.

    Every value is the same weighted mean of training values, so what was smooth in training stays so.
    """
    penalty = penalties(chosen_ridge(values, features, degrees, groups, relative=False), degrees, len(values))
    solved = np.linalg.solve(features.T @ features + penalty, features.T @ values)
    return np.ascontiguousarray(solved.T, dtype=np.float64)


def residuals_left_out(y: Floats, features: Floats, penalty: Floats, groups: Ints) -> Floats:
    """What a regression without a movement's group misses of it, for all at once. Shape (K, n)."""
    hat = features @ np.linalg.solve(features.T @ features + penalty, features.T)
    residuals: Floats = y - hat @ y
    if len(np.unique(groups)) < 2:
        widened: Floats = residuals * float(np.sqrt(len(y) / max(1.0, len(y) - np.trace(hat))))
        return widened
    result = np.empty_like(residuals)
    for members in members_of(groups):
        own = np.eye(len(members)) - hat[np.ix_(members, members)]
        own += 1e-9 * np.eye(len(members))
        result[members] = np.linalg.solve(own, residuals[members])
    return result


def chosen_ridge(y: Floats, features: Floats, degrees: Ints, groups: Ints, relative: bool = True) -> tuple[float, ...]:
    """The ridge per degree, as a share of the number of movements, that predicts left-out groups best.

    Relative errors let a fingertip that is a millimetre off at the target count as one that is a centimetre off on the
    way, which theta is found by; a movement that is to be made should be near in centimetres.

    One degree after the other, until none changes; a higher degree is never held back less than a lower one.
    """
    ridge = tuple(float(STRENGTHS[min(3 + 2 * degree, len(STRENGTHS) - 1)]) for degree in range(int(degrees.max())))
    if len(np.unique(groups)) < 3:
        return ridge
    known: dict[tuple[float, ...], float] = {}

    def error(candidate: tuple[float, ...]) -> float:
        if candidate not in known:
            penalty = penalties(candidate, degrees, len(y))
            squared = (residuals_left_out(y, features, penalty, groups) ** 2).sum(axis=0)
            known[candidate] = float(np.log(squared + 1e-12).mean() if relative else np.log(squared.sum() + 1e-12))
        return known[candidate]

    for _ in range(MOST_ROUNDS):
        before = ridge
        for place in range(len(ridge)):
            allowed: list[tuple[float, ...]] = [
                (*ridge[:place], float(strength), *ridge[place + 1 :])
                for strength in STRENGTHS
                if strength >= max(ridge[:place], default=0.0) and strength <= min(ridge[place + 1 :], default=np.inf)
            ]
            least = min(map(error, allowed))
            slack = SIMPLER if place else 0.0
            ridge = [one for one in allowed if error(one) <= least + slack][-1]
        if ridge == before:
            break
    return ridge


def penalties(ridge: tuple[float, ...], degrees: Ints, count: int) -> Floats:
    """Diagonal matrix that a ridge per degree above 0 adds to the moments of `count` movements. Shape (F, F)."""
    strengths = np.array([0.0, *ridge])
    return np.diag(count * strengths[degrees] + 1e-12)


def members_of(groups: Ints) -> Iterator[Ints]:
    """Indices of the members of each group."""
    for group in np.unique(groups):
        yield np.flatnonzero(groups == group)
