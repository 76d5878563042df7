"""Distribution of whole executions, complete or just begun, that a parametric HMM learns besides its states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.hmm import resample
from paramove.phmm.adaptation import Adaptation
from paramove.phmm.beginnings import Beginnings
from paramove.phmm.correlated_regression import CorrelatedRegression
from paramove.phmm.features import Monomials
from paramove.phmm.noise import AddedNoise, distances_with_noise, moving_average
from paramove.phmm.predictive_distribution import PredictiveDistribution
from paramove.phmm.storage import check_shapes

PARTS, PART_FRAMES = 5, 20
"""A complete movement is described by the means of its fifths, of 20 interpolated frames each, and its last frame."""
OUTLIER_SHRINKAGE = 0.5
"""What estimates theta best may take nearly all correlations for chance; then movements of another kind pass."""
PACE_PARTS, PACE_SHRINKAGE, PACE_WEIGHT = 10, 0.1, 0.35


@dataclass(frozen=True)
class Pace:
    """Speed of movements of one kind in each tenth of their time: detects a person who stops or returns.

    Attributes:
        mean: of `pace_features`, shape (10,). root: triangular root of their covariance, shape (10, 10).
        distances: squared Mahalanobis distances of training movements, their group left out of the mean and they
            themselves of the covariance. Shape (K,).
        noise: variance of noise beyond that of the training that is expected of each coordinate of each frame.
    """

    mean: Floats
    root: Floats
    distances: Floats
    noise: float = 0.0

    @classmethod
    def fitted(cls, sequences: Sequence[Floats], groups: Ints) -> Pace:
        """From movements and the number of the group of each (K,)."""
        features = np.stack([pace_features(sequence) for sequence in sequences])
        deviations = features - features.mean(axis=0)
        for group in np.unique(groups) if len(np.unique(groups)) > 1 else ():
            own = groups == group
            deviations[own] = features[own] - features[~own].mean(axis=0)
        moments = deviations.T @ deviations / len(deviations) + 1e-4 * np.eye(PACE_PARTS)
        moments += PACE_SHRINKAGE * (np.diag(np.diagonal(moments)) - moments)
        root: Floats = np.linalg.cholesky(moments)
        within = (np.linalg.solve(root, deviations.T) ** 2).sum(axis=0)
        own = (1.0 - PACE_SHRINKAGE) / len(features) * within  # what the movement itself added to the covariance
        distances = (1.0 - 1.0 / len(features)) * within / np.maximum(1.0 - own, 0.1)
        return cls(features.mean(axis=0), root, distances)

    def expecting(self, noise: float, sequence: Floats) -> Pace:
        """The same for a sequence with noise of that variance on each coordinate of each frame."""
        observed, own = noisy_pace(sequence, noise), self.root @ self.root.T
        mean = np.maximum(self.mean, observed.minimum)
        # As for a genuine movement: rest is measured as well as the noise allows.
        squared = np.exp(2.0 * mean)
        errors = (squared * observed.of_steps + 0.5 * observed.of_steps**2) / (sequence.shape[1] * squared**2)
        distances = distances_with_noise(self.distances, own, own, np.diag(errors))
        return Pace(mean, np.linalg.cholesky(own + np.diag(errors)).astype(np.float64), distances, noise)

    def distance(self, sequence: Floats) -> float:
        """Squared Mahalanobis distance."""
        features = pace_features(sequence) if self.noise <= 0.0 else noisy_pace(sequence, self.noise).features
        white = np.linalg.solve(self.root, features - self.mean)
        return float(white @ white)


@dataclass(frozen=True)
class Performances:
    """Correlated regressions of complete movements (in parts) and of beginnings.

    Attributes:
        complete: of `movement_parts`, for outliers.
        estimating: the same, for theta.
        beginnings: of movements that go on.
        pace: of complete movements.
        noise: beyond that of the training that is expected of sequences.
    """

    complete: CorrelatedRegression
    beginnings: Beginnings
    pace: Pace
    estimating: CorrelatedRegression
    noise: AddedNoise | None = None

    @classmethod
    def fitted(cls, sequences: Sequence[Floats], theta: Floats, monomials: Monomials, groups: Ints) -> Performances:
        """From movements as recorded, in their own time."""
        parts = np.stack([movement_parts(sequence) for sequence in sequences])
        end = np.eye(parts.shape[1])[:, -sequences[0].shape[1] :]
        ((complete, _),) = CorrelatedRegression.fitted_with_errors(
            [parts], theta, monomials, groups, shrinkages=(OUTLIER_SHRINKAGE,)
        )
        ((estimating, _),) = CorrelatedRegression.fitted_with_errors(
            [parts], theta, monomials, groups, complete.ridge, end=end
        )
        beginnings = Beginnings.fitted(sequences, theta, monomials, groups, complete.ridge)
        return cls(complete, beginnings, Pace.fitted(sequences, groups), estimating)

    def adapted(self, sequences: Sequence[Floats], theta: Floats, adaptation: Adaptation) -> Performances:
        """Of the person whose movements at theta (K, P) these are."""
        parts = np.stack([movement_parts(sequence) for sequence in sequences])
        return replace(
            self,
            complete=self.complete.adapted(parts, theta, adaptation),
            estimating=self.estimating.adapted(parts, theta, adaptation),
            beginnings=self.beginnings.adapted(sequences, theta, adaptation),
        )

    def expecting(self, noise: AddedNoise) -> Performances:
        """The same for a sequence with noise."""
        of_parts = noise.of_averages(movement_parts)
        pace = self.pace.expecting(noise.variance, noise.sequence)
        complete, estimating = self.complete.widened(of_parts), self.estimating.widened(of_parts)
        return replace(self, complete=complete, pace=pace, estimating=estimating, noise=noise)

    def outlier_score(self, distance: float, pace_distance: float) -> float:
        """Distance of a complete movement from the training; about 1.3 for genuine ones.

        Args:
            distance: of its parts from the model at the best theta. pace_distance: of its pace.
        """
        return float(_outlier_score(distance, pace_distance, self.complete.distances, self.pace.distances))

    def log_p_value(self, outlier_score: float) -> float:
        """Logarithm of the p-value: the probability that a genuine movement has at least this outlier score.

        NaN, unknown, for a single training movement. The logarithms of the scores of left-out training movements are
        assumed normally distributed, with a different mean in each group.
        """
        return self._usual.log_above(float(np.log(outlier_score + 1e-9)))

    @cached_property
    def _usual(self) -> PredictiveDistribution:
        """Of the logarithm of the outlier score of a genuine movement."""
        distances, paces = self.complete.distances, self.pace.distances
        known = np.log(_outlier_score(distances, paces, distances, paces) + 1e-9)
        return PredictiveDistribution.of(known, self.complete.groups)

    def arrays(self) -> dict[str, Floats]:
        """Everything learned, for a file."""
        result = {f"complete_{name}": value for name, value in self.complete.arrays().items()}
        result |= {f"estimating_{name}": value for name, value in self.estimating.arrays().items()}
        result |= {"pace_mean": self.pace.mean, "pace_root": self.pace.root, "pace_distances": self.pace.distances}
        return result | self.beginnings.arrays()

    @classmethod
    def from_arrays(cls, arrays: dict[str, Floats], monomials: Monomials) -> Performances:
        """From the result of `arrays`. Raises KeyError for a missing array, ValueError for shapes that do not fit."""
        complete = CorrelatedRegression.from_arrays(arrays, "complete_", monomials)
        estimating = CorrelatedRegression.from_arrays(arrays, "estimating_", monomials)
        beginnings = Beginnings.from_arrays(arrays, monomials)
        pace = Pace(arrays["pace_mean"], arrays["pace_root"], arrays["pace_distances"])
        expected = {"pace_mean": (PACE_PARTS,), "pace_root": (PACE_PARTS, PACE_PARTS)}
        expected |= {"pace_distances": complete.distances.shape, "estimating_root": complete.root.shape}
        check_shapes(arrays, expected)
        return cls(complete, beginnings, pace, estimating)


def _outlier_score(distance: Any, pace_distance: Any, known: Floats, known_pace: Floats) -> Any:
    """Both distances in units of their medians. Roots, so that an outlier in pace does not dominate."""
    usual = np.median(known) + 1e-9, np.median(known_pace) + 1e-9
    return np.sqrt(distance / usual[0]) + PACE_WEIGHT * np.sqrt(pace_distance / usual[1])


def pace_features(sequence: Floats) -> Floats:
    """Logarithm of the path length of all points in each tenth of the time, in the unit of the data. (10,)."""
    steps = np.diff(resample(sequence, PACE_PARTS + 1), axis=0)
    lengths = np.sqrt((steps**2).mean(axis=1))
    result: Floats = np.log(lengths + 0.02 * lengths.mean() + 1e-12)
    return result


class NoisyPace(NamedTuple):
    """`pace_features` of a sequence without its noise, their minimum under the noise, and the noise of its steps."""

    features: Floats
    minimum: Floats
    of_steps: Floats


def noisy_pace(sequence: Floats, noise: float) -> NoisyPace:
    """Of a sequence with noise of that variance. Each of shape (10,).

    Steps are those between averages of as many frames as the noise requires. The mean contribution of the noise to the
    square of a step is subtracted; the result is at least the standard deviation of that contribution.
    """
    for width in (1, len(sequence) // (2 * PACE_PARTS), len(sequence) // PACE_PARTS):
        averages, counts = moving_average(sequence, width)
        of_points = noise / resample(counts[:, None], PACE_PARTS + 1)[:, 0]
        of_steps = of_points[:-1] + of_points[1:]
        squared = (np.diff(resample(averages, PACE_PARTS + 1), axis=0) ** 2).mean(axis=1)
        if of_steps.mean() < 0.1 * squared.mean():
            break
    minimum = of_steps * np.sqrt(2.0 / sequence.shape[1])
    without = np.maximum(squared - of_steps, minimum)
    small = 0.02 * np.sqrt(without).mean() + 1e-12
    return NoisyPace(np.log(np.sqrt(without) + small), np.log(np.sqrt(minimum) + small), of_steps)


def state_averages(gamma: Floats, sequence: Floats) -> Floats:
    """Mean of the frames in each state by responsibilities (N, T). Shape (N, D)."""
    result: Floats = (gamma @ sequence) / gamma.sum(axis=1)[:, None]
    return result


def movement_parts(sequence: Floats) -> Floats:
    """Means of the fifths of a movement (T, D) and its last frame. Shape (6 D,).

    Correlations between more parts would have to be learned from few movements and are redundant. The last frame is
    included since theta determines the end of a movement more exactly than its course. Parts of equal time need no
    alignment by a model, which for movements that vary little would be decided by noise.
    """
    means = part_means(sequence, PARTS, PART_FRAMES)
    return np.concatenate([means, sequence[-1:]]).ravel()


def part_means(sequence: Floats, n_parts: int, n_frames: int) -> Floats:
    """Means of parts of equal time, of so many interpolated frames each. Shape (n_parts, D)."""
    frames = resample(sequence, n_parts * n_frames)
    result: Floats = frames.reshape(n_parts, n_frames, -1).mean(axis=1)
    return result


def groups_of(groups: ArrayLike | None, theta: Floats) -> Ints:
    """Number of the group of each movement: as given, else movements of the same theta form one. Shape (K,)."""
    if groups is None:
        ranges = np.maximum(np.ptp(theta, axis=0), 1e-12)
        numbers = np.unique(np.round(theta / ranges, 4), axis=0, return_inverse=True)[1]
    else:
        labels = np.asarray(groups)
        if labels.shape != (len(theta),):
            raise ValueError(f"groups has one label per sequence: expected shape ({len(theta)},), found {labels.shape}")
        numbers = np.unique(labels, return_inverse=True)[1]
    return np.asarray(numbers, dtype=np.int64).reshape(-1)
