"""What models say about a movement: theta with its uncertainty, and how usual the movement is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from paramove.documents import Floats, renamed_attribute


class ParameterEstimate(NamedTuple):
    """Theta (P,), its covariance (P, P) and the log-likelihood there; with independent residuals the largest one."""

    theta: Floats
    covariance: Floats
    log_likelihood: float


class Examination(NamedTuple):
    """A sequence examined by one model.

    Attributes:
        estimate: of theta.
        outlier_score: distance from the training movements, see `Performances.outlier_score`; of a beginning the
            root of its distance in units of the median one.
        log_density: of `movement_parts`, or of the points of a beginning.
        log_p_value: logarithm of `p_value`; NaN, unknown, if there were too few training movements.
    """

    estimate: ParameterEstimate
    outlier_score: float
    log_density: float
    log_p_value: float

    @property
    def p_value(self) -> float:
        """Probability that a genuine movement has at least this outlier score; a small one is a reason to reject.

        NaN, unknown, if there were too few training movements.
        """
        return float(np.exp(self.log_p_value))


for _old, _new in (("strangeness", "outlier_score"), ("typicality", "p_value"), ("log_typicality", "log_p_value")):
    setattr(Examination, _old, renamed_attribute(_old, _new))
