"""Movements as vectors, linear in features of theta, with Gaussian deviations: what two peers have in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

from paramove.documents import Floats
from studies.movements.method import Estimate


@dataclass(frozen=True)
class QuadraticFeatures:
    """(theta, theta squared, products) of standardised theta, without the constant. Shape (Q,)."""

    centre: Floats
    scale: Floats
    degree: int = 2

    @classmethod
    def of(cls, theta: Floats, degree: int = 2) -> QuadraticFeatures:
        """Standardised by the training parameters (K, P)."""
        return cls(theta.mean(axis=0), np.maximum(theta.std(axis=0), 1e-9), degree)

    def __call__(self, theta: Floats) -> Floats:
        """Features of theta (..., P). Shape (..., Q)."""
        u = (theta - self.centre) / self.scale
        if self.degree == 1:
            return u
        i, j = np.triu_indices(u.shape[-1])
        return np.concatenate([u, u[..., i] * u[..., j]], axis=-1)


@dataclass(frozen=True)
class LinearGaussian:
    """z = offset + slopes features(theta) + e, e ~ N(0, S), stored whitened: L^-1 z with S = L L'.

    Attributes:
        features: of theta.
        factor: lower triangular L, shape (Q, Q).
        offset, slopes: multiplied by L^-1, shapes (Q,) and (Q, F).
        starts: parameters at which the search begins, shape (M, P).
        bounds: minimum and maximum theta of the search, shape (2, P).
    """

    features: QuadraticFeatures
    factor: Floats
    offset: Floats
    slopes: Floats
    starts: Floats
    bounds: Floats

    @classmethod
    def of(
        cls, features: QuadraticFeatures, offset: Floats, slopes: Floats, covariance: Floats, theta: Floats
    ) -> LinearGaussian:
        """The search starts at up to 25 training parameters and stays within their range, widened by half of it."""
        distinct = np.unique(theta, axis=0)
        starts = distinct[np.linspace(0, len(distinct) - 1, min(25, len(distinct))).astype(int)]
        margin = 0.5 * np.maximum(np.ptp(theta, axis=0), 1e-6)
        bounds = np.stack([theta.min(axis=0) - margin, theta.max(axis=0) + margin])
        factor = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
        white = solve_triangular(factor, np.column_stack([offset, slopes]), lower=True)
        return cls(features, factor, white[:, 0], white[:, 1:], starts, bounds)

    def estimate(self, z: Floats) -> Estimate:
        """Maximum likelihood theta and the inverse of its Fisher information."""
        white = self._whitened(z)
        costs = ((white - self.features(self.starts) @ self.slopes.T) ** 2).sum(axis=1)
        start = self.starts[int(np.argmin(costs))]
        solution = least_squares(
            lambda theta: white - self.slopes @ self.features(theta), start, bounds=tuple(self.bounds)
        )
        return Estimate(solution.x, np.linalg.pinv(solution.jac.T @ solution.jac))

    def log_likelihood(self, z: Floats, theta: Floats) -> float:
        """ln N(z; mean(theta), S)."""
        residual = self._whitened(z) - self.slopes @ self.features(theta)
        constant = np.log(np.diag(self.factor)).sum() + 0.5 * len(z) * np.log(2.0 * np.pi)
        return float(-0.5 * residual @ residual - constant)

    def _whitened(self, z: Floats) -> Floats:
        white: Floats = solve_triangular(self.factor, z, lower=True)
        return white - self.offset
