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
        tested = [[self._tested(parameters, *fold) for fold in folds] for parameters in self.candidates]
        best = int(np.argmin([sum(loss for loss, _ in own) for own in tested]))
        self.chosen = self.candidates[best]
        self.inflation = inflation_of([square for _, squares in tested[best] for square in squares], examples)
        self.method = self.make(**self.chosen)
        self.method.fit(examples)

    def _tested(self, parameters: dict[str, Any], train: Examples, test: Examples) -> tuple[float, list[float]]:
        """Loss on a fold, and the squared errors of theta in predicted deviations, if it predicts any."""
        method = self.make(**parameters)
        method.fit(train)
        if len(train.actions) > 1:
            if CLASSES not in method.can:
                return 0.0, []
            right = [method.classify(x, True) == a for x, a in zip(test.sequences, test.labels, strict=True)]
            return -float(np.mean(right)), []
        loss, squares = 0.0, []
        if THETA in method.can:
            deviation = np.maximum(train.theta.std(axis=0), 1e-9)
            estimates = [(method.estimate(x), theta) for x, theta in _pairs(test)]
            errors = [(estimate.theta - theta) / deviation for estimate, theta in estimates]
            loss += float(np.log(np.mean(np.linalg.norm(errors, axis=1))))
            squares = [
                squared_deviations(estimate.theta, estimate.covariance, theta)
                for estimate, theta in estimates
                if estimate.covariance is not None
            ]
        if SYNTHESIS in method.can:
            off = [((method.synthesize(theta, FRAMES) - resample(x, FRAMES)) ** 2).mean() for x, theta in _pairs(test)]
            loss += 0.5 * float(np.log(np.mean(off)))
        return loss, squares

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


def inflation_of(squares: Sequence[float], examples: Examples) -> float:
    """Factor on covariances of theta by which the 95 % regions hold as much of what the folds left out."""
    known = [square for square in squares if np.isfinite(square)]
    return float(np.quantile(known, 0.95) / chi2.ppf(0.95, examples.theta.shape[1])) if known else 1.0


def _pairs(examples: Examples) -> list[tuple[Floats, Floats]]:
    return list(zip(examples.sequences, examples.theta, strict=True))
