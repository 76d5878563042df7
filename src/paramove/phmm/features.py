"""Features of the parameters: monomials make a linear PHMM quadratic, cubic or of any degree (thesis 4.2.3)."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import expit

from paramove.documents import Floats, Ints
from paramove.hmm import compiled

MAX_MONOMIALS = 5000
MAX_PARAMETERS = 12
MAX_STARTS = 32


@dataclass(frozen=True)
class Monomials:
    """All products of at most `degree` components of u, where u = (theta - centre) / scale lies about in [-1, 1].

    Attributes:
        exponents: power of each component of u in each monomial, the constant first, then by degree. Shape (F, P).
        centre, scale: of theta, shape (P,), in the unit of theta.
        units: W1 and, last, b1 of logistic units of u (3.5) after the monomials, often none, (H, P + 1).
    """

    exponents: Ints
    centre: Floats
    scale: Floats
    units: Floats

    @classmethod
    def of_degree(cls, degree: int, theta: Floats) -> Monomials:
        """Monomials for labels (K, P), which give centre and scale.

        Raises ValueError for a degree below 1, and for too many monomials or parameters.
        """
        if degree < 1:
            raise ValueError(f"the degree of a polynomial model is at least 1, found {degree}")
        lower, upper = theta.min(axis=0), theta.max(axis=0)
        half = 0.5 * (upper - lower)
        scale = np.where(half > 0.0, half, 1.0)
        each = range(theta.shape[1])
        if len(each) > MAX_PARAMETERS or degree > MAX_MONOMIALS or comb(len(each) + degree, degree) > MAX_MONOMIALS:
            raise ValueError(
                f"expected at most {MAX_PARAMETERS} parameters and {MAX_MONOMIALS} monomials, "
                f"found degree {degree} of {len(each)} parameters"
            )
        factors = (f for total in range(degree + 1) for f in itertools.combinations_with_replacement(each, total))
        exponents = np.array([[one.count(p) for p in each] for one in factors])
        return cls(exponents, 0.5 * (lower + upper), scale, np.zeros((0, len(each) + 1)))

    @property
    def degrees(self) -> Ints:
        """Degree of each monomial; of logistic units one more than the largest. Shape (F + H,)."""
        degrees: Ints = self.exponents.sum(axis=1)
        return np.concatenate([degrees, np.full(len(self.units), degrees.max() + 1)])

    @cached_property
    def starts(self) -> Floats:
        """Scaled starting points of the search for theta: the middle, and half-way to corners unless linear. (S, P).

        With logistic units a grid, finer where theta has few components.
        """
        middle = np.zeros((1, len(self.centre)))
        if len(self.units):
            n_lines = max(2, int(MAX_STARTS ** (1.0 / len(self.centre)) + 1e-9))
            line = np.linspace(-1.0, 1.0, 2 * n_lines + 1)[1::2]
            return np.concatenate([middle, list(itertools.product(line, repeat=len(self.centre)))])
        if self.degrees.max() <= 1:
            return middle
        return np.concatenate([middle, list(itertools.product((-0.5, 0.5), repeat=len(self.centre)))])

    def __len__(self) -> int:
        return len(self.exponents) + len(self.units)

    def at(self, theta: ArrayLike) -> Floats:
        """Values for theta (..., P). Shape (..., F + H)."""
        u = (np.asarray(theta, dtype=np.float64) - self.centre) / self.scale
        result: Floats = np.prod(u[..., None, :] ** self.exponents, axis=-1)
        if not len(self.units):
            return result
        return np.concatenate([result, expit(u @ self.units[:, :-1].T + self.units[:, -1])], axis=-1)

    def jacobian(self, theta: ArrayLike) -> Floats:
        """Derivatives with respect to theta (P,) or many (K, P). Shape (F + H, P) or (K, F + H, P)."""
        u = (np.asarray(theta, dtype=np.float64) - self.centre) / self.scale
        slopes = slopes_at(np.atleast_2d(u), self.exponents, self.units) / self.scale
        result: Floats = slopes[0] if u.ndim == 1 else slopes
        return result

    def n_distinct(self, theta: Floats) -> int:
        """How many monomials the labels (K, P) determine: the rank of their values."""
        return int(np.linalg.matrix_rank(self.at(theta), tol=1e-8 * np.sqrt(len(theta))))


@compiled
def monomials_at(u: Floats, exponents: Ints, values: Floats, slopes: Floats) -> None:
    """Values (F,) and derivatives (F, P) of the monomials at u (P,), written in place."""
    n_monomials, n_components = exponents.shape
    for f in range(n_monomials):
        product = 1.0
        for p in range(n_components):
            for _ in range(exponents[f, p]):
                product *= u[p]
        values[f] = product
        for p in range(n_components):
            slope = float(exponents[f, p])
            for other in range(n_components):
                power = exponents[f, other] - (1 if other == p else 0)
                for _ in range(power):
                    slope *= u[other]
            slopes[f, p] = slope


@compiled
def features_at(u: Floats, exponents: Ints, units: Floats, values: Floats, slopes: Floats) -> None:
    """`monomials_at`, followed by the logistic units (H, P + 1), written in place."""
    n_monomials, n_components = exponents.shape
    monomials_at(u, exponents, values, slopes)
    for h in range(len(units)):
        total = units[h, n_components]
        for p in range(n_components):
            total += units[h, p] * u[p]
        value = 1.0 / (1.0 + np.exp(-total))
        values[n_monomials + h] = value
        for p in range(n_components):
            slopes[n_monomials + h, p] = value * (1.0 - value) * units[h, p]


@compiled
def slopes_at(rows: Floats, exponents: Ints, units: Floats) -> Floats:
    """Derivatives of all features at u (K, P). Shape (K, F + H, P)."""
    n_features = len(exponents) + len(units)
    values, slopes = np.empty(n_features), np.empty((len(rows), n_features, rows.shape[1]))
    for k in range(len(rows)):
        features_at(rows[k], exponents, units, values, slopes[k])
    return slopes
