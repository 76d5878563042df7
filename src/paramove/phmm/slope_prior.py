"""A prior on how state means depend on theta: weak slopes, alike in neighbouring states.

With few demonstrations the coefficients of a polynomial model are poorly determined and differ from state to state, so
that synthesised movements wobble. Coefficients z of monomials of degree g have the prior precision
lambda_g (I + l^4 D'D) across the states, D the second difference and l a length in states, in the metric of the pooled
covariance. lambda_g follows from the evidence of the training data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from paramove.documents.array_types import Floats, Ints

LEAST_STRENGTH, GREATEST_STRENGTH = 1e-8, 1e8
CONJUGATE_STEPS = 6


@dataclass(frozen=True)
class SlopePrior:
    """Gaussian prior on the coefficients of all states.

    Attributes:
        coupling: I + l^4 D'D, shape (N, N).
        strength: lambda of each monomial, 0 for the constant, shape (F,).
        whitening: makes the pooled covariance the identity, shape (D, D).
        frames: how many frames count as one observation; neighbouring frames say the same twice.
    """

    coupling: Floats
    strength: Floats
    whitening: Floats
    frames: float

    @classmethod
    def weak(cls, n_states: int, degrees: Ints, smoothness: float, pooled: Floats, frames: float) -> SlopePrior:
        """A start for the evidence. `smoothness` is l as a share of all states; `pooled` covariance (D, D)."""
        length = smoothness * n_states
        second = np.diff(np.eye(n_states), n=2, axis=0) if n_states > 2 else np.zeros((0, n_states))
        coupling = np.eye(n_states) + length**4 * second.T @ second
        strength = np.where(degrees > 0, 1e-3, 0.0)
        return cls(coupling, strength, whitening_of(pooled), frames)

    def log_density(self, coefficients: Floats) -> float:
        """Logarithm of the prior at coefficients (N, D, F), up to a constant; times the frames of an observation."""
        white = self.whitening @ coefficients
        pulled = np.einsum("ij,jdf->idf", self.coupling, white)
        return -0.5 * self.frames * float((self.strength * (white * pulled).sum(axis=(0, 1))).sum())

    def with_evidence(self, coefficients: Floats, weights: Floats, degrees: Ints) -> SlopePrior:
        """Strengths that the data make most likely, one step of their fixed point.

        Args:
            coefficients: of the states now, (N, D, F).
            weights: sum of gamma phi phi' in each state, (N, F, F).
            degrees: of the monomials, (F,).
        """
        n_states, dim, n_monomials = coefficients.shape
        white = self.whitening @ coefficients
        size = np.einsum("idf,ij,jdf->f", white, self.coupling, white)
        spread = np.linalg.inv(self._precision(weights / self.frames)).reshape((n_states, n_monomials) * 2)
        remaining = np.einsum("ij,jfif->f", self.coupling, spread) * dim
        strength = np.zeros(n_monomials)
        for degree in range(1, int(degrees.max()) + 1):
            same = degrees == degree
            found = n_states * dim * same.sum() / (size[same].sum() + remaining[same].sum())
            strength[same] = np.clip(found, LEAST_STRENGTH, GREATEST_STRENGTH)
        return SlopePrior(self.coupling, strength, self.whitening, self.frames)

    def improved(self, coefficients: Floats, weights: Floats, crossed: Floats, covariances: Floats) -> Floats:
        """Coefficients that raise the expected log-likelihood plus prior, by conjugate gradients from those given.

        Every step raises the objective, so that training with the prior never makes it fall.

        Args:
            coefficients: Z now, (N, D, F).
            weights: sum of gamma phi phi', (N, F, F).
            crossed: sum of gamma r phi' with r the residuals of Z, (N, D, F).
            covariances: of the states, (N, D, D).

        Returns:
            Z, (N, D, F).
        """
        unwhitening = np.linalg.inv(self.whitening)
        curvature = unwhitening.T @ np.linalg.solve(covariances, unwhitening[None])  # (N, D, D), 1 if all are pooled
        share = np.trace(curvature, axis1=1, axis2=2) / curvature.shape[1]
        factor = np.linalg.inv(self._precision(share[:, None, None] * weights))
        white = self.whitening @ coefficients

        def pulled(direction: Floats) -> Floats:
            return np.asarray(self.frames * self.strength * np.einsum("ij,jdf->idf", self.coupling, direction))

        def preconditioned(gradient: Floats) -> Floats:
            stacked = np.swapaxes(gradient, 1, 2).reshape(-1, gradient.shape[1])
            return np.swapaxes((factor @ stacked).reshape(gradient.shape[0], -1, gradient.shape[1]), 1, 2)

        gradient = curvature @ (self.whitening @ crossed) - pulled(white)
        step = direction = preconditioned(gradient)
        slope = float((gradient * step).sum())
        for _ in range(CONJUGATE_STEPS):
            if slope <= 0.0:
                break
            bent = curvature @ direction @ weights + pulled(direction)
            length = slope / float((direction * bent).sum())
            white = white + length * direction
            gradient = gradient - length * bent
            step = preconditioned(gradient)
            previous, slope = slope, float((gradient * step).sum())
            direction = step + slope / previous * direction
        result: Floats = unwhitening @ white
        return result

    def _precision(self, weights: Floats) -> Floats:
        """Posterior precision of one whitened dimension, (N F, N F), with the data's part (N, F, F)."""
        n_states, n_monomials, _ = weights.shape
        total = np.zeros((n_states, n_monomials, n_states, n_monomials))
        index = np.arange(n_states)
        total[index, :, index, :] = weights
        each = np.arange(n_monomials)
        total[:, each, :, each] += (self.strength * self.frames)[:, None, None] * self.coupling[None]
        return total.reshape(n_states * n_monomials, -1)


def whitening_of(covariance: Floats) -> Floats:
    """Inverse Cholesky factor of a covariance (D, D)."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))
