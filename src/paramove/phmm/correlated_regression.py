"""Regression of whole movements on theta, whose residuals are correlated in time and between points.

The likelihood of an HMM assumes independent frames: it is overconfident about theta, and does not model that a hand
that starts too high usually ends too high. Here a movement is one vector y, with y = Z phi(theta) + e, e ~ N(0, C).
C follows from studentised residuals: (I - H)^-1/2 r of each group has the covariance of e, whatever the fit took from
it; where groups are persons, from (I - H)^-1 r, what the others' movements miss of a person's. The coefficients are
uncertain too: an unseen movement varies by (1 + phi' V phi) C, with V the inverse of the regularised moments of phi, so
a theta far from those shown has a wide region. All choices are made by cross-validation over groups of training
movements (all those of one person, or of one theta): the regularisation of each degree of the polynomial, the shrinkage
of the correlations, and the inflation of regions of theta that gives them their nominal coverage.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from paramove.documents import Floats, Ints
from paramove.phmm.adaptation import WITHIN, Adaptation
from paramove.phmm.features import Monomials
from paramove.phmm.inverse_regression import InverseRegression
from paramove.phmm.left_out import LeftOut, folds_of, inflation_of, one_theta_each
from paramove.phmm.noise import distances_with_noise
from paramove.phmm.predictive_distribution import PredictiveDistribution
from paramove.phmm.ridge import chosen_ridge, penalties, residuals_left_out, studentised_residuals
from paramove.phmm.search_kernels import all_nearest
from paramove.phmm.storage import check_shapes

SHRINKAGES = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.97, 1.0)
"""Candidates for the fraction of each variance that counts as independent."""
NEWTON_STEPS = 12
MARGIN = 1.0
"""How far outside the bounds of the training left-out movements may lie, as a fraction of the width of theta."""
UNSEEN_CURVATURE = 0.045
"""Deviation of scaled theta by each coefficient above degree 1 that no theta of the training determines."""
KNOWN = 0.5
"""Deviation with which movements determine such a coefficient, in units of their left-out errors: V has a part too."""


@dataclass(frozen=True)
class CorrelatedRegression:
    """y = Z phi(theta) + e with e ~ N(0, C).

    Attributes:
        monomials: of theta.
        coefficients: Z, shape (n, F).
        uncertainty: V, covariance of the coefficients in units of C, shape (F, F).
        unseen: W, the same of what the shown theta cannot determine, see `unseen_curvature`, shape (F, F).
        root: lower triangular L with C = L L', shape (n, n).
        inflation: factor on covariances of theta that gives regions their nominal coverage.
        distances: squared Mahalanobis distances of training movements, each left out, in their order. Shape (K,).
        groups: number of the group of each, shape (K,).
        ridge: per degree above 0. shrinkage: of the correlations.
        inverse: what is stacked with theta of the model; None: nothing is.
    """

    monomials: Monomials
    coefficients: Floats
    uncertainty: Floats
    unseen: Floats
    root: Floats
    inflation: float
    distances: Floats
    groups: Ints
    ridge: tuple[float, ...]
    shrinkage: float
    inverse: InverseRegression | None = None

    @classmethod
    def fitted_with_errors(
        cls,
        ys: Sequence[Floats],
        theta: Floats,
        monomials: Monomials,
        groups: Ints,
        ridge: tuple[float, ...] | None = None,
        shrinkages: tuple[float, ...] = SHRINKAGES,
        end: Floats | None = None,
    ) -> list[tuple[CorrelatedRegression, float]]:
        """Of several descriptions (K, n) of the same movements; what depends on theta alone is computed once.

        And for each the mean error of scaled theta of left-out groups, infinite if no group could be left out. The last
        frame of a movement y is y @ end, `end` of shape (n, D); with it an inverse regression is stacked.
        """
        features, one_each = monomials.at(theta), one_theta_each(theta, groups)
        # Single movements are left out where a theta that was left out could not be predicted.
        few = one_each and len(np.unique(groups)) <= len(monomials) + 1
        units = np.arange(len(theta)) if few else groups
        chosen = ridge if ridge is not None else chosen_ridge(ys[0], features, monomials.degrees, units)

        def fits(own: Ints) -> list[_Fit]:
            parts = [y[own] for y in ys]
            return _Fit.of_several(parts, features[own], monomials, chosen, groups[own], one_each)

        def folds(groups: Ints) -> list[list[tuple[Ints, _Fit]]]:
            """For each description, tested movements and fit of the others."""
            left = [(tested, fits(others)) for tested, others in folds_of(groups, 3 if one_each else 2)]
            return [[(tested, of_others[number]) for tested, of_others in left] for number in range(len(ys))]

        # Whole groups test extrapolation; how movements of one theta vary is tested by leaving out single ones.
        singles = np.random.default_rng(0).permutation(len(theta)) if one_each and not few else None
        ways = [folds(units), *([folds(singles)] if singles is not None else [])]
        n_persons = None if one_each else len(np.unique(groups))
        results = []
        for number, (y, everything) in enumerate(zip(ys, fits(np.arange(len(theta))), strict=True)):
            own = [way[number] for way in ways]
            shrinkage = _chosen_shrinkage(own[0], y, theta, shrinkages)
            regression = everything.regression(groups, chosen, shrinkage)
            tests = [_left_out(one, y, theta, groups, (chosen, shrinkage)) for one in own]
            inverse = None
            if end is not None and own[0]:
                left_out = [([tested for tested, _ in way], found) for way, found in zip(own, tests, strict=True)]
                inverse, tests = InverseRegression.stacked(y, end, theta, left_out)
            inflation = inflation_of([one.squares for one in tests], theta.shape[1], n_persons)
            errors = np.linalg.norm(tests[0].missed / monomials.scale, axis=1)[np.isfinite(tests[0].distances)]
            # Movements that no fold tested are compared with a covariance that includes them.
            everywhere = regression.condensed.distances_from(y, theta)
            distances = np.where(np.isnan(tests[-1].distances), everywhere, tests[-1].distances)
            deviation = np.sqrt((errors**2).sum() / max(1, len(errors)) / theta.shape[1])
            unseen = unseen_curvature(features, monomials.degrees, KNOWN * float(deviation))
            regression = replace(regression, inflation=inflation, distances=distances, inverse=inverse, unseen=unseen)
            results.append((regression, float(errors.mean()) if len(errors) and not few else np.inf))
        return results

    def adapted(self, y: Floats, theta: Floats, adaptation: Adaptation) -> CorrelatedRegression:
        """Of the person whose movements (K, n) at theta (K, P) these are."""
        missed = y - self.monomials.at(theta) @ self.coefficients.T
        return replace(
            self,
            coefficients=self.coefficients + adaptation.change(missed),
            uncertainty=adaptation.remaining(self.uncertainty) / WITHIN,
            root=np.sqrt(WITHIN) * self.root,
            inverse=self.inverse and self.inverse.adapted(y, theta, adaptation),
        )

    def widened(self, covariance: Floats) -> CorrelatedRegression:
        """With noise of that covariance (n, n) in every movement."""
        own = self.root @ self.root.T
        moments = own if self.shrinkage >= 1.0 else own - self.shrinkage * np.diag(np.diagonal(own))
        distances = distances_with_noise(self.distances, own, moments, covariance)
        return replace(
            self,
            root=np.linalg.cholesky(own + covariance).astype(np.float64),
            distances=distances,
            inverse=self.inverse and self.inverse.widened(covariance),
        )

    def log_density(self, distance: float) -> float:
        """Logarithm of the density of a movement at a distance, see `CondensedRegressions.distances_from`."""
        diagonal = np.diagonal(self.root)
        return float(-0.5 * distance - np.log(diagonal).sum() - 0.5 * len(diagonal) * np.log(2.0 * np.pi))

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
        return {
            "coefficients": self.coefficients, "uncertainty": self.uncertainty, "unseen": self.unseen,
            "root": self.root,
            "distances": self.distances, "groups": self.groups.astype(np.float64),
            "scalars": np.array([self.inflation, self.shrinkage, *self.ridge]),
        } | ({} if self.inverse is None else {"inverse": self.inverse.array()})  # fmt: skip

    @classmethod
    def from_arrays(cls, arrays: dict[str, Floats], prefix: str, monomials: Monomials) -> CorrelatedRegression:
        """From the result of `arrays`, with a prefix to the names. Raises ValueError for shapes that do not fit."""
        own = {
            name: arrays[f"{prefix}{name}"]
            for name in ("coefficients", "uncertainty", "unseen", "root", "distances", "groups", "scalars")
        }
        count, size, scalars = len(own["coefficients"]), len(monomials), own["scalars"]
        expected = {"coefficients": (count, size), "uncertainty": (size, size), "unseen": (size, size)}
        check_shapes(arrays, expected | {"root": (count, count)}, prefix)
        check_shapes(arrays, {"distances": own["groups"].shape, "groups": (len(own["distances"]),)}, prefix)
        if not (np.diagonal(own["root"]) > 0).all() or scalars.ndim != 1 or len(scalars) < 3 or not scalars[0] > 0:
            raise ValueError(f"expected a root with a positive diagonal and an inflation above 0 in {prefix}scalars")
        inflation, shrinkage, *ridge = (float(one) for one in scalars)
        inverse = arrays.get(f"{prefix}inverse")
        return cls(
            monomials, own["coefficients"], own["uncertainty"], own["unseen"], own["root"], inflation,
            own["distances"], own["groups"].astype(np.int64), tuple(ridge), shrinkage,
            None if inverse is None else InverseRegression.from_array(inverse, count, len(monomials.centre)),
        )  # fmt: skip

    @cached_property
    def condensed(self) -> CondensedRegressions:
        """As the search takes it."""
        return CondensedRegressions.of([self])


@dataclass(frozen=True)
class CondensedRegressions:
    """One regression of all movements, or one for each, R in all, as the search for theta takes them.

    |L^-1 (y - Z phi)|^2 = |Q' L^-1 y - R phi|^2 + a rest, where L^-1 Z = Q R: so the search takes as many numbers as
    there are monomials.

    Attributes:
        monomials: of all of them.
        inverse: of all, with R in front of the shapes, or None.
        inverses: L^-1, (R, n, n). white: L^-1 Z, (R, n, F). projectors: Q' L^-1, (R, F, n). triangles: R, (R, F, F).
        uncertainty: V, (R, F, F). unseen: W, (R, F, F). inflation: (R,). log_norms: of the density at distance 0, (R,).
    """

    monomials: Monomials
    inverse: InverseRegression | None
    inverses: Floats
    white: Floats
    projectors: Floats
    triangles: Floats
    uncertainty: Floats
    unseen: Floats
    inflation: Floats
    log_norms: Floats

    @classmethod
    def of(cls, regressions: Sequence[CorrelatedRegression]) -> CondensedRegressions:
        """Of regressions of the same monomials and the same length of movements."""
        size = len(regressions[0].root)
        inverses = np.stack([solve_triangular(one.root, np.eye(size), lower=True) for one in regressions])
        white = inverses @ np.stack([one.coefficients for one in regressions])
        bases, triangles = np.linalg.qr(white)
        return cls(
            regressions[0].monomials, InverseRegression.together([one.inverse for one in regressions]),
            inverses, white, np.swapaxes(bases, 1, 2) @ inverses,
            np.ascontiguousarray(triangles), np.stack([one.uncertainty for one in regressions]),
            np.stack([one.unseen for one in regressions]),
            np.array([one.inflation for one in regressions]), np.array([one.log_density(0.0) for one in regressions]),
        )  # fmt: skip

    def part(self, chosen: slice) -> CondensedRegressions:
        """Some of them."""
        monomials, inverse, *others = (getattr(self, field.name) for field in fields(self))
        return CondensedRegressions(monomials, inverse and inverse.part(chosen), *(one[chosen] for one in others))

    def estimates(self, y: Floats, margin: float) -> tuple[Floats, Floats, Floats]:
        """Of movements (K, n) theta (K, P) and its calibrated covariances (K, P, P).

        And theta that explains each movement best, (K, P), from which distances count. Theta lies outside the bounds of
        the training by at most `margin`, a fraction of their width.
        """
        own, bound = self.monomials, 1.0 + 2.0 * margin
        condensed = (self.projectors @ y[..., None])[..., 0]
        positions, slopes = all_nearest(
            own.starts, bound, own.exponents, own.units, condensed, self.triangles, NEWTON_STEPS
        )
        nearest: Floats = own.centre + own.scale * positions
        phi, squares = own.at(nearest), np.diag(own.scale**2)
        information = np.swapaxes(slopes, 1, 2) @ slopes / variances_at(phi, self.uncertainty)[:, None, None]
        covariances = np.linalg.inv(information + np.eye(len(squares)) / bound**2)
        covariances, theta = covariances * (own.scale[:, None] * own.scale), nearest
        if self.inverse is not None:
            theta, covariances = self.inverse.combined(y, nearest, covariances)
            theta = np.clip(theta, own.centre - bound * own.scale, own.centre + bound * own.scale)
        covariances = self.inflation[:, None, None] * covariances
        covariances += (variances_at(phi, self.unseen) - 1.0)[:, None, None] * squares
        return theta, covariances, nearest

    def distances_from(self, y: Floats, theta: Floats) -> Floats:
        """Squared Mahalanobis distances of movements (K, n) from those of theta (K, P), with n ln(1 + phi' V phi). (K,)

        With that, -2 ln of the density up to a constant: what theta far from the training allow is not likely for it.
        """
        phi = self.monomials.at(theta)
        missed = (self.inverses @ y[..., None] - self.white @ phi[..., None])[..., 0]
        factors = variances_at(phi, self.uncertainty)
        result: Floats = (missed**2).sum(axis=1) / factors + y.shape[1] * np.log(factors)
        return result


@dataclass(frozen=True)
class _Fit:
    """Coefficients of some of the movements, before anything is chosen, and second moments of rescaled residuals."""

    monomials: Monomials
    coefficients: Floats
    uncertainty: Floats
    unseen: Floats
    moments: Floats

    @classmethod
    def of_several(
        cls, ys: Sequence[Floats], features: Floats, monomials: Monomials, ridge: tuple[float, ...], groups: Ints,
        one_each: bool,
    ) -> list[_Fit]:  # fmt: skip
        """One of each description; `one_each`: groups are those of one theta, not of one person, who has habits."""
        penalty = penalties(ridge, monomials.degrees, len(features))
        uncertainty = np.linalg.inv(features.T @ features + penalty).astype(np.float64)
        unseen, gain = unseen_curvature(features, monomials.degrees, 0.0), uncertainty @ features.T
        rescaled = (studentised_residuals if one_each else residuals_left_out)(
            np.concatenate(ys, axis=1), features, penalty, groups
        )
        borders = np.cumsum([y.shape[1] for y in ys])[:-1]
        return [
            cls(monomials, np.ascontiguousarray((gain @ y).T), uncertainty, unseen, part.T @ part / len(part))
            for y, part in zip(ys, np.split(rescaled, borders, axis=1), strict=True)
        ]

    def root(self, shrinkage: float) -> Floats:
        return np.linalg.cholesky(shrunk(self.moments, shrinkage)).astype(np.float64)

    def regression(self, groups: Ints, ridge: tuple[float, ...], shrinkage: float) -> CorrelatedRegression:
        """Not calibrated yet."""
        return CorrelatedRegression(
            self.monomials, self.coefficients, self.uncertainty, self.unseen, self.root(shrinkage), 1.0,
            np.zeros(len(groups)), groups, ridge, shrinkage,
        )  # fmt: skip


def _left_out(
    folds: Sequence[tuple[Ints, _Fit]], y: Floats, theta: Floats, groups: Ints,
    chosen: tuple[tuple[float, ...], float],
) -> LeftOut:  # fmt: skip
    count, dimension = theta.shape
    found = LeftOut(*(np.full((count, *shape), np.nan) for shape in ((dimension,), (dimension, dimension), ())))
    for tested, fit in folds:
        other = fit.regression(groups[tested], *chosen).condensed
        theta_found, found.covariances[tested], _ = other.estimates(y[tested], MARGIN)
        found.missed[tested] = theta_found - theta[tested]
        found.distances[tested] = other.distances_from(y[tested], theta_found)
    return found


def _chosen_shrinkage(folds: list[tuple[Ints, _Fit]], y: Floats, theta: Floats, candidates: tuple[float, ...]) -> float:
    """Shrinkage that makes theta of left-out movements most likely.

    Regions may be inflated later, so it is their shape and their relative size that count.
    """
    best, smallest = candidates[-1], np.inf
    for shrinkage in candidates if folds and len(candidates) > 1 else ():
        results = [_linearised(fit, fit.root(shrinkage), y[tested], theta[tested]) for tested, fit in folds]
        excess, log_volumes = np.concatenate(results, axis=1)
        score = float(log_volumes.mean()) + theta.shape[1] * float(np.log(excess.mean() + 1e-300))
        if score < smallest:
            best, smallest = shrinkage, score
    return best


def _linearised(fit: _Fit, root: Floats, y: Floats, theta: Floats) -> Floats:
    """Squared error of theta in predicted deviations and log-volume of its region, of each movement. Shape (2, k)."""
    own, (count, dimension) = fit.monomials, theta.shape
    phi = own.at(theta)
    slopes = np.einsum("nf,kfp->nkp", fit.coefficients, own.jacobian(theta) * own.scale, optimize=True)
    wide = np.concatenate([slopes, (y - phi @ fit.coefficients.T).T[:, :, None]], axis=2).reshape(len(root), -1)
    white = solve_triangular(root, wide, lower=True, check_finite=False).reshape(-1, count, dimension + 1)
    slopes, missed = white[..., :-1], white[..., -1]
    factor = variances_at(phi, fit.uncertainty)
    information = np.einsum("nkp,nkq->kpq", slopes, slopes) / factor[:, None, None]
    information += np.eye(dimension) / (1.0 + 2.0 * MARGIN) ** 2
    gradient = np.einsum("nkp,nk->kp", slopes, missed) / factor[:, None]
    error = np.linalg.solve(information, gradient[..., None])[..., 0]
    excess = np.einsum("kp,kp->k", error, gradient)
    return np.stack([excess, -np.linalg.slogdet(information)[1]])


def variances_at(phi: Floats, uncertainty: Floats) -> Floats:
    """Factor on C for unseen movements with features phi (K, F): 1 + phi' V phi; V of all or of each. Shape (K,)."""
    result: Floats = 1.0 + ((phi[:, None] @ uncertainty)[:, 0] * phi).sum(axis=1)
    return result


def unseen_curvature(features: Floats, degrees: Ints, deviation: float) -> Floats:
    """Covariance of scaled theta by coefficients of degrees above 1 that features (K, F) do not determine. (F, F).

    Between the four corners of a square, nothing shows whether a movement curves; neither residuals nor left-out
    corners do. Such coefficients have a prior deviation; movements determine them with errors of a `deviation`.
    """
    precision = np.diag(np.where(degrees > 1, UNSEEN_CURVATURE**-2.0, 1.0))
    variance = deviation**2 + 1e-6 * UNSEEN_CURVATURE**2 * len(features)
    return np.linalg.inv(features.T @ features / variance + precision).astype(np.float64)


def shrunk(moments: Floats, shrinkage: float) -> Floats:
    """Second moments (n, n) with shrunk correlations. Shape (n, n)."""
    variances = np.maximum(np.diagonal(moments), 1e-12)
    result: Floats = (1.0 - shrinkage) * moments
    result.flat[:: len(moments) + 1] += shrinkage * variances + 1e-6 * variances.mean()
    return result
