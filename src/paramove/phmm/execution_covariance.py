"""Covariance of whole executions about a model's means, for a realistic uncertainty of theta.

The likelihood of an HMM assumes independent frames, so its curvature is far too large. Its maximum moves by
H^-1 G' r if the averages of the states move by r, with G the weight that the likelihood gives to each average and H the
information of the means. With C, the covariance of r over executions, cov(theta) = H^-1 G' C G H^-1 (a "sandwich").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm import Parameters
from paramove.phmm.left_out import inflation_of

SHRINKAGE = 0.05
"""Fraction of each variance that counts as independent."""
MAX_ROWS = 150
"""Directions of variation that are represented exactly; the rest counts as independent."""


@dataclass(frozen=True)
class Sensitivity:
    """How the most likely theta follows from the averages of the states, at one theta.

    Attributes:
        weights: G, weight of each average, shape (N D, P).
        information: H, shape (P, P).
    """

    weights: Floats
    information: Floats

    @classmethod
    def of(cls, parameters: Parameters, slopes: Floats, frames: float) -> Sensitivity:
        """Of a model with these slopes of the means (N, D, P) and a sequence of this many frames."""
        expected = parameters.durations @ np.arange(1.0, parameters.durations.shape[1] + 1.0)
        dwell = expected * frames / expected.sum()
        weighed = dwell[:, None, None] * np.linalg.solve(parameters.covariances, slopes)
        information = np.einsum("ndp,ndq->pq", slopes, weighed)
        return cls(weighed.reshape(-1, slopes.shape[-1]), 0.5 * (information + information.T))

    @property
    def gain(self) -> Floats:
        """H^-1 G': change of theta with the averages, shape (P, N D)."""
        dimension = len(self.information)
        ridge = 1e-9 * np.trace(self.information) / dimension + 1e-300
        result: Floats = np.linalg.solve(self.information + ridge * np.eye(dimension), self.weights.T)
        return result


@dataclass(frozen=True)
class ExecutionCovariance:
    """C = factor' factor + diag(own), the covariance of the averages of all states.

    Attributes:
        factor: shape (R, N D), in the unit of the sequences. own: variances, shape (N D,).
        inflation: factor on covariances of theta that gives regions their nominal coverage for left-out executions.
    """

    factor: Floats
    own: Floats
    inflation: float

    @classmethod
    def fitted(cls, residuals: Floats, sensitivities: Sequence[Sensitivity], n_groups: int) -> ExecutionCovariance:
        """From residuals of left-out executions (K, N D), and the sensitivity at each label.

        `n_groups` is the number of different theta: errors of the means at one are common to all its executions.
        """
        count = len(residuals)
        moves = np.stack([one.gain @ residual for one, residual in zip(sensitivities, residuals, strict=True)])
        everything = cls._of(residuals)
        excess = np.empty(count)
        for k, sensitivity in enumerate(sensitivities):
            gain = sensitivity.gain
            without = everything._projected(gain)
            if count > 1:  # the tested execution must not widen its own region
                own = gain @ residuals[k]
                without = (without - (1.0 - SHRINKAGE) * np.outer(own, own) / count) * count / (count - 1.0)
            excess[k] = moves[k] @ np.linalg.solve(without + 1e-12 * np.trace(without) * np.eye(len(gain)), moves[k])
        # The means have seen the tested executions, so the 95 % quantile decides.
        inflation = inflation_of([excess], moves.shape[1], n_groups, quantile_weight=1.0, minimum=1.0)
        return cls(everything.factor, everything.own, inflation)

    @classmethod
    def _of(cls, residuals: Floats) -> ExecutionCovariance:
        factor = residuals * np.sqrt((1.0 - SHRINKAGE) / len(residuals))
        own = SHRINKAGE * (residuals**2).mean(axis=0) + 1e-300
        if len(factor) > MAX_ROWS:
            _, values, directions = np.linalg.svd(factor, full_matrices=False)
            largest = values[:MAX_ROWS, None] * directions[:MAX_ROWS]
            own = own + (factor**2).sum(axis=0) - (largest**2).sum(axis=0)
            factor = largest
        return cls(factor, own, 1.0)

    def covariance(self, sensitivity: Sensitivity, widest: float, missed: Floats | None = None) -> Floats:
        """Of the most likely theta, in the coordinates of the sensitivity; no deviation above `widest`. (P, P).

        `missed` is a further covariance of theta, such as that of known errors of the means.
        """
        covariance = self.inflation * self._projected(sensitivity.gain)
        covariance = covariance if missed is None else covariance + missed
        values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
        values = 1.0 / (1.0 / np.maximum(values, 1e-300) + 1.0 / widest**2)
        result: Floats = (vectors * values) @ vectors.T
        return result

    def _projected(self, gain: Floats) -> Floats:
        moved = self.factor @ gain.T
        result: Floats = moved.T @ moved + (gain * self.own) @ gain.T
        return result

    def arrays(self) -> dict[str, Floats]:
        """Everything learned, for a file."""
        return {
            "spread_factor": self.factor,
            "spread_own": self.own,
            "spread_inflation": np.array([self.inflation]),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, Floats], size: int) -> ExecutionCovariance:
        """From the result of `arrays`, for N D = size. Raises ValueError for shapes or values that do not fit."""
        factor, own, inflation = arrays["spread_factor"], arrays["spread_own"], arrays["spread_inflation"]
        if factor.ndim != 2 or factor.shape[1] != size or own.shape != (size,) or inflation.shape != (1,):
            raise ValueError(
                f"expected spread_factor of shape (R, {size}), spread_own of shape ({size},) and one spread_inflation, "
                f"found {factor.shape}, {own.shape} and {inflation.shape}"
            )
        if (own < 0).any() or not inflation[0] > 0:
            raise ValueError("expected variances in spread_own that are not negative and a spread_inflation above 0")
        return cls(factor, own, float(inflation[0]))


def left_out_of_groups(residuals: Floats, groups: Ints) -> Floats:
    """Residuals (K, n) from the mean of each group as they would be without the execution itself."""
    result = residuals.copy()
    for group in np.unique(groups):
        members = np.flatnonzero(groups == group)
        if len(members) > 1:
            result[members] *= len(members) / (len(members) - 1.0)
    return result
