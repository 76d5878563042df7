"""What is compared: anything that learns from labelled movements, and can do some of five things."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, Ints

SYNTHESIS, THETA, THETA_OF_BEGINNINGS = "synthesis", "theta", "theta of beginnings"
CLASSES, BEGINNINGS, OUTLIERS = "classes", "beginnings", "outliers"
"""What a method declares that it can do; the tables show a dash for anything else."""
FRAMES = 100
"""Frames that movements are resampled to wherever a method needs equal lengths."""


class Estimate(NamedTuple):
    """Theta (P,), its covariance (P, P) and the movement's p-value; None from methods without one."""

    theta: Floats
    covariance: Floats | None
    p_value: float | None = None


@dataclass(frozen=True)
class Examples:
    """Movements with labels.

    Attributes:
        sequences: points over time at their own pace, each (T_k, D), m.
        theta: parameters, shape (K, P).
        labels: name of the action of each.
        groups: number of the fold unit (person, target) of each, shape (K,): hyper-parameters are chosen by leaving
            whole units out, never by leaving out single repetitions.
        rate_hz: frames per second.
        tip: which body point is the fingertip.
    """

    sequences: list[Floats]
    theta: Floats
    labels: list[str]
    groups: Ints
    rate_hz: float
    tip: int

    def __len__(self) -> int:
        return len(self.sequences)

    def chosen(self, where: Sequence[int] | NDArray[Any]) -> Examples:
        """Those with the given indices, or where a mask is true."""
        mask = np.asarray(where)
        indices = np.flatnonzero(mask) if mask.dtype == bool else mask
        return replace(
            self,
            sequences=[self.sequences[i] for i in indices],
            theta=self.theta[indices],
            labels=[self.labels[i] for i in indices],
            groups=self.groups[indices],
        )

    def of(self, label: str) -> Examples:
        """Those of one action."""
        return self.chosen(np.array([one == label for one in self.labels]))

    @property
    def actions(self) -> list[str]:
        """Names of the actions."""
        return sorted(set(self.labels))


def joined(parts: Iterable[Examples]) -> Examples:
    """All movements of several."""
    several = list(parts)
    return Examples(
        [x for part in several for x in part.sequences],
        np.concatenate([part.theta for part in several]),
        [label for part in several for label in part.labels],
        np.concatenate([part.groups for part in several]),
        several[0].rate_hz,
        several[0].tip,
    )


@runtime_checkable
class Method(Protocol):
    """A model under comparison. One object is fitted once per fold and then tested."""

    can: frozenset[str]

    def fit(self, examples: Examples) -> None:
        """Learn. Of one action for synthesis, theta and outliers; of several for classification."""

    def adapt(self, examples: Examples, own: Examples) -> None:
        """After learning from examples of other persons, adapt to a person of whom there are a few movements."""

    def synthesize(self, theta: Floats, n: int) -> Floats:
        """The prototype movement for theta. Shape (n, D), m."""

    def estimate(self, x: Floats) -> Estimate:
        """The parameter of a finished movement (T, D)."""

    def estimate_beginning(self, x: Floats) -> Floats:
        """The parameter (P,) of a beginning (T, D): how long it will be is unknown."""

    def classify(self, x: Floats, finished: bool) -> str:
        """The action of a movement (T, D); of a beginning where not finished: how long it will be is unknown."""

    def score(self, x: Floats) -> float:
        """How well a movement (T, D) fits the action learned: greater is better."""


class NotAble:
    """Base of methods that cannot do everything: what is not overridden raises."""

    can: frozenset[str] = frozenset()

    def fit(self, examples: Examples) -> None:
        """Learn from examples."""
        raise NotImplementedError(f"{type(self).__name__} cannot learn")

    def adapt(self, examples: Examples, own: Examples) -> None:
        """Learns from all of them."""
        self.fit(joined([examples, own]))

    def synthesize(self, theta: Floats, n: int) -> Floats:
        """Raises NotImplementedError."""
        raise NotImplementedError(f"{type(self).__name__} cannot synthesise")

    def estimate(self, x: Floats) -> Estimate:
        """Raises NotImplementedError."""
        raise NotImplementedError(f"{type(self).__name__} cannot estimate parameters")

    def estimate_beginning(self, x: Floats) -> Floats:
        """Raises NotImplementedError."""
        raise NotImplementedError(f"{type(self).__name__} cannot estimate parameters of beginnings")

    def classify(self, x: Floats, finished: bool) -> str:
        """Raises NotImplementedError."""
        raise NotImplementedError(f"{type(self).__name__} cannot classify")

    def score(self, x: Floats) -> float:
        """Raises NotImplementedError."""
        raise NotImplementedError(f"{type(self).__name__} detects no outliers")
