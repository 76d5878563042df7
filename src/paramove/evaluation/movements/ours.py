"""This project's movement models as methods of the comparison."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from paramove.evaluation.movements.method import (
    BEGINNINGS,
    CLASSES,
    FRAMES,
    SYNTHESIS,
    THETA,
    TYPICALITY,
    Estimate,
    Examples,
    Method,
    NotAble,
)
from paramove.evaluation.movements.per_action import ByElapsedTime, PerAction
from paramove.evaluation.movements.sweep import Row
from paramove.phmm import LinearPHMM, ParametricHMM, QuadraticPHMM

Floats = NDArray[np.float64]
SOURCES = (
    "paramove.evaluation.movements.ours",
    "paramove.evaluation.movements.per_action",
    "paramove.phmm",
    "paramove.hmm",
)


class ModelOfOneAction(NotAble):
    """A parametric HMM."""

    can = frozenset({SYNTHESIS, THETA, TYPICALITY})

    def __init__(self, make: Callable[[], ParametricHMM]) -> None:
        self.make = make

    def fit(self, examples: Examples) -> None:
        """Learn from movements of one action."""
        self.model = self.make().fit(examples.sequences, examples.theta)

    def synthesize(self, theta: Floats, n: int) -> Floats:
        """The prototype."""
        return self.model.synthesize(theta, n)

    def estimate(self, x: Floats) -> Estimate:
        """Maximum likelihood theta and its covariance."""
        found = self.model.estimate(x)
        return Estimate(found.theta, found.covariance)

    def score(self, x: Floats) -> float:
        """Log-likelihood at the best theta."""
        return self.model.estimate(x).log_likelihood


def complete(make: Callable[[], ParametricHMM]) -> Method:
    """A model of one action, with several a classifier of whole movements and of beginnings."""
    can = ModelOfOneAction.can | {CLASSES}
    return ByElapsedTime(partial(PerAction, partial(ModelOfOneAction, make), can), can | {BEGINNINGS})


def our_rows() -> list[Row]:
    """All rows of this project."""
    kinds: dict[str, Callable[[], ParametricHMM]] = {
        "paramove, linear PHMM": partial(LinearPHMM, resampled_frames=FRAMES),
        "paramove, quadratic PHMM": partial(QuadraticPHMM, resampled_frames=FRAMES),
    }
    return [Row(name, _maker(make), repr(make), SOURCES, ours=True) for name, make in kinds.items()]


def _maker(make: Callable[[], ParametricHMM]) -> Callable[[int], Method]:
    return lambda seed: complete(make)
