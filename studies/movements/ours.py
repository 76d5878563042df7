"""This project's movement models as methods of the comparison."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from paramove.documents import Floats
from paramove.hmm import TrainingOptions
from paramove.phmm import (
    CubicPHMM,
    ExtrapolationWarning,
    InterpolativePHMM,
    LinearPHMM,
    MovementClassifier,
    NeuralPHMM,
    ParametricHMM,
    QuadraticPHMM,
    has_p_values,
)
from studies.movements.method import (
    BEGINNINGS,
    CLASSES,
    FRAMES,
    OUTLIERS,
    SYNTHESIS,
    THETA,
    THETA_OF_BEGINNINGS,
    Estimate,
    Examples,
    Method,
    NotAble,
)
from studies.movements.sweep import Row

FLOOR_M = 1e-4
"""Recordings may hold a point that never moves: no deviation is taken to be below a tenth of a millimetre."""


class Models(NotAble):
    """A parametric HMM per action; with several actions they compete."""

    can = frozenset({SYNTHESIS, THETA, OUTLIERS, CLASSES})

    def __init__(self, make: Callable[[], ParametricHMM]) -> None:
        self.make = make
        if getattr(make(), "residuals", None) == "correlated":
            self.can = Models.can | {BEGINNINGS, THETA_OF_BEGINNINGS}

    def fit(self, examples: Examples) -> None:
        """Learn from movements of one or several actions; nothing is chosen by parts of a person's movements."""
        labels = np.array(examples.labels)
        self.classifier = MovementClassifier(self.make())
        self.classifier.fit(examples.sequences, examples.theta, list(labels), examples.groups)
        self.model = self.classifier.models_[self.classifier.classes_[0]]

    def adapt(self, examples: Examples, own: Examples) -> None:
        """Takes what was learned as the prior."""
        self.model = self.model.adapt(own.sequences, own.theta)

    def synthesize(self, theta: Floats, n: int) -> Floats:
        """The prototype."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ExtrapolationWarning)  # a left-out target may lie far outside on purpose
            return self.model.synthesize(theta, n)

    def estimate(self, x: Floats) -> Estimate:
        """The likeliest theta and its covariance."""
        if has_p_values(self.model):
            examined = self.model.examine(x)
            return Estimate(examined.estimate.theta, examined.estimate.covariance, examined.p_value)
        estimate = self.model.estimate(x)
        return Estimate(estimate.theta, estimate.covariance)

    def estimate_beginning(self, x: Floats) -> Floats:
        """The average over what the beginning may be."""
        return self.model.estimate(x, finished=False).theta

    def classify(self, x: Floats, finished: bool) -> str:
        """The most probable action."""
        return self.classifier.classify(x, finished=finished).action

    def score(self, x: Floats) -> float:
        """Minus the outlier score; of models that have none, the log-likelihood at the likeliest theta."""
        if has_p_values(self.model):
            return -self.model.examine(x).outlier_score
        return self.model.estimate(x).log_likelihood


def our_rows() -> list[Row]:
    """All rows of this project."""
    common: dict[str, Any] = {"resampled_frames": FRAMES, "options": TrainingOptions(floor_deviation=FLOOR_M)}
    kinds: dict[str, Callable[[], ParametricHMM]] = {
        "paramove, quadratic PHMM": partial(QuadraticPHMM, **common),
        "paramove, linear PHMM": partial(LinearPHMM, **common),
        "paramove, cubic PHMM": partial(CubicPHMM, **common),
        "paramove, neural PHMM": partial(NeuralPHMM, **common),
        "paramove, interpolative PHMM": partial(InterpolativePHMM, **common),
        "paramove, quadratic PHMM as in the thesis": partial(QuadraticPHMM, residuals="independent", **common),
    }
    return [Row(name, _maker(make), repr(make), ours=True) for name, make in kinds.items()]


def _maker(make: Callable[[], ParametricHMM]) -> Callable[[int], Method]:
    return lambda seed: Models(make)
