"""Polynomial regression of whole movements on theta, whose residuals are correlated in time and between points.

The likelihood of an HMM takes frames for independent: it is sure of a theta long before it may be, and it does not know
that a hand that starts too high usually ends too high. Here a movement is one vector y (all state averages), with
y = Z phi(theta) + e, e ~ N(0, C). All that has to be chosen is chosen by leaving out groups of training movements (all
those of one person, or of one theta): how strongly each degree of the polynomial is held back, how far correlations are
shrunk, and how far regions of theta must be widened to hold what they promise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import log_ndtr

from paramove.phmm.features import Monomials
from paramove.phmm.left_out import fold_numbers, inflation_of
from paramove.phmm.ridge import chosen_ridge, penalties, residuals_left_out
from paramove.phmm.search_kernels import nearest

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SHRINKAGES = (0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.97, 1.0)
"""Candidates for the share of each variance that is taken for independent."""
LEAST_SHARE = 0.02
"""Standard deviations below this share of the mean one are lifted to it: they are known no better."""
NEWTON_STEPS = 12


@dataclass(frozen=True)
class CorrelatedRegression:
    """y = Z phi(theta) + e with e ~ N(0, C).

    Attributes:
        monomials: of theta.
        coefficients: Z, shape (n, F).
        root: lower triangular L with C = L L', shape (n, n).
        inflation: factor on covariances of theta that makes regions hold what they promise.
        distances: squared Mahalanobis distances of training movements, each left out. Shape (K,).
        ridge: share per degree above 0. shrinkage: of the correlations.
    """

    monomials: Monomials
    coefficients: Floats
    root: Floats
    inflation: float
    distances: Floats
    ridge: tuple[float, ...]
    shrinkage: float

    @classmethod
    def fitted(
        cls,
        y: Floats,
        theta: Floats,
        monomials: Monomials,
        groups: Ints,
        ridge: tuple[float, ...] | None = None,
        shrinkages: tuple[float, ...] = SHRINKAGES,
    ) -> CorrelatedRegression:
        """From movements (K, n), labels (K, P) and the number of the group of each (K,); a ridge may be given."""
        features, degrees = monomials.at(theta), monomials.degrees
        ridge = ridge if ridge is not None else chosen_ridge(y, features, degrees, groups)
        penalty = penalties(ridge, degrees, len(y))
        solved = np.linalg.solve(features.T @ features + penalty, features.T @ y)
        coefficients = np.ascontiguousarray(solved.T, dtype=np.float64)  # as a file gives it back
        left_out = residuals_left_out(y, features, penalty, groups)
        deviation = np.sqrt((left_out**2).mean(axis=0))
        deviation = np.maximum(deviation, LEAST_SHARE * float(np.sqrt((deviation**2).mean())) + 1e-12)
        start = cls(monomials, coefficients, np.eye(y.shape[1]), 1.0, np.zeros(0), ridge, 1.0)
        folds = _folds(y / deviation, theta, monomials, penalty, groups)
        shrinkage, excess, distances = _chosen_shrinkage(folds, shrinkages)
        inflation = inflation_of(excess, theta.shape[1], len(np.unique(groups)), least=1e-6)
        covariance = _shrunk(left_out / deviation, shrinkage)
        root: Floats = deviation[:, None] * np.linalg.cholesky(covariance)
        return replace(start, root=root, inflation=inflation, distances=distances, shrinkage=shrinkage)

    def mean(self, theta: Floats) -> Floats:
        """Z phi(theta). Shape (n,)."""
        result: Floats = self.coefficients @ self.monomials.at(theta)
        return result

    def estimate(self, y: Floats, margin: float) -> tuple[Floats, Floats, float]:
        """Most likely theta (P,), its widened covariance (P, P), and the squared Mahalanobis distance there.

        Args:
            y: the movement, (n,).
            margin: how far outside the bounds of the training theta may lie, as a share of their width.
        """
        right, triangle, rest = self._condensed(y)
        bound = 1.0 + 2.0 * margin
        place, misfit, slopes = nearest(self._starts, bound, self.monomials.exponents, right, triangle, NEWTON_STEPS)
        information = slopes.T @ slopes + np.eye(len(place)) / bound**2
        scale = self.monomials.scale
        covariance = self.inflation * np.linalg.inv(information) * np.outer(scale, scale)
        return self.monomials.centre + scale * place, covariance, float(misfit) + rest

    def log_density(self, y: Floats, distance: float) -> float:
        """Logarithm of the density of y (n,) at a squared Mahalanobis distance."""
        diagonal = np.diagonal(self.root)
        return float(-0.5 * distance - np.log(diagonal).sum() - 0.5 * len(y) * np.log(2.0 * np.pi))

    def log_typicality(self, distance: float) -> float:
        """Logarithm of the probability that a genuine movement lies as far from the model or farther.

        The logarithms of the distances of unseen training movements are taken for normally distributed.
        """
        if len(self.distances) < 2:
            return 0.0
        known = np.log(self.distances + 1e-9)
        return float(log_ndtr(-(np.log(distance + 1e-9) - known.mean()) / max(float(known.std()), 1e-3)))

    def arrays(self) -> dict[str, Floats]:
        """Everything learned, for a file."""
        scalars = np.array([self.inflation, self.shrinkage, *self.ridge])
        return {"coefficients": self.coefficients, "root": self.root, "distances": self.distances, "scalars": scalars}

    @classmethod
    def from_arrays(cls, arrays: dict[str, Floats], prefix: str, monomials: Monomials) -> CorrelatedRegression:
        """From what `arrays` gave, with a prefix to the names. Raises ValueError for shapes that do not fit."""
        coefficients, root = arrays[f"{prefix}coefficients"], arrays[f"{prefix}root"]
        distances, scalars = arrays[f"{prefix}distances"], arrays[f"{prefix}scalars"]
        count = len(coefficients)
        if coefficients.shape != (count, len(monomials)) or root.shape != (count, count) or distances.ndim != 1:
            raise ValueError(
                f"expected {prefix}coefficients of shape (n, {len(monomials)}) and root of shape (n, n), "
                f"found {coefficients.shape} and {root.shape}"
            )
        if not (np.diagonal(root) > 0).all() or scalars.ndim != 1 or len(scalars) < 3 or not scalars[0] > 0:
            raise ValueError(f"expected a root with a positive diagonal and an inflation above 0 in {prefix}scalars")
        inflation, shrinkage, *ridge = (float(one) for one in scalars)
        return cls(monomials, coefficients, root, inflation, distances, tuple(ridge), shrinkage)

    def _condensed(self, y: Floats) -> tuple[Floats, Floats, float]:
        """R and c with |L^-1 (y - Z phi)|^2 = |c - R phi|^2 + rest: the movement in as many numbers as monomials."""
        if len(y) != len(self.coefficients):
            raise ValueError(f"expected a movement as {len(self.coefficients)} numbers, found {len(y)}")
        basis, triangle = self._condensing
        white = solve_triangular(self.root, y, lower=True, check_finite=False)
        right = basis.T @ white
        return right, triangle, float(white @ white - right @ right)

    @cached_property
    def _condensing(self) -> tuple[Floats, Floats]:
        """Q and R of L^-1 Z = Q R."""
        white = solve_triangular(self.root, self.coefficients, lower=True)
        basis, triangle = np.linalg.qr(white)
        return basis, np.ascontiguousarray(triangle)

    @cached_property
    def _starts(self) -> Floats:
        """Where theta is looked for: the middle, and half-way to the corners if means are not linear. Shape (S, P)."""
        middle = np.zeros((1, len(self.monomials.centre)))
        if self.monomials.degrees.max() == 1:
            return middle
        return np.concatenate([middle, list(product((-0.5, 0.5), repeat=middle.shape[1]))])


@dataclass(frozen=True)
class _Fold:
    """Movements that a regression has not seen: residuals (k, n) and slopes (k, n, P) by the others' coefficients.

    `reference` are residuals of the others, each left out in turn; had their regression seen the tested movements, the
    covariance would know the noise of those.
    """

    reference: Floats
    residuals: Floats
    slopes: Floats


def _folds(y: Floats, theta: Floats, monomials: Monomials, penalty: Floats, groups: Ints) -> list[_Fold]:
    """The folds of `fold_numbers` that leave at least two other movements."""
    numbers, features = fold_numbers(groups), monomials.at(theta)
    folds = []
    for fold in np.unique(numbers):
        tested, others = np.flatnonzero(numbers == fold), np.flatnonzero(numbers != fold)
        if len(others) < 2:
            continue
        seen = features[others]
        coefficients = np.linalg.solve(seen.T @ seen + penalty, seen.T @ y[others]).T
        slopes = np.stack([coefficients @ monomials.jacobian(one) * monomials.scale for one in theta[tested]])
        reference = residuals_left_out(y[others], seen, penalty, groups[others])
        folds.append(_Fold(reference, y[tested] - features[tested] @ coefficients.T, slopes))
    return folds


def _chosen_shrinkage(folds: list[_Fold], candidates: tuple[float, ...]) -> tuple[float, Floats, Floats]:
    """Shrinkage with the least error of theta on unseen movements; those in predicted deviations, and the distances."""
    best, least = (candidates[-1], np.zeros(0), np.zeros(0)), np.inf
    for shrinkage in candidates:
        found = [_tested(fold, shrinkage) for fold in folds]
        if not found:
            break
        error, excess, distance = np.concatenate(found, axis=1)
        total = float(np.sqrt(error + 1e-12).mean())
        if total < least:
            least = total
            best = shrinkage, excess, np.maximum(distance, 0.0)
    return best


def _tested(fold: _Fold, shrinkage: float) -> Floats:
    """Squared error of theta, the same in predicted deviations, and distance, of each tested movement. Shape (3, k)."""
    dimension = fold.slopes.shape[-1]
    solved = _solved(fold.reference, shrinkage, np.concatenate([fold.residuals.T, *fold.slopes], axis=1))
    count = len(fold.residuals)
    result = np.empty((3, count))
    for k in range(count):
        wide = solved[:, count + k * dimension : count + (k + 1) * dimension]
        gradient = wide.T @ fold.residuals[k]
        missed = np.linalg.solve(fold.slopes[k].T @ wide + 1e-9 * np.eye(dimension), gradient)
        excess = float(missed @ gradient)
        result[:, k] = missed @ missed, excess, fold.residuals[k] @ solved[:, k] - excess
    return result


def _shrunk(residuals: Floats, shrinkage: float) -> Floats:
    """Second moments of standardised residuals (K, n), correlations shrunk. Shape (n, n)."""
    moments = residuals.T @ residuals / len(residuals)
    diagonal = np.diag(np.maximum(np.diagonal(moments), 1e-6))
    result: Floats = (1.0 - shrinkage) * moments + shrinkage * diagonal + 1e-6 * np.eye(len(moments))
    return result


def _solved(residuals: Floats, shrinkage: float, right: Floats) -> Floats:
    """C^-1 right for the shrunk second moments of (K, n) residuals; K may be much less than n (Woodbury)."""
    diagonal = shrinkage * np.maximum((residuals**2).mean(axis=0), 1e-6) + 1e-6
    scaled: Floats = right / diagonal[:, None]
    if shrinkage >= 1.0:
        return scaled
    factor = residuals.T * np.sqrt((1.0 - shrinkage) / len(residuals))
    inner = np.eye(len(residuals)) + factor.T @ (factor / diagonal[:, None])
    result: Floats = scaled - (factor / diagonal[:, None]) @ np.linalg.solve(inner, factor.T @ scaled)
    return result
