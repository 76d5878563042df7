"""Time warping, principal components and ridge regression on features of theta: the strong simple baseline."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from paramove.documents import Floats
from paramove.hmm import resample
from studies.movements.method import (
    FRAMES,
    OUTLIERS,
    SYNTHESIS,
    THETA,
    THETA_OF_BEGINNINGS,
    Estimate,
    Examples,
    NotAble,
)
from studies.peers.library import library
from studies.peers.linear_gaussian import LinearGaussian, QuadraticFeatures

ALPHAS = np.logspace(-4, 3, 15)
FRAME_ALPHAS = np.logspace(-6, 3, 19)
VELOCITY_FRAMES = 6
Motion = Literal["position", "position and velocity", "constant velocity"]


class FrameRidge(NotAble):
    """Ridge regression from the numbers of all frames to theta: no model of the movement."""

    can = frozenset({THETA})

    def fit(self, examples: Examples) -> None:
        """Learn from movements of one action."""
        linear_model = library("sklearn.linear_model", "scikit-learn")
        rows = np.stack([resample(x, FRAMES).ravel() for x in examples.sequences])
        self.ridge = linear_model.RidgeCV(alphas=FRAME_ALPHAS).fit(rows, examples.theta)

    def estimate(self, x: Floats) -> Estimate:
        """What the regression gives."""
        return Estimate(np.asarray(self.ridge.predict(resample(x, FRAMES).ravel()[None])[0]), None)


class MotionRidge(NotAble):
    """Ridge regression from positions at one moment, or from velocities too, to theta: one for each elapsed time.

    Args:
        points: "all", or the fingertip alone.
        motion: "position", also "position and velocity", or "constant velocity": where the points would be at the mean
            duration of the training.
    """

    can = frozenset({THETA, THETA_OF_BEGINNINGS})

    def __init__(self, points: Literal["all", "fingertip"] = "all", motion: Motion = "position and velocity") -> None:
        self.points, self.motion = points, motion

    def fit(self, examples: Examples) -> None:
        """Learn from movements of one action."""
        self.examples, self.by_frames = examples, dict[int | None, Any]()
        self.mean_frames = float(np.mean([len(x) for x in examples.sequences]))

    def estimate(self, x: Floats) -> Estimate:
        """From the last frames of complete movements, however long each is."""
        return Estimate(self._predicted(x, None), None)

    def estimate_beginning(self, x: Floats) -> Floats:
        """What the regression for the time that has passed gives; movements that had ended stay at their end."""
        return self._predicted(x, len(x))

    def _predicted(self, x: Floats, frames: int | None) -> Floats:
        if frames not in self.by_frames:
            rows = np.stack([self._row(one[:frames]) for one in self.examples.sequences])
            linear_model = library("sklearn.linear_model", "scikit-learn")
            self.by_frames[frames] = linear_model.RidgeCV(alphas=FRAME_ALPHAS).fit(rows, self.examples.theta)
        return np.asarray(self.by_frames[frames].predict(self._row(x)[None])[0])

    def _row(self, x: Floats) -> Floats:
        """Last frame and its mean velocity over at most six frames, per frame, as far as they are wanted."""
        tip = 3 * self.examples.tip
        own = x if self.points == "all" else x[:, tip : tip + 3]
        position, velocity = own[-1], (own[-1] - own[max(0, len(x) - 1 - VELOCITY_FRAMES)]) / VELOCITY_FRAMES
        if self.motion == "position and velocity":
            return np.concatenate([position, velocity])
        remaining = max(0.0, self.mean_frames - len(x)) if self.motion == "constant velocity" else 0.0
        result: Floats = position + remaining * velocity
        return result


class AlignedRidge(NotAble):
    """tslearn and scikit-learn: align to a reference, PCA, RidgeCV from features of theta to the components.

    Theta is estimated by the inverse: the Gaussian deviations of the components, with their variances alone
    ("diagonal") or their covariance by Ledoit and Wolf ("full").
    """

    can = frozenset({SYNTHESIS, THETA, OUTLIERS})

    def __init__(
        self,
        *,
        components: int = 8,
        degree: int = 2,
        warped: bool = True,
        covariance: Literal["diagonal", "full"] = "diagonal",
    ) -> None:
        self.components, self.degree, self.warped, self.covariance = components, degree, warped, covariance

    def fit(self, examples: Examples) -> None:
        """Learn from movements of one action."""
        decomposition = library("sklearn.decomposition", "scikit-learn")
        linear_model = library("sklearn.linear_model", "scikit-learn")
        resampled = [resample(x, FRAMES) for x in examples.sequences]
        self.mean_path = np.mean(resampled, axis=0)
        self.reference = min(resampled, key=lambda x: float(((x - self.mean_path) ** 2).sum()))
        rows = np.stack([self._row(x) for x in resampled])
        self.dim = resampled[0].shape[1]
        n_components = min(self.components, len(rows) - 1)
        self.pca = decomposition.PCA(n_components, random_state=0).fit(rows)
        z = self.pca.transform(rows)
        self.features = QuadraticFeatures.of(examples.theta, self.degree)
        self.ridge = linear_model.RidgeCV(alphas=ALPHAS).fit(self.features(examples.theta), z)
        residual = z - self.ridge.predict(self.features(examples.theta))
        self.model = LinearGaussian.of(
            self.features, self.ridge.intercept_, self.ridge.coef_, self._spread(residual), examples.theta
        )
        rest = rows - self.pca.inverse_transform(z)
        self.rest_variance = float((rest**2).mean()) * len(rows) / max(1, len(rows) - n_components) + 1e-8

    def _spread(self, residual: Floats) -> Floats:
        freedom = len(residual) / max(1, len(residual) - self.features(np.zeros(len(self.features.centre))).size - 1)
        if self.covariance == "full":
            shrunk = library("sklearn.covariance", "scikit-learn").LedoitWolf(assume_centered=True).fit(residual)
            covariance: Floats = shrunk.covariance_ * freedom
        else:
            covariance = np.diag((residual**2).mean(axis=0) * freedom)
        return covariance + 1e-10 * np.eye(len(covariance))

    def _components_at(self, theta: Floats) -> Floats:
        features = self.features(theta)
        result: Floats = self.ridge.coef_ @ features + self.ridge.intercept_
        return result

    def _row(self, x: Floats) -> Floats:
        """A movement at the reference's pace, as one row."""
        if not self.warped:
            return resample(x, FRAMES).ravel()
        path = np.array(library("tslearn.metrics", "tslearn").dtw_path(resample(x, FRAMES), self.reference)[0])
        sums = np.zeros_like(self.reference)
        np.add.at(sums, path[:, 1], resample(x, FRAMES)[path[:, 0]])
        counts = np.bincount(path[:, 1], minlength=FRAMES)[:, None]
        return (sums / counts).ravel()

    def synthesize(self, theta: Floats, n: int) -> Floats:
        """At the pace of the reference."""
        row = self.pca.inverse_transform(self._components_at(theta)[None])[0]
        return resample(row.reshape(FRAMES, self.dim), n)

    def estimate(self, x: Floats) -> Estimate:
        """The theta whose components are nearest in the metric of the deviations."""
        return self.model.estimate(self.pca.transform(self._row(x)[None])[0])

    def score(self, x: Floats) -> float:
        """Log-likelihood of the components at the best theta and of what they leave."""
        row = self._row(x)
        z = self.pca.transform(row[None])[0]
        rest = row - self.pca.inverse_transform(z[None])[0]
        theta = self.model.estimate(z).theta
        freedom = len(row) - len(z)
        left = -0.5 * (float(rest @ rest) / self.rest_variance + freedom * np.log(2.0 * np.pi * self.rest_variance))
        return self.model.log_likelihood(z, theta) + float(left)
