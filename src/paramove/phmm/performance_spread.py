"""How far whole performances lie from a model's means: what makes the uncertainty of theta honest.

The likelihood of an HMM takes frames for independent, so its curvature promises far too much. A maximum of it moves by
H^-1 G' r if the averages of the states move by r, with G the weight that the likelihood gives to each average and H the
information of the means. With C, the covariance of r over performances, cov(theta) = H^-1 G' C G H^-1 (a "sandwich").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm import Parameters
from paramove.phmm.left_out import inflation_of

SHRINKAGE = 0.05
"""Share of each variance that is taken for independent."""
MAX_ROWS = 150
"""Directions of variation that are kept in full; the rest is taken for independent."""


@dataclass(frozen=True)
class Sensitivity:
    """How the most likely theta follows from the averages of the states, at one place.

    Attributes:
        weights: G, weight of each average, shape (N D, P).
        information: H, shape (P, P).
    """

    weights: Floats
    information: Floats

    @classmethod
    def of(cls, parameters: Parameters, slopes: Floats, frames: float) -> Sensitivity:
        """Of a model with these slopes of the means (N, D, P) and a sequence of so many frames."""
        expected = parameters.durations @ np.arange(1.0, parameters.durations.shape[1] + 1.0)
        share = expected * frames / expected.sum()
        weighed = share[:, None, None] * np.linalg.solve(parameters.covariances, slopes)
        information = np.einsum("ndp,ndq->pq", slopes, weighed)
        return cls(weighed.reshape(-1, slopes.shape[-1]), 0.5 * (information + information.T))

    @property
    def gain(self) -> Floats:
        """H^-1 G': what the averages move theta by, shape (P, N D)."""
        dimension = len(self.information)
        ridge = 1e-9 * np.trace(self.information) / dimension + 1e-300
        result: Floats = np.linalg.solve(self.information + ridge * np.eye(dimension), self.weights.T)
        return result


@dataclass(frozen=True)
class PerformanceSpread:
    """C = factor' factor + diag(own), the covariance of the averages of all states.

    Attributes:
        factor: shape (R, N D), in the unit of the sequences. own: variances, shape (N D,).
        inflation: factor on covariances of theta that makes regions hold what they promise on left-out performances.
    """

    factor: Floats
    own: Floats
    inflation: float

    @classmethod
    def fitted(cls, residuals: Floats, sensitivities: Sequence[Sensitivity], n_groups: int) -> PerformanceSpread:
        """From residuals of performances that the means have not seen (K, N D), and the sensitivity at each label.

        `n_groups` is the number of different theta: what means miss at one, all its performances have in common.
        """
        count = len(residuals)
        moves = np.stack([one.gain @ residual for one, residual in zip(sensitivities, residuals, strict=True)])
        everything = cls._of(residuals)
        excess = np.empty(count)
        for k, sensitivity in enumerate(sensitivities):
            gain = sensitivity.gain
            without = everything._projected(gain)
            if count > 1:  # the tested performance must not widen its own region
                own = gain @ residuals[k]
                without = (without - (1.0 - SHRINKAGE) * np.outer(own, own) / count) * count / (count - 1.0)
            excess[k] = moves[k] @ np.linalg.solve(without + 1e-12 * np.trace(without) * np.eye(len(gain)), moves[k])
        return cls(everything.factor, everything.own, inflation_of(excess, moves.shape[1], n_groups, minimum=1.0))

    @classmethod
    def _of(cls, residuals: Floats) -> PerformanceSpread:
        factor = residuals * np.sqrt((1.0 - SHRINKAGE) / len(residuals))
        own = SHRINKAGE * (residuals**2).mean(axis=0) + 1e-300
        if len(factor) > MAX_ROWS:
            _, values, directions = np.linalg.svd(factor, full_matrices=False)
            kept = values[:MAX_ROWS, None] * directions[:MAX_ROWS]
            own = own + (factor**2).sum(axis=0) - (kept**2).sum(axis=0)
            factor = kept
        return cls(factor, own, 1.0)

    def covariance(self, sensitivity: Sensitivity, widest: float, missed: Floats | None = None) -> Floats:
        """Of the most likely theta, in the coordinates of the sensitivity; no deviation above `widest`. (P, P).

        `missed` is a further covariance of theta, such as that of what the means are known not to follow.
        """
        spread = self.inflation * self._projected(sensitivity.gain)
        spread = spread if missed is None else spread + missed
        values, vectors = np.linalg.eigh(0.5 * (spread + spread.T))
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
    def from_arrays(cls, arrays: dict[str, Floats], size: int) -> PerformanceSpread:
        """From what `arrays` gave, for N D = size. Raises ValueError for shapes or values that do not fit."""
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
    """Residuals (K, n) from the mean of each group as they would be without the performance itself."""
    result = residuals.copy()
    for group in np.unique(groups):
        members = np.flatnonzero(groups == group)
        if len(members) > 1:
            result[members] *= len(members) / (len(members) - 1.0)
    return result
