"""Predictive distribution of a value of a new person's movement, learned from few persons: it gives p-values.

Movements of one person are similar, so a hundred movements of nine persons carry hardly more information about a tenth
person than nine numbers do. A value of a new person's movement has the variance between persons and that within
them, and its mean is estimated from few: it follows Student's t. A normal distribution would reject several times as
many genuine movements as its nominal level.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln, stdtr  # scipy.stats would take half a second to import

from paramove.documents import Floats, Ints

MIN_DEVIATION = 1e-3


@dataclass(frozen=True)
class PredictiveDistribution:
    """Student's t distribution of a value of a movement of a new group.

    Attributes:
        mean: of the values. deviation: its scale; infinite for too few values.
        freedom: degrees of freedom; about the number of groups minus one if groups differ, the number of values minus
            one if they do not.
    """

    mean: float
    deviation: float
    freedom: float

    @classmethod
    def of(cls, values: Floats, groups: Ints) -> PredictiveDistribution:
        """From values (K,) and the number of the group of each (K,).

        The means of G groups vary by a = s_between^2, their values within by s_within^2. A value of a new group then
        varies by V = a (1 + 1/G) + s_within^2 (1 - mean of 1/n_g), with the degrees of freedom of Satterthwaite. Values
        of a single group describe only that group.
        """
        if len(values) < 2:
            return cls(0.0, np.inf, 1.0)
        numbers = np.unique(groups, return_inverse=True)[1].reshape(-1)
        if numbers.max() == 0:
            numbers = np.arange(len(values))
        sizes = np.bincount(numbers)
        count, means = len(sizes), np.bincount(numbers, values) / sizes
        between = float(means.var(ddof=1)) * (1.0 + 1.0 / count)
        free_within = max(1, len(values) - count)
        within = float(((values - means[numbers]) ** 2).sum()) / free_within * (1.0 - float((1.0 / sizes).mean()))
        variance = max(between + within, MIN_DEVIATION**2)
        uncertainty = between**2 / (count - 1) + within**2 / free_within
        freedom = variance**2 / uncertainty if uncertainty > 0.0 else len(values) - 1.0
        return cls(float(means.mean()), float(np.sqrt(variance)), min(freedom, len(values) - 1.0))

    def log_above(self, value: float) -> float:
        """Logarithm of the probability of a larger value, finite; NaN, unknown, for too few values."""
        if not np.isfinite(self.deviation):
            return float("nan")
        return log_upper_tail((value - self.mean) / self.deviation, self.freedom)


def log_upper_tail(t: float, freedom: float) -> float:
    """Logarithm of the probability that Student's t exceeds t, finite wherever t is."""
    probability = float(stdtr(freedom, -t))
    if probability > 1e-290:
        return float(np.log(probability))
    # (t^2 + n) / (n t) times the density: exact for large t, whatever n is.
    far = float(np.log1p(t**2 / freedom))
    density = gammaln(0.5 * freedom + 0.5) - gammaln(0.5 * freedom) - 0.5 * np.log(np.pi * freedom)
    return float(density - 0.5 * (freedom - 1.0) * far - np.log(t))
