"""Poses of particles from tables of an action, one pass without Python in the loop."""

from __future__ import annotations

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm import compiled_sums


@compiled_sums
def write_polynomial_poses(
    rows: Ints, theta: Floats, tau: Floats, deviation: Floats, coefficients: Floats, exponents: Ints, centre: Floats,
    scale: Floats, factors: Floats, poses: Floats
) -> None:  # fmt: skip
    """Writes poses[rows] of an action whose state means are polynomials of theta (6.2)-(6.6).

    Args:
        rows: particles of this action, (K,). theta (M, >= P), tau (M,), deviation (M, >= R): of all particles.
        coefficients: shape (N, D, F). exponents: (F, P). centre, scale: of theta, (P,). factors: (N, D, R).
        poses: shape (M, D).
    """
    n_states, n_dims, n_monomials = coefficients.shape
    n_factors, n_parameters = factors.shape[2], exponents.shape[1]
    monomials = np.empty(n_monomials)
    for row in rows:
        for f in range(n_monomials):
            product = 1.0
            for p in range(n_parameters):
                u = (theta[row, p] - centre[p]) / scale[p]
                for _ in range(exponents[f, p]):
                    product *= u
            monomials[f] = product
        place = min(max(tau[row], 0.0), 1.0) * (n_states - 1)
        first = min(int(place), n_states - 2) if n_states > 1 else 0
        second = min(first + 1, n_states - 1)
        share = place - first
        for d in range(n_dims):
            low, high = 0.0, 0.0
            for f in range(n_monomials):
                low += coefficients[first, d, f] * monomials[f]
                high += coefficients[second, d, f] * monomials[f]
            for r in range(n_factors):
                low += factors[first, d, r] * deviation[row, r]
                high += factors[second, d, r] * deviation[row, r]
            poses[row, d] = (1.0 - share) * low + share * high


@compiled_sums
def write_tabled_poses(
    rows: Ints, means: Floats, tau: Floats, deviation: Floats, factors: Floats, poses: Floats
) -> None:
    """The same for any model: `means` (K, N, D) are the state means of each of the rows' theta."""
    n_states, n_dims = means.shape[1:]
    for k in range(len(rows)):
        row = rows[k]
        place = min(max(tau[row], 0.0), 1.0) * (n_states - 1)
        first = min(int(place), n_states - 2) if n_states > 1 else 0
        second = min(first + 1, n_states - 1)
        share = place - first
        for d in range(n_dims):
            low, high = means[k, first, d], means[k, second, d]
            for r in range(factors.shape[2]):
                low += factors[first, d, r] * deviation[row, r]
                high += factors[second, d, r] * deviation[row, r]
            poses[row, d] = (1.0 - share) * low + share * high
