"""What a parametric HMM learns about whole performances beside its states: how they vary, complete or just begun."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_ndtr

from paramove.hmm import resample
from paramove.hmm.estimation import Evaluator
from paramove.phmm.correlated_regression import CorrelatedRegression
from paramove.phmm.features import Monomials

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FIRST_FRAMES, GROWTH = 5, 1.25
"""Beginnings are modelled at 5 frames and then at every length a quarter longer."""
BEGINNING_POINTS = 5
MOVEMENT_PARTS = 10
BEGINNING_SHRINKAGES = (0.1, 0.3)
PACE_PARTS, PACE_SHRINKAGE, PACE_SHARE = 10, 0.1, 0.35


@dataclass(frozen=True)
class Pace:
    """How fast movements of one kind are in each tenth of their time: what a person who stops or returns gives away.

    Attributes:
        mean: of `pace_features`, shape (10,). root: triangular root of their covariance, shape (10, 10).
        distances: squared Mahalanobis distances of training movements, their group left out. Shape (K,).
    """

    mean: Floats
    root: Floats
    distances: Floats

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
        white = np.linalg.solve(root, deviations.T)
        return cls(features.mean(axis=0), root, (white**2).sum(axis=0))

    def distance(self, sequence: Floats) -> float:
        """Squared Mahalanobis distance."""
        white = np.linalg.solve(self.root, pace_features(sequence) - self.mean)
        return float(white @ white)


@dataclass(frozen=True)
class Performances:
    """Correlated regressions of complete movements (in parts) and of beginnings of n frames.

    Attributes:
        complete: of `part_averages`.
        beginnings: number of frames, increasing, with the regression of `beginning_features`.
        pace: of complete movements.
    """

    complete: CorrelatedRegression
    beginnings: tuple[tuple[int, CorrelatedRegression], ...]
    pace: Pace

    @classmethod
    def fitted(
        cls, parts: Floats, sequences: Sequence[Floats], theta: Floats, monomials: Monomials, groups: Ints
    ) -> Performances:
        """From `part_averages` (K, n) and the movements as they were recorded, in their own time."""
        complete = CorrelatedRegression.fitted(parts, theta, monomials, groups)
        lengths = np.array([len(sequence) for sequence in sequences])
        beginnings = []
        for n_frames in beginning_lengths(lengths):
            long = np.flatnonzero(lengths >= n_frames)
            y = np.stack([beginning_features(sequences[k], n_frames) for k in long.tolist()])
            beginnings.append(
                (n_frames, CorrelatedRegression.fitted(
                    y, theta[long], monomials, groups[long], complete.ridge, BEGINNING_SHRINKAGES
                ))
            )  # fmt: skip
        return cls(complete, tuple(beginnings), Pace.fitted(sequences, groups))

    def strangeness(self, distance: float, pace_distance: float) -> float:
        """How unlike the training a complete movement is; genuine ones have about 1.3.

        Args:
            distance: of its parts from the model at the best theta. pace_distance: of its pace.
        """
        return float(_strangeness(distance, pace_distance, self.complete.distances, self.pace.distances))

    def log_typicality(self, strangeness: float) -> float:
        """Logarithm of the probability that a genuine movement is so strange or stranger, from unseen training ones."""
        known = np.log(_strangeness(
            self.complete.distances, self.pace.distances, self.complete.distances, self.pace.distances
        ))  # fmt: skip
        deviation = max(float(known.std()), 1e-3) if len(known) > 1 else np.inf
        return float(log_ndtr(-(np.log(strangeness) - known.mean()) / deviation))

    def beginning(self, n_frames: int) -> tuple[int, CorrelatedRegression]:
        """The longest modelled beginning of at most so many frames. Raises ValueError where that is too short."""
        known = [one for one in self.beginnings if one[0] <= n_frames]
        if not known:
            raise ValueError(
                f"a beginning has at least {FIRST_FRAMES} frames, found {n_frames}: wait for more of the movement"
            )
        return known[-1]

    def arrays(self) -> dict[str, Floats]:
        """Everything learned, for a file."""
        result = {f"complete_{name}": value for name, value in self.complete.arrays().items()}
        result |= {"pace_mean": self.pace.mean, "pace_root": self.pace.root, "pace_distances": self.pace.distances}
        result["beginning_frames"] = np.array([float(n_frames) for n_frames, _ in self.beginnings])
        for number, (_, regression) in enumerate(self.beginnings):
            result |= {f"beginning{number}_{name}": value for name, value in regression.arrays().items()}
        return result

    @classmethod
    def from_arrays(cls, arrays: dict[str, Floats], monomials: Monomials) -> Performances:
        """From what `arrays` gave. Raises KeyError for a missing array and ValueError for shapes that do not fit."""
        complete = CorrelatedRegression.from_arrays(arrays, "complete_", monomials)
        beginnings = tuple(
            (int(n_frames), CorrelatedRegression.from_arrays(arrays, f"beginning{number}_", monomials))
            for number, n_frames in enumerate(arrays["beginning_frames"])
        )
        pace = Pace(arrays["pace_mean"], arrays["pace_root"], arrays["pace_distances"])
        expected = {"pace_mean": (PACE_PARTS,), "pace_root": (PACE_PARTS, PACE_PARTS)}
        expected["pace_distances"] = complete.distances.shape
        for name, shape in expected.items():
            if arrays[name].shape != shape:
                raise ValueError(f"expected {name} of shape {shape}, found {arrays[name].shape}")
        return cls(complete, beginnings, pace)


def _strangeness(distance: Any, pace_distance: Any, known: Floats, known_pace: Floats) -> Any:
    """Both distances in units of their medians. Roots, so that one outlier in pace does not outweigh all else."""
    usual = np.median(known) + 1e-9, np.median(known_pace) + 1e-9
    return np.sqrt(distance / usual[0]) + PACE_SHARE * np.sqrt(pace_distance / usual[1])


def pace_features(sequence: Floats) -> Floats:
    """Logarithm of the length of the way of all points in each tenth of the time, in the unit of the data. (10,)."""
    steps = np.diff(resample(sequence, PACE_PARTS + 1), axis=0)
    lengths = np.sqrt((steps**2).mean(axis=1))
    result: Floats = np.log(lengths + 0.02 * lengths.mean() + 1e-12)
    return result


def state_averages(evaluator: Evaluator, sequence: Floats) -> tuple[Floats, Floats]:
    """Mean of the frames in each state, by their responsibilities, (N, D), and how many frames those are, (N,)."""
    gamma = evaluator.expectation(sequence)[1]
    weights = gamma.sum(axis=0)
    return (gamma.T @ sequence) / weights[:, None], weights


def part_averages(averages: Floats, weights: Floats, sequence: Floats) -> Floats:
    """Mean of the frames in each of at most ten parts of the movement, each of several states, and the last frame.

    Correlations between many states would have to be learned from few movements, and they say the same many times. The
    last frame is there since movements end where theta says, more exactly than they get there. Shape (11 D,).
    """
    n_parts = min(MOVEMENT_PARTS, len(averages))
    begins = np.arange(n_parts) * len(averages) // n_parts
    sums = np.add.reduceat(averages * weights[:, None], begins, axis=0)
    parts = sums / np.add.reduceat(weights, begins)[:, None]
    return np.concatenate([parts, sequence[-1:]]).ravel()


def beginning_lengths(lengths: Ints) -> list[int]:
    """Numbers of frames at which beginnings are modelled: as long as half of the movements last so long."""
    result, n_frames = [], float(FIRST_FRAMES)
    while n_frames <= np.median(lengths):
        result.append(round(n_frames))
        n_frames *= GROWTH
    return sorted(set(result))


def beginning_features(sequence: ArrayLike, n_frames: int) -> Floats:
    """Where a movement begins and how it goes on: first frame and increments over its first frames. Shape (5 D,)."""
    points = resample(np.asarray(sequence, dtype=np.float64)[:n_frames], BEGINNING_POINTS)
    return np.concatenate([points[:1], np.diff(points, axis=0)]).ravel()


def groups_of(groups: ArrayLike | None, theta: Floats) -> Ints:
    """Number of the group of each movement: as given, else movements of the same theta are one. Shape (K,)."""
    if groups is None:
        spread = np.maximum(np.ptp(theta, axis=0), 1e-12)
        found = np.unique(np.round(theta / spread, 4), axis=0, return_inverse=True)[1]
    else:
        labels = np.asarray(groups)
        if labels.shape != (len(theta),):
            raise ValueError(f"groups has one label per sequence: expected shape ({len(theta)},), found {labels.shape}")
        found = np.unique(labels, return_inverse=True)[1]
    return np.asarray(found, dtype=np.int64).reshape(-1)
