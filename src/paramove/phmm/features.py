"""Monomials of the parameters: what makes a linear PHMM quadratic, cubic or of any degree (thesis 4.2.3)."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.hmm import compiled

MAX_MONOMIALS = 5000
MAX_PARAMETERS = 12


@dataclass(frozen=True)
class Monomials:
    """All products of at most `degree` components of u, where u = (theta - centre) / scale lies about in [-1, 1].

    Attributes:
        exponents: power of each component of u in each monomial, the constant first, then by degree. Shape (F, P).
        centre, scale: of theta, shape (P,), in the unit of theta.
    """

    exponents: Ints
    centre: Floats
    scale: Floats

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
        return cls(np.array([[one.count(p) for p in each] for one in factors]), 0.5 * (lower + upper), scale)

    @property
    def degrees(self) -> Ints:
        """Degree of each monomial. Shape (F,)."""
        result: Ints = self.exponents.sum(axis=1)
        return result

    @cached_property
    def starts(self) -> Floats:
        """Scaled starting points of the search for theta: the middle, and half-way to corners unless linear. (S, P)."""
        middle = np.zeros((1, len(self.centre)))
        if self.degrees.max() <= 1:
            return middle
        return np.concatenate([middle, list(itertools.product((-0.5, 0.5), repeat=len(self.centre)))])

    def __len__(self) -> int:
        return len(self.exponents)

    def at(self, theta: ArrayLike) -> Floats:
        """Values for theta (..., P). Shape (..., F)."""
        u = (np.asarray(theta, dtype=np.float64) - self.centre) / self.scale
        result: Floats = np.prod(u[..., None, :] ** self.exponents, axis=-1)
        return result

    def jacobian(self, theta: ArrayLike) -> Floats:
        """Derivatives with respect to theta (P,). Shape (F, P)."""
        u = (np.asarray(theta, dtype=np.float64) - self.centre) / self.scale
        values, slopes = np.empty(len(self)), np.empty((len(self), len(u)))
        monomials_at(u, self.exponents, values, slopes)
        result: Floats = slopes / self.scale
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
