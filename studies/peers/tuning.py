"""Hyper-parameters chosen inside the training folds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.stats import chi2

from paramove.documents import Floats
from paramove.hmm import resample
from studies.movements.measures import squared_deviations
from studies.movements.method import CLASSES, FRAMES, SYNTHESIS, THETA, Estimate, Examples, Method, NotAble

INNER_FOLDS = 3
MAX_TESTED = 24
"""About as many movements are tested in an inner fold, evenly chosen: more cost time and change few choices."""


class Tuned(NotAble):
    """Fits the candidate that does best when whole groups of the training movements are left out, in three folds.

    For one action that is the minimum product of the errors of synthesis and theta (whichever the method can do),
    for several the maximum fraction of right answers.
    """

    def __init__(self, make: Callable[..., Method], candidates: Sequence[dict[str, Any]]) -> None:
        self.make, self.candidates = make, list(candidates)
        self.can = make(**self.candidates[0]).can
        self.chosen: dict[str, Any] = {}

    def fit(self, examples: Examples) -> None:
        """Choose, then learn from all examples."""
        folds = inner_folds(examples)
        losses = [sum(self._loss(parameters, *fold) for fold in folds) for parameters in self.candidates]
        self.chosen = self.candidates[int(np.argmin(losses))]
        self.inflation = self._inflation(folds)
        self.method = self.make(**self.chosen)
        self.method.fit(examples)

    def _inflation(self, folds: Sequence[tuple[Examples, Examples]]) -> float:
        """Factor on covariances of theta by which the 95 % regions hold as much of what the folds left out."""
        squares = []
        for train, test in folds if THETA in self.can else ():
            method = self.make(**self.chosen)
            method.fit(train)
            for x, theta in _pairs(test):
                estimate = method.estimate(x)
                if estimate.covariance is not None:
                    squares.append(squared_deviations(estimate.theta, estimate.covariance, theta))
        level = chi2.ppf(0.95, folds[0][0].theta.shape[1])
        known = [square for square in squares if np.isfinite(square)]
        return float(np.quantile(known, 0.95) / level) if known else 1.0

    def _loss(self, parameters: dict[str, Any], train: Examples, test: Examples) -> float:
        method = self.make(**parameters)
        method.fit(train)
        if len(train.actions) > 1:
            if CLASSES not in method.can:
                return 0.0
            return -float(
                np.mean([method.classify(x, True) == a for x, a in zip(test.sequences, test.labels, strict=True)])
            )
        loss = 0.0
        if THETA in method.can:
            deviation = np.maximum(train.theta.std(axis=0), 1e-9)
            errors = [(method.estimate(x).theta - theta) / deviation for x, theta in _pairs(test)]
            loss += float(np.log(np.mean(np.linalg.norm(errors, axis=1))))
        if SYNTHESIS in method.can:
            off = [((method.synthesize(theta, FRAMES) - resample(x, FRAMES)) ** 2).mean() for x, theta in _pairs(test)]
            loss += 0.5 * float(np.log(np.mean(off)))
        return loss

    def synthesize(self, theta: Floats, n: int) -> Floats:
        """By the chosen candidate."""
        return self.method.synthesize(theta, n)

    def estimate(self, x: Floats) -> Estimate:
        """By the chosen candidate, its covariance as wide as errors of what was left out."""
        estimate = self.method.estimate(x)
        if estimate.covariance is None:
            return estimate
        return estimate._replace(covariance=self.inflation * estimate.covariance)

    def classify(self, x: Floats, finished: bool) -> str:
        """By the chosen candidate."""
        return self.method.classify(x, finished)

    def score(self, x: Floats) -> float:
        """By the chosen candidate."""
        return self.method.score(x)


def inner_folds(examples: Examples) -> list[tuple[Examples, Examples]]:
    """Up to three folds; each leaves out a third of the groups, every third in their order."""
    groups = np.unique(examples.groups)
    count = min(INNER_FOLDS, len(groups))
    if count < 2:
        return [(examples, examples)]
    folds = []
    for k in range(count):
        left_out = np.isin(examples.groups, groups[k::count])
        tested = np.flatnonzero(left_out)
        step = max(1, len(tested) // MAX_TESTED)
        folds.append((examples.chosen(~left_out), examples.chosen(tested[::step])))
    return folds


def _pairs(examples: Examples) -> list[tuple[Floats, Floats]]:
    return list(zip(examples.sequences, examples.theta, strict=True))
