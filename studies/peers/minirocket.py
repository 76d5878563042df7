"""MiniRocket's random convolutions (sktime) with linear models (scikit-learn)."""

from __future__ import annotations

from typing import Any

import numpy as np

from paramove.documents import Floats
from paramove.hmm import resample
from studies.movements.method import CLASSES, FRAMES, THETA, Estimate, Examples, NotAble
from studies.peers.library import library

ALPHAS = np.logspace(-3, 5, 17)


class MiniRocket(NotAble):
    """Features of the movement; a ridge classifier of the action, a ridge regression of theta."""

    can = frozenset({CLASSES, THETA})

    def __init__(self, *, kernels: int = 10_000, seed: int = 0) -> None:
        self.kernels, self.seed = kernels, seed
        self.classifier: Any = None

    def fit(self, examples: Examples) -> None:
        """Classifier for several actions, regression for one."""
        rocket = library("sktime.transformations.panel.rocket", "sktime")
        linear_model = library("sklearn.linear_model", "scikit-learn")
        preprocessing = library("sklearn.preprocessing", "scikit-learn")
        pipeline = library("sklearn.pipeline", "scikit-learn")
        self.transform = rocket.MiniRocketMultivariate(num_kernels=self.kernels, random_state=self.seed)
        features = np.asarray(self.transform.fit_transform(self._panel(examples.sequences)))
        if len(examples.actions) > 1:
            last = linear_model.RidgeClassifierCV(alphas=ALPHAS)
            self.classifier = pipeline.make_pipeline(preprocessing.StandardScaler(with_mean=False), last)
            self.classifier.fit(features, examples.labels)
        else:
            last = linear_model.RidgeCV(alphas=ALPHAS)
            self.regression = pipeline.make_pipeline(preprocessing.StandardScaler(with_mean=False), last)
            self.regression.fit(features, examples.theta)

    def _panel(self, sequences: list[Floats]) -> Floats:
        return np.stack([resample(x, FRAMES).T for x in sequences])

    def _features(self, x: Floats) -> Floats:
        return np.asarray(self.transform.transform(self._panel([x])), dtype=np.float64)

    def estimate(self, x: Floats) -> Estimate:
        """By regression; without a region."""
        return Estimate(np.asarray(self.regression.predict(self._features(x))[0]), None)

    def classify(self, x: Floats, finished: bool) -> str:
        """By the ridge classifier."""
        return str(self.classifier.predict(self._features(x))[0])
