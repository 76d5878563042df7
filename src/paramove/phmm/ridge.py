"""Ridge regression of movements on monomials of theta; its regularisation is chosen by leaving out groups."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats, Ints

STRENGTHS = np.append(10.0 ** np.arange(-5.0, 1.1, 0.5), 1e4)
"""Candidates for the ridge of each degree, as a fraction of the number of movements."""
MAX_ROUNDS = 4
SIMPLER = 0.005
"""A degree above 1 is regularised as far as possible while errors grow by no more than this fraction."""
MIN_LEFT = 1e-3
"""A residual of which the fit took all but this fraction has no information about the movement."""
OFFSETS = (0.0, 0.1, 0.3, 1.0, 3.0)
"""Candidates for the variance of `GroupOffsets`."""


@dataclass(frozen=True)
class GroupOffsets:
    """Movements of a group have an offset in common that theta does not explain: covariance 1 + variance 1 1'.

    Persons sit and reach differently, and what theta is differs between them too. Were their movements independent,
    a habit would be mistaken for an effect of theta; with offsets, differences within persons count for more.

    Attributes:
        groups: of each movement, (K,).
        variance: of the offsets, relative to that of a movement; 0 means independent movements.
    """

    groups: Ints
    variance: float

    def whitened(self, rows: Floats) -> Floats:
        """Rows (K, n) so that generalised least squares becomes ordinary: minus a fraction of the group's mean."""
        return self._moved(rows, lambda fraction: -fraction)

    def restored(self, rows: Floats) -> Floats:
        """Inverse of `whitened`."""
        return self._moved(rows, lambda fraction: fraction / (1.0 - fraction))

    def residuals(self, white: tuple[Floats, Floats], penalty: Floats) -> Floats:
        """Residual of each movement from generalised least squares without its group. Shape (K, n).

        `white` are whitened values (K, n) and features (K, F).
        """
        return self.restored(residuals_left_out(*white, penalty, self.groups))

    def _moved(self, rows: Floats, factor: Callable[[float], float]) -> Floats:
        if self.variance == 0.0:
            return rows
        result = rows.copy()
        for members in members_of(self.groups):
            fraction = 1.0 - 1.0 / float(np.sqrt(1.0 + self.variance * len(members)))
            result[members] += factor(fraction) * rows[members].mean(axis=0)
        return result


def smoothed(features: Floats, degrees: Ints, values: Floats, groups: Ints) -> Floats:
    """Coefficients (m, F) that predict the values (K, m) of left-out groups best, by generalised least squares.

    Every value is the same weighted mean of training values, so smooth training data give smooth predictions.
    """
    offsets, ridge = _chosen_offsets(values, features, degrees, groups)
    white = offsets.whitened(features)
    penalty = penalties(ridge, degrees, len(values))
    solved = np.linalg.solve(white.T @ white + penalty, white.T @ offsets.whitened(values))
    return np.ascontiguousarray(solved.T, dtype=np.float64)


def residuals_left_out(y: Floats, features: Floats, penalty: Floats, groups: Ints) -> Floats:
    """Residual of each movement from a regression without its group, for all at once: (I - H)^-1 r. Shape (K, n).

    Of a single group: its own residuals, enlarged by the degrees of freedom that the fit took.
    """
    if len(np.unique(groups)) < 2:
        return studentised_residuals(y, features, penalty, groups)
    return _rescaled(y, features, penalty, groups, 1.0, 1e-9)[0]


def studentised_residuals(y: Floats, features: Floats, penalty: Floats, groups: Ints) -> Floats:
    """(I - H)^-1/2 r of each group: residuals with the covariance of the movements, whatever the fit took. (K, n).

    Directions that the fit took completely are lost; the others stand for them.
    """
    residuals, known = _rescaled(y, features, penalty, groups, 0.5, MIN_LEFT)
    result: Floats = residuals * np.sqrt(len(y) / max(1.0, known))
    return result


def _rescaled(
    y: Floats, features: Floats, penalty: Floats, groups: Ints, power: float, minimum: float
) -> tuple[Floats, float]:
    """(I - H)^-power r of each group, (K, n), and how many of the K directions the fit did not take.

    Eigenvalues of I - H are at least `minimum`.

    H = F V F' of a group has at most as many eigenvalues s above 0 as there are features: those of L' F' F L, with
    V = L L'. So nothing is larger than features, and the effort grows linearly with the number of movements.
    """
    numbers = np.unique(groups, return_inverse=True)[1].reshape(-1)
    order = np.argsort(numbers, kind="stable")
    begins = np.searchsorted(numbers[order], np.arange(numbers.max() + 1))
    uncertainty = np.linalg.inv(features.T @ features + penalty)
    half = np.linalg.cholesky(0.5 * (uncertainty + uncertainty.T))
    rows = features @ half
    squares = np.add.reduceat((rows[:, :, None] * rows[:, None, :])[order], begins, axis=0)
    values, vectors = np.linalg.eigh(squares)
    left = 1.0 - values
    clipped = np.maximum(left, minimum)
    added = np.where(values > 1e-12, (clipped**-power - 1.0) / np.maximum(values, 1e-12), power)
    residuals: Floats = y - rows @ (rows.T @ y)
    gains = vectors @ (added[:, :, None] * np.swapaxes(vectors, 1, 2))
    for own, gain in zip(np.split(order, begins[1:]), gains, strict=True):
        residuals[own] += rows[own] @ (gain @ (rows[own].T @ residuals[own]))
    return residuals, float(len(y) - (1.0 - np.clip(left / minimum, 0.0, 1.0)).sum())


def chosen_ridge(
    y: Floats, features: Floats, degrees: Ints, groups: Ints, variance: float = 0.0, relative: bool = True
) -> tuple[float, ...]:
    """The ridge per degree, as a fraction of the number of movements, that predicts left-out groups best.

    Relative errors weight a fingertip that is a millimetre off at the target like one that is a centimetre off before,
    which suits the estimation of theta. A movement that is synthesised should be near in centimetres: by its root mean
    square error, averaged over movements, so that one unusual person does not decide.

    One degree after the other, until none changes; a higher degree is never regularised less than a lower one.
    `variance` is that of `GroupOffsets`.
    """
    ridge = tuple(float(STRENGTHS[min(3 + 2 * degree, len(STRENGTHS) - 1)]) for degree in range(int(degrees.max())))
    if len(np.unique(groups)) < 3:
        return ridge
    known: dict[tuple[float, ...], float] = {}
    offsets = GroupOffsets(groups, variance)
    white = offsets.whitened(y), offsets.whitened(features)

    def error(candidate: tuple[float, ...]) -> float:
        if candidate not in known:
            squared = offsets.residuals(white, penalties(candidate, degrees, len(y))) ** 2
            if relative:
                known[candidate] = float(np.log(squared.sum(axis=0) + 1e-12).mean())
            else:
                known[candidate] = 2.0 * float(np.log(np.sqrt(squared.sum(axis=1)).mean() + 1e-12))
        return known[candidate]

    for _ in range(MAX_ROUNDS):
        before = ridge
        for index in range(len(ridge)):
            allowed: list[tuple[float, ...]] = [
                (*ridge[:index], float(strength), *ridge[index + 1 :])
                for strength in STRENGTHS
                if strength >= max(ridge[:index], default=0.0) and strength <= min(ridge[index + 1 :], default=np.inf)
            ]
            minimum = min(map(error, allowed))
            slack = SIMPLER if index else 0.0
            ridge = [one for one in allowed if error(one) <= minimum + slack][-1]
        if ridge == before:
            break
    return ridge


def _chosen_offsets(y: Floats, features: Floats, degrees: Ints, groups: Ints) -> tuple[GroupOffsets, tuple[float, ...]]:
    """Offsets with which left-out groups are predicted best, and the ridge per degree.

    Errors of few groups differ by chance: the smallest variance within one standard error of the best, group by group.

    None if theta does not vary within groups: offsets then cannot be distinguished from an effect of theta. Errors are
    relative in this case, since leaving out a theta at the border is extrapolation, whose centimetres would dominate.
    """
    members = list(members_of(groups))
    within = max(float(np.ptp(features[own], axis=0).max()) for own in members)
    candidates = [GroupOffsets(groups, variance) for variance in OFFSETS]
    if within < 1e-6 or len(members) < 3:
        return candidates[0], chosen_ridge(y, features, degrees, groups)
    if y.shape[1] > len(y):  # a projection to as many numbers as movements has the same sums of squares
        y = np.asarray(np.linalg.qr(y.T, mode="r"), dtype=np.float64).T
    ridges = [chosen_ridge(y, features, degrees, groups, variance, relative=False) for variance in OFFSETS]
    errors = np.empty((len(candidates), len(members)))
    for i, (offsets, ridge) in enumerate(zip(candidates, ridges, strict=True)):
        white = offsets.whitened(y), offsets.whitened(features)
        squared = (offsets.residuals(white, penalties(ridge, degrees, len(y))) ** 2).sum(axis=1)
        errors[i] = [float(np.sqrt(squared[own]).sum()) for own in members]
    worse = errors - errors[np.argmin(errors.sum(axis=1))]
    chosen = int(np.argmax(worse.sum(axis=1) <= worse.std(axis=1, ddof=1) * np.sqrt(len(members))))
    return candidates[chosen], ridges[chosen]


def penalties(ridge: tuple[float, ...], degrees: Ints, count: int) -> Floats:
    """Diagonal matrix that a ridge per degree above 0 adds to the moments of `count` movements. Shape (F, F)."""
    strengths = np.array([0.0, *ridge])
    return np.diag(count * strengths[degrees] + 1e-12)


def members_of(groups: Ints) -> Iterator[Ints]:
    """Indices of the members of each group."""
    for group in np.unique(groups):
        yield np.flatnonzero(groups == group)
