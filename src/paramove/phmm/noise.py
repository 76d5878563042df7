"""Independent noise on every frame of a movement, beyond the noise of the training movements.

Directions in which bodies hardly vary, such as the lengths of bones, get great weight in a model, and a noisy sensor
adds errors there (thesis 4.2.5). The noise is estimated from the sequence itself: movements are smooth, so
their third differences over neighbouring frames are those of the noise, which have 20 times its variance. Noise that
is clearly above that of the training is then expected of this sequence: it is added to state covariances, and its part
in averages to their covariances. For a sequence without such noise nothing changes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats
from paramove.hmm import compiled_sums, resample

MEDIAN_OF_SQUARES = 0.4549364
"""Of a standard normal variable; a median since reversals, impacts and gaps cause a few large differences."""
MIN_DIFFERENCES = 20
CLEARLY = 9.0
"""Noise counts if its variance is more than this many times the largest of the training: three times the deviation.
Below that it hardly matters, and movements sampled at an eighth of the rate stay below."""


def noise_variance(sequence: Floats) -> float:
    """Variance of white noise on each coordinate of (T, D), pooled over all; zero if the sequence is too short."""
    differences = np.diff(sequence, n=3, axis=0)
    if differences.size < MIN_DIFFERENCES:
        return 0.0
    return float(np.median(differences**2)) / MEDIAN_OF_SQUARES / 20.0


@compiled_sums
def _mean_squared_difference(sequence: Floats) -> float:
    """Mean square of the third differences of (T, D), T above 3."""
    total = 0.0
    for t in range(len(sequence) - 3):
        first, second, third, fourth = sequence[t], sequence[t + 1], sequence[t + 2], sequence[t + 3]
        for k in range(len(first)):
            difference = (fourth[k] - first[k]) - 3.0 * (third[k] - second[k])
            total += difference * difference
    return float(total / ((len(sequence) - 3) * sequence.shape[1]))


@dataclass(frozen=True)
class NoiseLevel:
    """Noise of training movements.

    Attributes:
        usual: median of their `noise_variance`. maximum: of them.
    """

    usual: float
    maximum: float

    @classmethod
    def of(cls, sequences: Sequence[Floats]) -> NoiseLevel:
        """Of movements as they were recorded, not resampled."""
        variances = [noise_variance(sequence) for sequence in sequences]
        return cls(float(np.median(variances)), max(variances))

    def added(self, recorded: Floats, n_frames: int | None = None) -> AddedNoise | None:
        """Additional noise of a recorded sequence (T, D); None if not significant. `n_frames`: see `AddedNoise`."""
        # A median is at most twice the mean, which takes a tenth of the time.
        if len(recorded) < 4 or _mean_squared_difference(recorded) <= 10.0 * MEDIAN_OF_SQUARES * CLEARLY * self.maximum:
            return None
        variance = noise_variance(recorded)
        if variance <= CLEARLY * self.maximum:
            return None
        return AddedNoise(variance - self.usual, recorded, n_frames)


@dataclass(frozen=True)
class AddedNoise:
    """White noise of one sequence.

    Attributes:
        variance: of each coordinate of each recorded frame.
        sequence: as it was recorded, (T, D).
        n_frames: number of frames to which the model resamples, which lowers the noise of a frame to about two
            thirds and correlates neighbours; None if it does not.
    """

    variance: float
    sequence: Floats
    n_frames: int | None = None

    @property
    def of_frames(self) -> float:
        """Variance of each coordinate of the frames of the model's input, on average."""
        weights = resample(np.eye(len(self.sequence)), self.n_frames or len(self.sequence))
        return self.variance * float((weights**2).sum(axis=1).mean())

    @property
    def of_states(self) -> Floats:
        """Addition to state covariances, shape (D, D)."""
        return self.of_frames * np.eye(self.sequence.shape[1])

    def of_averages(self, averaged: Callable[[Floats], Floats]) -> Floats:
        """Covariance (m D, m D) of m averages of recorded frames, one after the other, of all coordinates.

        `averaged` maps a sequence with any number D of coordinates linearly to m D numbers, each coordinate alike.
        """
        weights = averaged(np.eye(len(self.sequence))).reshape(-1, len(self.sequence))
        of_one = self.variance * (weights @ weights.T)
        return np.kron(of_one, np.eye(self.sequence.shape[1])).astype(np.float64)


def distances_with_noise(distances: Floats, covariance: Floats, moments: Floats, noise: Floats) -> Floats:
    """Squared Mahalanobis distances (K,) as they would be with noise, and a covariance that includes it.

    Args:
        covariance: by which they were measured, (n, n). moments: second moments of what they were measured of, up to a
            factor; less than the covariance in directions that few movements do not determine.
        noise: covariance of the noise.
    """
    inverse = np.linalg.inv(covariance + noise)
    own, added = inverse @ moments, inverse @ noise
    own_fraction = np.trace(own) / np.trace(np.linalg.solve(covariance, moments))
    mean = own_fraction * distances + np.trace(added)
    variance = 2.0 * (added * added.T).sum() + 4.0 * (own * added.T).sum()
    scatter = np.random.default_rng(0).standard_normal(len(distances))  # as of noise, and reproducible
    result: Floats = np.maximum(mean + np.sqrt(variance) * scatter, 0.1 * mean)
    return result


def moving_average(sequence: Floats, width: int) -> tuple[Floats, Floats]:
    """Mean of `width` frames around each frame, fewer at the ends, (T, D), and of how many, (T,)."""
    sums = np.concatenate([np.zeros((1, sequence.shape[1])), np.cumsum(sequence, axis=0)])
    middle = np.arange(len(sequence))
    reach = np.minimum(width // 2, np.minimum(middle, len(sequence) - 1 - middle))
    counts = 2.0 * reach + 1.0
    return (sums[middle + reach + 1] - sums[middle - reach]) / counts[:, None], counts
