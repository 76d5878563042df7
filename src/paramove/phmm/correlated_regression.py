"""Polynomial regression of whole movements on theta, whose residuals are correlated in time and between points.

The likelihood of an HMM assumes independent frames: it is overconfident about theta, and does not model that a hand
that starts too high usually ends too high. Here a movement is one vector y (all state averages), with
y = Z phi(theta) + e, e ~ N(0, C). All choices are made by cross-validation over groups of training movements
(all those of one person, or of one theta): the regularisation of each degree of the polynomial, the shrinkage of the
correlations, and the inflation of regions of theta that gives them their nominal coverage.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from paramove.documents import Floats, Ints
from paramove.phmm.features import Monomials
from paramove.phmm.left_out import folds_of, inflation_of
from paramove.phmm.noise import distances_with_noise
from paramove.phmm.predictive_distribution import PredictiveDistribution
from paramove.phmm.ridge import chosen_ridge, penalties, residuals_left_out
from paramove.phmm.search_kernels import Movement, aligned_parts, nearest

SHRINKAGES = (0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.97, 1.0)
"""Candidates for the fraction of each variance that counts as independent."""
MIN_RELATIVE_DEVIATION = 0.02
"""Minimum standard deviation as a fraction of the mean one: smaller ones are not known accurately."""
NEWTON_STEPS = 12


@dataclass(frozen=True)
class CorrelatedRegression:
    """y = Z phi(theta) + e with e ~ N(0, C).

    Attributes:
        monomials: of theta.
        coefficients: Z, shape (n, F).
        root: lower triangular L with C = L L', shape (n, n).
        inflation: factor on covariances of theta that gives regions their nominal coverage.
        distances: squared Mahalanobis distances of training movements, each left out, in their order. Shape (K,).
        groups: number of the group of each, shape (K,).
        ridge: per degree above 0. shrinkage: of the correlations.
    """

    monomials: Monomials
    coefficients: Floats
    root: Floats
    inflation: float
    distances: Floats
    groups: Ints
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
        return cls._fitted(y, theta, monomials, groups, ridge, shrinkages)[0]

    @classmethod
    def best_fitted(
        cls, descriptions: Iterable[Floats], theta: Floats, monomials: Monomials, groups: Ints
    ) -> CorrelatedRegression:
        """From the one of several descriptions of the same movements, (K, n) each, that predicts theta best.

        For left-out groups; the first description if nothing can be left out.
        """
        candidates = [cls._fitted(y, theta, monomials, groups, None, SHRINKAGES) for y in descriptions]
        return min(candidates, key=lambda one: one[1])[0]

    @classmethod
    def _fitted(
        cls,
        y: Floats,
        theta: Floats,
        monomials: Monomials,
        groups: Ints,
        ridge: tuple[float, ...] | None,
        shrinkages: tuple[float, ...],
    ) -> tuple[CorrelatedRegression, float]:
        """And the mean error of scaled theta of left-out movements, infinite if none could be left out."""
        features, degrees = monomials.at(theta), monomials.degrees
        ridge = ridge if ridge is not None else chosen_ridge(y, features, degrees, groups)
        penalty = penalties(ridge, degrees, len(y))
        solved = np.linalg.solve(features.T @ features + penalty, features.T @ y)
        coefficients = np.ascontiguousarray(solved.T, dtype=np.float64)  # as after reading a file
        left_out = residuals_left_out(y, features, penalty, groups)
        deviation = deviations_of(left_out)
        folds = _folds(y / deviation, theta, monomials, penalty, groups)
        shrinkage, excess, tested, error = chosen_shrinkage(folds, shrinkages)
        inflation = inflation_of(excess, theta.shape[1], len(np.unique(groups)), minimum=1e-6)
        triangle = np.linalg.cholesky(shrunk(left_out / deviation, shrinkage))
        # Movements that no fold tested are compared with a covariance that includes them.
        distances = (solve_triangular(triangle, (left_out / deviation).T, lower=True) ** 2).sum(axis=0)
        for fold, distance in zip(folds, tested, strict=False):
            distances[fold.members] = distance
        root: Floats = deviation[:, None] * triangle
        return cls(monomials, coefficients, root, inflation, distances, groups, ridge, shrinkage), error

    def mean(self, theta: Floats) -> Floats:
        """Z phi(theta). Shape (n,)."""
        result: Floats = self.coefficients @ self.monomials.at(theta)
        return result

    def estimate(self, y: Floats, margin: float) -> tuple[Floats, Floats]:
        """Most likely theta (P,) and its widened covariance (P, P).

        Args:
            y: the movement, (n,).
            margin: how far outside the bounds of the training theta may lie, as a fraction of their width.
        """
        self._check_length(y)
        _, projector, triangle = self._condensing
        own, bound = self.monomials, 1.0 + 2.0 * margin
        position, slopes = nearest(own.starts, bound, own.exponents, projector @ y, triangle, NEWTON_STEPS)
        information = slopes.T @ slopes
        information.flat[:: len(position) + 1] += 1.0 / bound**2
        covariance = np.linalg.inv(information) * (self.inflation * own.scale[:, None] * own.scale)
        return own.centre + own.scale * position, covariance

    def distance(self, y: Floats, theta: Floats) -> float:
        """Squared Mahalanobis distance of a movement (n,) from that of theta (P,)."""
        self._check_length(y)
        white = self._condensing[0] @ (y - self.mean(theta))
        return float(white @ white)

    def aligned_parts(
        self, sequence: Floats, movement: Movement, begins: Ints, alignments: int, margin: float
    ) -> Floats:
        """See `search_kernels.aligned_parts`; theta is that of `estimate`."""
        _, projector, triangle = self._condensing
        starts, bound = self.monomials.starts, 1.0 + 2.0 * margin
        return aligned_parts(sequence, movement, begins, alignments, starts, bound, projector, triangle, NEWTON_STEPS)

    def widened(self, covariance: Floats) -> CorrelatedRegression:
        """With noise of that covariance (n, n) in every movement."""
        own = self.root @ self.root.T
        moments = own if self.shrinkage >= 1.0 else own - self.shrinkage * np.diag(np.diagonal(own))
        distances = distances_with_noise(self.distances, own, moments, covariance)
        return replace(self, root=np.linalg.cholesky(own + covariance).astype(np.float64), distances=distances)

    def log_density(self, y: Floats, distance: float) -> float:
        """Logarithm of the density of y (n,) at a squared Mahalanobis distance."""
        diagonal = np.diagonal(self.root)
        return float(-0.5 * distance - np.log(diagonal).sum() - 0.5 * len(y) * np.log(2.0 * np.pi))

    def log_p_value(self, distance: float) -> float:
        """Logarithm of the probability that a genuine movement lies as far from the model or farther.

        The logarithms of the distances of left-out training movements are assumed normally distributed, with a mean for
        each group.
        """
        return self._usual.log_above(float(np.log(distance + 1e-9)))

    @cached_property
    def _usual(self) -> PredictiveDistribution:
        """Of the logarithm of the distance of a genuine movement."""
        return PredictiveDistribution.of(np.log(self.distances + 1e-9), self.groups)

    def arrays(self) -> dict[str, Floats]:
        """Everything learned, for a file."""
        scalars = np.array([self.inflation, self.shrinkage, *self.ridge])
        own = {"coefficients": self.coefficients, "root": self.root, "distances": self.distances, "scalars": scalars}
        return own | {"groups": self.groups.astype(np.float64)}

    @classmethod
    def from_arrays(cls, arrays: dict[str, Floats], prefix: str, monomials: Monomials) -> CorrelatedRegression:
        """From the result of `arrays`, with a prefix to the names. Raises ValueError for shapes that do not fit.

        Files of earlier releases hold no groups: each movement is then one of its own.
        """
        coefficients, root = arrays[f"{prefix}coefficients"], arrays[f"{prefix}root"]
        distances, scalars = arrays[f"{prefix}distances"], arrays[f"{prefix}scalars"]
        count = len(coefficients)
        groups = arrays.get(f"{prefix}groups", np.arange(float(len(distances))))
        if groups.shape != distances.shape:
            raise ValueError(f"expected {prefix}groups of shape {distances.shape}, found {groups.shape}")
        if coefficients.shape != (count, len(monomials)) or root.shape != (count, count) or distances.ndim != 1:
            raise ValueError(
                f"expected {prefix}coefficients of shape (n, {len(monomials)}) and root of shape (n, n), "
                f"found {coefficients.shape} and {root.shape}"
            )
        if not (np.diagonal(root) > 0).all() or scalars.ndim != 1 or len(scalars) < 3 or not scalars[0] > 0:
            raise ValueError(f"expected a root with a positive diagonal and an inflation above 0 in {prefix}scalars")
        inflation, shrinkage, *ridge = (float(one) for one in scalars)
        return cls(
            monomials, coefficients, root, inflation, distances, groups.astype(np.int64), tuple(ridge), shrinkage
        )

    def _check_length(self, y: Floats) -> None:
        if len(y) != len(self.coefficients):
            raise ValueError(f"expected a movement of {len(self.coefficients)} numbers, found {len(y)}")

    @cached_property
    def _condensing(self) -> tuple[Floats, Floats, Floats]:
        """L^-1, Q' L^-1 and R, where L^-1 Z = Q R: |L^-1 (y - Z phi)|^2 = |Q' L^-1 y - R phi|^2 + a rest.

        So the search takes as many numbers as there are monomials.
        """
        inverse = solve_triangular(self.root, np.eye(len(self.root)), lower=True)
        basis, triangle = np.linalg.qr(inverse @ self.coefficients)
        return np.ascontiguousarray(inverse), np.ascontiguousarray(basis.T @ inverse), np.ascontiguousarray(triangle)


@dataclass(frozen=True)
class LeftOutFold:
    """Movements left out of a regression: residuals (k, n) and slopes (k, n, P) by the others' coefficients.

    `members` (k,) are their numbers.

    `reference` are residuals of the others, each left out in turn, by regressions without the tested movements:
    otherwise the covariance would include the noise of those.
    """

    members: Ints
    reference: Floats
    residuals: Floats
    slopes: Floats


def _folds(y: Floats, theta: Floats, monomials: Monomials, penalty: Floats, groups: Ints) -> list[LeftOutFold]:
    features, folds = monomials.at(theta), []
    for tested, others in folds_of(groups):
        known = features[others]
        coefficients = np.linalg.solve(known.T @ known + penalty, known.T @ y[others]).T
        slopes = np.stack([coefficients @ monomials.jacobian(one) * monomials.scale for one in theta[tested]])
        reference = residuals_left_out(y[others], known, penalty, groups[others])
        folds.append(LeftOutFold(tested, reference, y[tested] - features[tested] @ coefficients.T, slopes))
    return folds


def chosen_shrinkage(
    folds: list[LeftOutFold], candidates: tuple[float, ...]
) -> tuple[float, Floats, list[Floats], float]:
    """Shrinkage with the smallest error of theta on left-out movements.

    Also these errors in predicted deviations, of all folds, the distances of the movements of each fold, mean error.
    """
    best, minimum = (candidates[-1], np.zeros(0), list[Floats](), np.inf), np.inf
    for shrinkage in candidates:
        tested = [_tested(fold, shrinkage) for fold in folds]
        if not tested:
            break
        error, excess, _ = np.concatenate(tested, axis=1)
        total = float(np.sqrt(error + 1e-12).mean())
        if total < minimum:
            minimum = total
            best = shrinkage, excess, [np.maximum(distance, 0.0) for _, _, distance in tested], total
    return best


def _tested(fold: LeftOutFold, shrinkage: float) -> Floats:
    """Squared error of theta, the same in predicted deviations, and distance, of each tested movement. Shape (3, k)."""
    dimension = fold.slopes.shape[-1]
    solved = _solved(fold.reference, shrinkage, np.concatenate([fold.residuals.T, *fold.slopes], axis=1))
    count = len(fold.residuals)
    result = np.empty((3, count))
    for k in range(count):
        wide = solved[:, count + k * dimension : count + (k + 1) * dimension]
        gradient = wide.T @ fold.residuals[k]
        error = _solved_or_shortest(fold.slopes[k].T @ wide + 1e-9 * np.eye(dimension), gradient)
        excess = float(error @ gradient)
        result[:, k] = error @ error, excess, fold.residuals[k] @ solved[:, k] - excess
    return result


def _solved_or_shortest(matrix: Floats, right: Floats) -> Floats:
    """matrix^-1 right; the shortest solution where two or three movements do not determine a direction of theta."""
    try:
        return np.linalg.solve(matrix, right).astype(np.float64)
    except np.linalg.LinAlgError:
        return np.linalg.lstsq(matrix, right)[0].astype(np.float64)


def deviations_of(residuals: Floats) -> Floats:
    """Standard deviations of residuals (K, n), none much below the mean one. Shape (n,)."""
    deviation = np.sqrt((residuals**2).mean(axis=0))
    result: Floats = np.maximum(deviation, MIN_RELATIVE_DEVIATION * float(np.sqrt((deviation**2).mean())) + 1e-12)
    return result


def shrunk(residuals: Floats, shrinkage: float) -> Floats:
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
