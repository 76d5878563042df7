"""Probabilistic movement primitives whose weights depend on theta (movement_primitives and gmr)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from paramove.documents import Floats
from paramove.hmm import resample
from studies.movements.method import FRAMES, OUTLIERS, SYNTHESIS, THETA, Estimate, Examples, NotAble
from studies.peers.library import library
from studies.peers.linear_gaussian import LinearGaussian, QuadraticFeatures


@lru_cache
def weights_per_frame(weights: int) -> Floats:
    """The library's regression of weights on frames is linear and the same for all dimensions: here its matrix.

    Evaluated once with single frames of one: the library builds all dimensions anew for each movement, which takes
    25 ms. Shape (weights, FRAMES).
    """
    one = library("movement_primitives.promp", "movement_primitives").ProMP(n_dims=1, n_weights_per_dim=weights)
    times = np.linspace(0.0, 1.0, FRAMES)
    return np.stack([np.ravel(one.weights(times, single[:, None], lmbda=1e-6)) for single in np.eye(FRAMES)], axis=1)


class ContextualProMP(NotAble):
    """One Gaussian over features of theta and weights; conditioned on theta it is the movement.

    Args:
        weights: basis functions per dimension.
        degree: of the features.
        noise_m: standard deviation of a frame about the weighted basis functions, m.
        warped: whether movements are aligned to a reference first.
    """

    can = frozenset({SYNTHESIS, THETA, OUTLIERS})

    def __init__(self, *, weights: int = 15, degree: int = 2, noise_m: float = 0.01, warped: bool = False) -> None:
        self.weights, self.degree, self.noise_m, self.warped = weights, degree, noise_m, warped

    def fit(self, examples: Examples) -> None:
        """Learn from movements of one action."""
        resampled = [resample(x, FRAMES) for x in examples.sequences]
        mean_path = np.mean(resampled, axis=0)
        self.reference = min(resampled, key=lambda x: float(((x - mean_path) ** 2).sum()))
        self.times = np.linspace(0.0, 1.0, FRAMES)
        self.dim = resampled[0].shape[1]
        self.promp = library("movement_primitives.promp", "movement_primitives").ProMP(
            n_dims=self.dim, n_weights_per_dim=self.weights
        )
        w = np.stack([self._weights_of(x) for x in resampled])
        self.features = QuadraticFeatures.of(examples.theta, self.degree)
        phi = self.features(examples.theta)
        self.gaussian = library("gmr", "gmr").MVN()
        self.gaussian.from_samples(np.hstack([phi, w]))
        q = phi.shape[1]
        joint: Floats = self.gaussian.covariance
        slopes = joint[q:, :q] @ np.linalg.pinv(joint[:q, :q])
        offset = self.gaussian.mean[q:] - slopes @ self.gaussian.mean[:q]
        inside = joint[q:, q:] - slopes @ joint[:q, q:]
        solved = weights_per_frame(self.weights)
        frames_noise = self.noise_m**2 * (solved @ solved.T)
        covariance = inside + np.kron(np.eye(self.dim), frames_noise)
        jitter = 1e-9 * float(np.trace(covariance)) / len(covariance)
        covariance += jitter * np.eye(len(covariance))
        self.model = LinearGaussian.of(self.features, offset, slopes, covariance, examples.theta)

    def _weights_of(self, x: Floats) -> Floats:
        return np.asarray((weights_per_frame(self.weights) @ self._paced(x)).T.ravel())

    def _paced(self, x: Floats) -> Floats:
        frames = resample(x, FRAMES)
        if not self.warped:
            return frames
        path = np.array(library("tslearn.metrics", "tslearn").dtw_path(frames, self.reference)[0])
        sums = np.zeros_like(self.reference)
        np.add.at(sums, path[:, 1], frames[path[:, 0]])
        return sums / np.bincount(path[:, 1], minlength=FRAMES)[:, None]

    def synthesize(self, theta: Floats, n: int) -> Floats:
        """Mean trajectory of the Gaussian conditioned on theta."""
        phi = self.features(theta)
        conditioned = self.gaussian.condition(np.arange(len(phi)), phi)
        return resample(self._frames_of(conditioned.mean), n)

    def _frames_of(self, w: Floats) -> Floats:
        self.promp.from_weight_distribution(w, np.zeros((len(w), len(w))))
        return np.asarray(self.promp.mean_trajectory(self.times))

    def estimate(self, x: Floats) -> Estimate:
        """Maximum likelihood theta of the weights."""
        return self.model.estimate(self._weights_of(x))

    def score(self, x: Floats) -> float:
        """Log-likelihood of the weights at the best theta, and of what they leave of the frames."""
        w = self._weights_of(x)
        rest = self._paced(x) - self._frames_of(w)
        left = -0.5 * float((rest**2).sum()) / self.noise_m**2
        return self.model.log_likelihood(w, self.model.estimate(w).theta) + left
