"""Adaptation of a model of other persons to a person of whom there are a few movements.

A person's coefficients are Z + D, where those of degree 0 and 1 of D are normally distributed about 0 with a covariance
in units of C, that of movements of unknown persons. Given movements of the person, D follows by Bayesian linear
regression of their residuals; of C a part remains, how the person's own movements vary.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from paramove.documents import Floats, Ints
from paramove.phmm.features import Monomials

PERSONS = (1.0, 0.3)
"""Variance of a person's coefficients of degree 0 and 1 in units of C."""
WITHIN = 0.45
"""Fraction of C with which the movements of one person vary."""


@dataclass(frozen=True)
class Adaptation:
    """What K movements of a person tell, whatever numbers describe them.

    Attributes:
        features: how many the model has. columns: those that change, of degrees 0 and 1, (F',).
        gain: change of these coefficients with the residuals of the movements, (F', K).
        uncertainty: covariance of these coefficients afterwards in units of C, (F', F').
    """

    features: int
    columns: Ints
    gain: Floats
    uncertainty: Floats

    @classmethod
    def of(cls, monomials: Monomials, theta: Floats) -> Self:
        """From theta (K, P) of the movements."""
        columns = np.flatnonzero(monomials.degrees <= 1)
        phi, precision = monomials.at(theta)[:, columns], 1.0 / np.array(PERSONS)[monomials.degrees[columns]]
        uncertainty = np.linalg.inv(np.diag(precision) + phi.T @ phi / WITHIN).astype(np.float64)
        return cls(len(monomials), columns, uncertainty @ phi.T / WITHIN, uncertainty)

    def change(self, residuals: Floats) -> Floats:
        """Of the coefficients of m numbers (m, F), from what the model misses of the movements, (K, m)."""
        result = np.zeros((residuals.shape[1], self.features))
        result[:, self.columns] = (self.gain @ residuals).T
        return result

    def remaining(self, uncertainty: Floats) -> Floats:
        """Covariance of the person's coefficients in units of C, from that of the model (F, F)."""
        result = uncertainty.copy()
        result[np.ix_(self.columns, self.columns)] += self.uncertainty
        return result
