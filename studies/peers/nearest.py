"""Nearest neighbours by time warping (tslearn)."""

from __future__ import annotations

from collections import Counter

import numpy as np

from paramove.documents import Floats
from paramove.hmm import resample
from studies.movements.method import CLASSES, FRAMES, OUTLIERS, THETA, Estimate, Examples, NotAble
from studies.peers.library import library


class NearestByWarping(NotAble):
    """The k nearest training movements: majority of their actions, mean of their parameters."""

    can = frozenset({CLASSES, THETA, OUTLIERS})

    def __init__(self, *, neighbours: int = 1, radius: int | None = None) -> None:
        self.neighbours, self.radius = neighbours, radius

    def fit(self, examples: Examples) -> None:
        """Keep the examples."""
        self.examples = examples
        self.stack = np.stack([resample(x, FRAMES) for x in examples.sequences])

    def _nearest(self, x: Floats) -> tuple[list[int], Floats]:
        metrics = library("tslearn.metrics", "tslearn")
        band = {} if self.radius is None else {"global_constraint": "sakoe_chiba", "sakoe_chiba_radius": self.radius}
        distances = metrics.cdist_dtw(resample(x, FRAMES)[None], self.stack, **band)[0]
        order = np.argsort(distances, kind="stable")[: self.neighbours]
        return [int(one) for one in order], distances[order]

    def estimate(self, x: Floats) -> Estimate:
        """Mean theta of the neighbours."""
        return Estimate(self.examples.theta[self._nearest(x)[0]].mean(axis=0), None)

    def classify(self, x: Floats, finished: bool) -> str:
        """Majority of the neighbours."""
        return Counter(self.examples.labels[i] for i in self._nearest(x)[0]).most_common(1)[0][0]

    def score(self, x: Floats) -> float:
        """The nearer the neighbours, the greater."""
        return -float(self._nearest(x)[1].mean())
