"""Regression of theta on where a movement has come, beside the model that is inverted: both together are nearer.

A model predicts movements, and the theta that explains a movement best depends on all that was learned of how movements
vary, of which few persons show little. The inverse regression predicts theta from the last position of body points:
less must be learned, and where a hand ends at its target no more is needed. Neither is best for all data, so they are
stacked: the weights, none negative and their sum 1, are those with the smallest errors of left-out movements (Breiman,
Stacked regressions, 1996).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from scipy.optimize import nnls

from paramove.documents import Floats, Ints
from paramove.phmm.adaptation import WITHIN, Adaptation
from paramove.phmm.left_out import LeftOut

RIDGE = 1e-3
"""Of the standardised coordinates of a point, as a fraction of the number of movements."""
LEAST_DEVIATION = 1e-6
"""Of errors of theta, in units of its range, as of a component that never varies."""
SUM_WEIGHT = 1e3
"""Of the condition that the weights have the sum 1, in their least squares."""


@dataclass(frozen=True)
class InverseRegression:
    """theta = G y + b, and its weight beside the theta of the model.

    Attributes:
        gains: G, shape (P, n), of movements y as in `CorrelatedRegression`.
        offset: b, shape (P,).
        covariance: of the errors of left-out movements, shape (P, P).
        weight: 0 to 1; of regressions `together` one for each.
    """

    gains: Floats
    offset: Floats
    covariance: Floats
    weight: float | Floats

    @classmethod
    def stacked(
        cls, y: Floats, end: Floats, theta: Floats, ways: Sequence[tuple[Sequence[Ints], LeftOut]]
    ) -> tuple[Self, list[LeftOut]]:
        """Of movements (K, n), whose last frames are y @ end (K, D), at theta (K, P).

        Args:
            y, end, theta: as above.
            ways: to leave movements out: those of each fold, and what the model finds for them. The first decides.

        Returns the regression and, for each way, what both find together, with weights that their fold had no part in.
        """
        frames = y @ end
        size = 3 if frames.shape[1] % 3 == 0 else frames.shape[1]
        centre, deviation = frames.mean(axis=0), np.maximum(frames.std(axis=0), 1e-9)
        rows = np.swapaxes(((frames - centre) / deviation).reshape(len(y), -1, size), 0, 1)
        rows = np.concatenate([np.ones((*rows.shape[:2], 1)), rows], axis=2)
        missed = [np.concatenate([found.missed[None], _missed(rows, theta, folds)]) for folds, found in ways]
        known, caution = np.isfinite(ways[0][1].distances), 1.0 / len(ways[0][0])
        widths = np.ptp(theta, axis=0)
        varying = missed[0][..., widths > 0.0]  # a component that never varies is known exactly by its mean alone
        weights = _stacking_weights(varying[:, known], caution)
        shares = weights[1:] / max(weights[1:].sum(), 1e-12)
        spread = np.tensordot(shares, missed[0][1:, known], axes=1)
        covariance = spread.T @ spread / len(spread)
        least = (LEAST_DEVIATION * np.where(widths > 0.0, widths, 1.0)) ** 2
        covariance += np.diag(np.diagonal(covariance) / len(spread) + least)
        learned = (shares[:, None, None] * _coefficients(rows, theta)).astype(np.float64)
        of_frame = (learned[:, 1:].reshape(len(deviation), -1) / deviation[:, None]).T
        offset = learned[:, 0].sum(axis=0) - of_frame @ centre
        result, together = cls(of_frame @ end.T, offset, covariance, 1.0 - weights[0]), []
        for (folds, found), errors in zip(ways, missed, strict=True):
            both = np.full(theta.shape, np.nan)
            for tested in folds:
                others = np.setdiff1d(np.flatnonzero(known), tested)
                own = _stacking_weights(varying[:, others], caution) if len(others) else weights
                both[tested] = np.tensordot(own, errors[:, tested], axes=1)
            together.append(LeftOut(both, result._covariances(found.covariances), found.distances))
        return result, together

    def combined(self, y: Floats, theta: Floats, covariances: Floats) -> tuple[Floats, Floats]:
        """Of movements (K, n) theta (K, P) and covariances (K, P, P), from those of the model.

        One regression of all movements or one for each, as `together` makes it.
        """
        weight = np.asarray(self.weight)[..., None]
        both = (1.0 - weight) * theta + weight * ((self.gains @ y[..., None])[..., 0] + self.offset)
        return both, self._covariances(covariances)

    def _covariances(self, model: Floats) -> Floats:
        """As if errors of both were independent, which the inflation of regions corrects; from those of the model."""
        weight = np.asarray(self.weight)[..., None, None]
        return np.asarray((1.0 - weight) ** 2 * model + weight**2 * self.covariance)

    @classmethod
    def together(cls, regressions: Sequence[InverseRegression | None]) -> InverseRegression | None:
        """Many, with one more dimension in front; None if one is missing."""
        known = [one for one in regressions if one is not None]
        if len(known) < len(regressions):
            return None
        return cls(*(np.stack([getattr(one, field.name) for one in known]) for field in fields(cls)))

    def part(self, chosen: slice) -> InverseRegression:
        """Some of those `together`."""
        return InverseRegression(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def array(self) -> Floats:
        """Everything learned, for a file. Shape (P, n + 2 + P)."""
        return np.column_stack([self.gains, self.offset, self.covariance, np.full(len(self.offset), self.weight)])

    @classmethod
    def from_array(cls, array: Floats, n: int, dimension: int) -> Self:
        """From the result of `array`, of movements of n numbers, theta of P. Raises ValueError if it is none."""
        if array.shape != (dimension, n + 2 + dimension) or not 0.0 <= array[0, -1] <= 1.0:
            raise ValueError(
                f"expected an inverse of shape ({dimension}, {n + 2 + dimension}) with a weight of 0 to 1 at its end, "
                f"found {array.shape} and {array.ravel()[-1:]}"
            )
        gains, offset, covariance, weight = np.split(array, [n, n + 1, n + 1 + dimension], axis=1)
        return cls(np.ascontiguousarray(gains), offset[:, 0], covariance, float(weight[0, 0]))

    def adapted(self, y: Floats, theta: Floats, adaptation: Adaptation) -> InverseRegression:
        """Of the person whose movements (K, n) at theta (K, P) these are."""
        offset = self.offset + adaptation.change(theta - y @ self.gains.T - self.offset)[:, 0]
        return replace(self, offset=offset, covariance=(WITHIN + adaptation.uncertainty[0, 0]) * self.covariance)

    def widened(self, covariance: Floats) -> InverseRegression:
        """With noise of that covariance (n, n) in every movement, which lessens the weight."""
        noisy = self.covariance + self.gains @ covariance @ self.gains.T
        lessened = self.weight * np.trace(self.covariance) / max(float(np.trace(noisy)), 1e-300)
        return replace(self, covariance=noisy, weight=lessened)


def _coefficients(rows: Floats, theta: Floats) -> Floats:
    """Of theta (K, P) on the rows of each point (B, K, F), the first of them 1. Shape (B, F, P)."""
    penalty = np.diag([1e-9, *[RIDGE * len(theta)] * (rows.shape[2] - 1)])
    squares, products = np.swapaxes(rows, 1, 2) @ rows, np.swapaxes(rows, 1, 2) @ theta
    return np.asarray(np.linalg.solve(squares + penalty, products), dtype=np.float64)


def _missed(rows: Floats, theta: Floats, folds: Sequence[Ints]) -> Floats:
    """Errors of theta of movements that were left out, by each point; NaN of those in no fold. Shape (B, K, P)."""
    result = np.full((len(rows), *theta.shape), np.nan)
    for tested in folds:
        others = np.delete(np.arange(len(theta)), tested)
        result[:, tested] = rows[:, tested] @ _coefficients(rows[:, others], theta[others]) - theta[tested]
    return result


def _stacking_weights(missed: Floats, caution: float) -> Floats:
    """Weights with the smallest mean square of their weighted errors (B, K, P); `caution` makes them more equal.

    Each component of theta counts in units of its smallest error: what nobody can know would decide otherwise.
    """
    sizes = np.sqrt((missed**2).mean(axis=1))
    errors = (missed / (sizes.min(axis=0) + 1e-6 * sizes.max(axis=0) + 1e-300)).reshape(len(missed), -1)
    moments = errors @ errors.T
    moments += np.diag(caution * np.diagonal(moments) + 1e-12 * np.trace(moments) + 1e-300)
    root = np.linalg.cholesky(moments / np.trace(moments)).T
    sums = SUM_WEIGHT * np.ones((1, len(moments)))
    weights = nnls(np.concatenate([root, sums]), np.append(np.zeros(len(moments)), SUM_WEIGHT))[0]
    return np.asarray(weights / weights.sum(), dtype=np.float64)
