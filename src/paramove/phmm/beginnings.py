"""Distribution of movements that go on: where in the movement a beginning ends is unknown, as theta is.

For each of many fractions a regression knows how the beginnings of that fraction depend on theta. With the time that
has passed, the durations of the training leave some fractions possible. Theta of a beginning is averaged over these, by
how likely they are. Neighbouring points repeat each other, so all together count as a few independent ones only;
otherwise the average would follow one fraction at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import softmax

from paramove.documents import Floats, Ints
from paramove.hmm import interpolate, resample
from paramove.phmm.adaptation import Adaptation
from paramove.phmm.correlated_regression import CondensedRegressions, CorrelatedRegression
from paramove.phmm.estimates import Examination, ParameterEstimate
from paramove.phmm.features import Monomials
from paramove.phmm.noise import AddedNoise

FIRST_FRAMES = 5
FRACTIONS = tuple(np.linspace(0.1, 1.0, 20).tolist())
COMPARED = (5, 9, 14)
"""Numbers of the fractions by whose beginnings their description is chosen: about 0.3, 0.5 and 0.75."""
POINTS = 6
INDEPENDENT_NUMBERS = 4.0
"""As how many independent numbers a beginning counts where fractions are compared."""
SHRINKAGES = (0.02, 0.1, 0.3)
LEAST_DURATION_MARGIN = 0.005
"""A movement may be shorter or longer than those of the training by the deviation of their durations, and by this."""
WIDEST_MARGIN, PRIOR_WIDTH = 0.25, 1.5
"""Theta is searched this far outside the bounds of the training; its prior has a deviation of 1.5 times half their
distance."""


@dataclass(frozen=True)
class Beginnings:
    """Regressions of beginnings of movements.

    Attributes:
        regressions: of `points_of`, one for each of `FRACTIONS`.
        increments: whether a beginning is described by increments of its points or by the points themselves.
        log_durations: minimum and maximum of the training with a margin, logarithms of frames.
    """

    regressions: tuple[CorrelatedRegression, ...]
    increments: bool
    log_durations: tuple[float, float]

    @classmethod
    def fitted(
        cls, sequences: Sequence[Floats], theta: Floats, monomials: Monomials, groups: Ints, ridge: tuple[float, ...]
    ) -> Beginnings:
        """From movements as recorded, labels (K, P), groups (K,) and the regularisation of complete movements.

        Points or increments, whichever predict theta of left-out groups better: what shrinkage takes for chance
        depends on it. People begin where they are, and direct the increments; scripts and robots pass their points.
        Shrinkage is chosen where they are compared, and is the same for neighbours.
        """

        points = np.stack([_points_of_fractions(sequence) for sequence in sequences])

        def of(
            numbers: Sequence[int], increments: bool, shrinkages: tuple[float, ...]
        ) -> list[tuple[CorrelatedRegression, float]]:
            ys = [described(points[:, number], increments) for number in numbers]
            # The last point is the sum of all rows, or the last row.
            last: Floats = np.kron(np.ones(POINTS) if increments else np.eye(POINTS)[-1], np.eye(points.shape[3])).T
            return CorrelatedRegression.fitted_with_errors(ys, theta, monomials, groups, ridge, shrinkages, last)

        compared = {increments: of(COMPARED, increments, SHRINKAGES) for increments in (True, False)}
        error = {increments: sum(np.log(one) for _, one in results) for increments, results in compared.items()}
        increments = not error[False] < error[True]
        known = dict(zip(COMPARED, (one for one, _ in compared[increments]), strict=True))
        nearest = np.abs(np.subtract.outer(np.arange(len(FRACTIONS)), COMPARED)).argmin(axis=1)
        for position, number in enumerate(COMPARED):
            others = [one for one in np.flatnonzero(nearest == position).tolist() if one != number]
            fitted = of(others, increments, (known[number].shrinkage,))
            known |= dict(zip(others, (one for one, _ in fitted), strict=True))
        regressions = [known[number] for number in range(len(FRACTIONS))]
        lengths = np.log([len(sequence) for sequence in sequences])
        outside = LEAST_DURATION_MARGIN + float(lengths.std())
        return cls(tuple(regressions), increments, (float(lengths.min()) - outside, float(lengths.max()) + outside))

    def adapted(self, sequences: Sequence[Floats], theta: Floats, adaptation: Adaptation) -> Beginnings:
        """Of the person whose movements at theta (K, P) these are."""
        points = np.stack([_points_of_fractions(sequence) for sequence in sequences])
        ys = [described(points[:, number], self.increments) for number in range(len(FRACTIONS))]
        own = (one.adapted(y, theta, adaptation) for one, y in zip(self.regressions, ys, strict=True))
        return replace(self, regressions=tuple(own))

    def examined(self, sequence: Floats, margin: float, noise: AddedNoise | None = None) -> Examination:
        """A beginning (T, D), with noise beyond that of the training; `margin` as `CondensedRegressions.estimates`.

        Raises ValueError for a beginning of fewer than 5 frames.
        """
        check_beginning(len(sequence), FIRST_FRAMES)
        durations = np.log(len(sequence)) - np.log(FRACTIONS)
        shortest, longest = self.log_durations
        possible = np.flatnonzero((durations > shortest) & (durations < longest))
        if not len(possible):  # the next fraction: none is known exactly, or it lasts longer than all movements
            possible = np.array([max(0, int((durations >= shortest).sum()) - 1)])
            known = round(FRACTIONS[possible[0]] * np.exp(0.5 * (shortest + longest)))
            sequence = sequence[: max(FIRST_FRAMES, known)] if durations[-1] < longest else sequence
        chosen = slice(int(possible[0]), int(possible[-1]) + 1)
        regressions, condensed = self.regressions[chosen], self._condensed.part(chosen)
        if noise is not None:
            added = noise.of_averages(lambda frames: points_of(frames, self.increments))
            regressions = tuple(one.widened(added) for one in regressions)
            condensed = CondensedRegressions.of(regressions)
        y = points_of(sequence, self.increments)[None]
        theta, covariances, nearest = condensed.estimates(y, min(margin, WIDEST_MARGIN))
        distances = condensed.distances_from(y, nearest)
        prior = np.diag((PRIOR_WIDTH * condensed.monomials.scale) ** -2.0)
        covariances = np.linalg.inv(np.linalg.inv(covariances) + prior).astype(np.float64)
        theta -= ((theta - condensed.monomials.centre)[:, None] @ prior @ covariances)[:, 0]
        densities = condensed.log_norms - 0.5 * distances
        evidence = densities + 0.5 * np.linalg.slogdet(covariances)[1]
        weights = softmax(evidence * INDEPENDENT_NUMBERS / y.shape[1])
        mean = weights @ theta
        missed = theta - mean
        covariance = np.einsum("k,kpq->pq", weights, covariances) + (weights * missed.T) @ missed
        best = int(weights.argmax())
        density, own = float(densities[best]), regressions[best]
        outlier_score = float(np.sqrt(distances[best] / (np.median(own.distances) + 1e-9)))
        p_value = own.log_p_value(float(distances[best]))
        return Examination(ParameterEstimate(mean, covariance, density), outlier_score, density, p_value)

    @cached_property
    def _condensed(self) -> CondensedRegressions:
        return CondensedRegressions.of(self.regressions)

    def arrays(self) -> dict[str, Floats]:
        """Everything learned, for a file."""
        result = {"beginnings": np.array([float(self.increments), *self.log_durations])}
        for number, regression in enumerate(self.regressions):
            result |= {f"beginning{number}_{name}": value for name, value in regression.arrays().items()}
        return result

    @classmethod
    def from_arrays(cls, arrays: dict[str, Floats], monomials: Monomials) -> Beginnings:
        """From the result of `arrays`. Raises KeyError for a missing array, ValueError for shapes that do not fit."""
        regressions = tuple(
            CorrelatedRegression.from_arrays(arrays, f"beginning{number}_", monomials)
            for number in range(len(FRACTIONS))
        )
        scalars, lengths = arrays["beginnings"], {len(one.coefficients) for one in regressions}
        if scalars.shape != (3,) or len(lengths) != 1:
            raise ValueError(
                f"expected 3 numbers in beginnings and regressions of one length, found {scalars.shape} and {lengths}"
            )
        return cls(regressions, bool(scalars[0]), (float(scalars[1]), float(scalars[2])))


def check_beginning(n_frames: int, minimum: int) -> None:
    """Raises ValueError for a beginning of fewer frames than that."""
    if n_frames < minimum:
        raise ValueError(f"a beginning has at least {minimum} frames, found {n_frames}: wait for more of the movement")


def points_of(sequence: Floats, increments: bool) -> Floats:
    """Six points of a beginning at equal times, or the first and the increments between them. Shape (6 D,)."""
    result: Floats = described(resample(sequence, POINTS)[None], increments)[0]
    return result


def described(points: Floats, increments: bool) -> Floats:
    """Points (K, 6, D), or the first and the increments between them. Shape (K, 6 D)."""
    first = points[:, :1]
    chosen: Floats = np.concatenate([first, np.diff(points, axis=1)], axis=1) if increments else points
    return chosen.reshape(len(points), -1)


def _points_of_fractions(sequence: Floats) -> Floats:
    """Six points of the beginning of each of `FRACTIONS`, as `resample` of it. Shape (20, 6, D)."""
    last = np.maximum(FIRST_FRAMES, np.round(np.multiply(FRACTIONS, len(sequence)))) - 1.0
    positions = np.minimum(last, len(sequence) - 1)[:, None] * np.linspace(0.0, 1.0, POINTS)
    result: Floats = interpolate(sequence, positions.ravel()).reshape(*positions.shape, -1)
    return result
