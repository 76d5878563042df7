"""From a model of one action to a classifier, and from a classifier of whole movements to one of beginnings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from paramove.documents import Floats
from studies.movements.method import Estimate, Examples, Method, NotAble


class PerAction(NotAble):
    """One model per action; the name of the one that fits best is the answer."""

    def __init__(self, make: Callable[[], Method], can: frozenset[str]) -> None:
        self.make = make
        self.can = can
        self.models: dict[str, Method] = {}

    def fit(self, examples: Examples) -> None:
        """One model of each action."""
        self.models = {}
        for action in examples.actions:
            model = self.make()
            model.fit(examples.of(action))
            self.models[action] = model

    def synthesize(self, theta: Floats, n: int) -> Floats:
        """By the only action's model."""
        return self._only().synthesize(theta, n)

    def estimate(self, x: Floats) -> Estimate:
        """By the only action's model."""
        return self._only().estimate(x)

    def score(self, x: Floats) -> float:
        """By the only action's model."""
        return self._only().score(x)

    def classify(self, x: Floats, finished: bool) -> str:
        """The action whose model fits the movement best."""
        scores = {action: model.score(x) for action, model in self.models.items()}
        return max(scores, key=lambda action: scores[action])

    def _only(self) -> Method:
        (model,) = self.models.values()
        return model


class ByElapsedTime(NotAble):
    """Classifies beginnings with models of beginnings: trained on beginnings of the same length.

    The length of the whole movement is unknown. The elapsed time is rounded to a geometric grid, and one model is
    trained per time, when it is first needed. Training movements that ended earlier stay at their last frame.
    """

    STEP = 1.12

    def __init__(self, make: Callable[[], Method], can: frozenset[str]) -> None:
        self.make = make
        self.can = can
        self.by_length: dict[int, Method] = {}

    def fit(self, examples: Examples) -> None:
        """Learn whole movements; models of beginnings are trained when they are needed."""
        self.examples, self.by_length = examples, {}
        self.whole = self.make()
        self.whole.fit(examples)

    def synthesize(self, theta: Floats, n: int) -> Floats:
        """By the model of whole movements."""
        return self.whole.synthesize(theta, n)

    def estimate(self, x: Floats) -> Estimate:
        """By the model of whole movements."""
        return self.whole.estimate(x)

    def score(self, x: Floats) -> float:
        """By the model of whole movements."""
        return self.whole.score(x)

    def classify(self, x: Floats, finished: bool) -> str:
        """By the model of whole movements, or by one of beginnings as long as this."""
        if finished:
            return self.whole.classify(x, True)
        exponent = round(np.log(max(len(x), 10)) / np.log(self.STEP))
        frames = round(self.STEP**exponent)
        if frames not in self.by_length:
            model = self.make()
            beginnings = [first_frames(one, frames) for one in self.examples.sequences]
            model.fit(replace(self.examples, sequences=beginnings))
            self.by_length[frames] = model
        return self.by_length[frames].classify(x, True)


def first_frames(x: Floats, frames: int) -> Floats:
    """The first frames of a movement; one that is shorter stays where it ended. Shape (frames, D)."""
    if len(x) >= frames:
        return x[:frames]
    return np.concatenate([x, np.repeat(x[-1:], frames - len(x), axis=0)])
