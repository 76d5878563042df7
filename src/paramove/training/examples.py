"""Training data from a demonstration set: sequences at one frame rate, the parameters that vary, a description."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from paramove.demonstrations import AXIS_ENDINGS, DemonstrationError, DemonstrationSet, oddities
from paramove.documents import Floats, nearest
from paramove.phmm import MovementDescription
from paramove.robots import ARM_BASE

VARIES = 0.1
"""A coordinate of a position whose range is a smaller fraction of the widest coordinate's counts as constant."""
ARM_FLOOR_M = 5e-4
"""Accuracy of a servo arm's points: one step of an encoder with 4096 steps a turn moves a hand 0.3 m from the joint by
this much. The arm's base does not move at all; without a floor, points that never move could not be learned."""
DEPENDENT = 1e-9
"""Smallest variance of a direction, of the largest: below, a point follows from others, and needs the floor as well."""
ENDS_WITHIN_M = 0.005
"""Movements that all end so near to their theta are known to end there."""
PERSONS_FOR_GROUPS = 3
"""With at least this many persons, the cross-validation of training leaves out whole persons."""


@dataclass(frozen=True)
class Examples:
    """Movements to train a model with.

    Attributes:
        sequences: stacked positions, each (T_k, D), m, at `rate_hz`.
        theta: shape (K, P).
        labels: actions, K.
        subjects: persons, K.
        parameter_names: of the P components.
        point_names: of the D / 3 points.
        frame: coordinate frame.
        rate_hz: frames a second.
        source: where the movements come from.
        remarks: for people, on what was left out.
    """

    sequences: list[Floats]
    theta: Floats
    labels: list[str]
    subjects: list[str]
    parameter_names: tuple[str, ...]
    point_names: tuple[str, ...]
    frame: str
    rate_hz: float
    source: str
    remarks: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.sequences)

    @property
    def actions(self) -> tuple[str, ...]:
        """Names of the actions, sorted."""
        return tuple(sorted(set(self.labels)))

    @property
    def floor_deviation(self) -> float:
        """Best accuracy of the points, m; 0: estimated from their variation."""
        return ARM_FLOOR_M if self.frame == ARM_BASE or self._are_dependent else 0.0

    @property
    def _are_dependent(self) -> bool:
        """Whether a coordinate follows exactly from the others, as that of a point made from two others does."""
        covariance = np.cov(np.concatenate(self.sequences), rowvar=False)
        variances = np.linalg.eigvalsh(covariance)
        constant = (
            np.diagonal(covariance).min() < DEPENDENT * variances[-1]
        )  # that is an error, which the model reports
        return bool(variances[0] < DEPENDENT * variances[-1] and not constant)

    @property
    def groups(self) -> list[str] | None:
        """The person of each movement if there are several persons; None: movements of one theta belong together."""
        return self.subjects if len(set(self.subjects)) >= PERSONS_FOR_GROUPS else None

    def of(self, numbers: Sequence[int]) -> Examples:
        """Only those movements."""
        return replace(
            self,
            sequences=[self.sequences[number] for number in numbers],
            theta=self.theta[list(numbers)],
            labels=[self.labels[number] for number in numbers],
            subjects=[self.subjects[number] for number in numbers],
        )

    def of_action(self, action: str) -> Examples:
        """The movements of one action."""
        return self.of([number for number, label in enumerate(self.labels) if label == action])

    def description(self, action: str) -> MovementDescription:
        """The description that is stored with a model of one action."""
        own = self.of_action(action)
        seconds = [(len(sequence) - 1) / self.rate_hz for sequence in own.sequences]
        return MovementDescription(
            action=action, point_names=self.point_names, unit="m", frame=self.frame,
            parameter_names=self.parameter_names, duration=float(np.mean(seconds)), source=self.source,
            rate_hz=self.rate_hz, arrival=1.0 if own._ends_at_theta else -1.0,
        )  # fmt: skip

    @property
    def _ends_at_theta(self) -> bool:
        """Whether the fingertip, or the middle of fingers and knuckle, always ends at theta."""
        if not all(is_place(name) for name in self.parameter_names):
            return False
        axes = [AXIS_ENDINGS.index(name[-2:]) for name in self.parameter_names]
        ends = np.array([sequence[-1] for sequence in self.sequences]).reshape(len(self), -1, 3)[..., axes]
        for points in (("index",), ("knuckle", "index", "thumb")):
            if set(points) <= set(self.point_names):
                where = ends[:, [self.point_names.index(one) for one in points]].mean(axis=1)
                if np.linalg.norm(where - self.theta, axis=1).max() < ENDS_WITHIN_M:
                    return True
        return False


def examples_of(
    demonstrations: DemonstrationSet, *, action: str | None = None, parameters: Sequence[str] | None = None,
    body: bool = False, source: str = ""
) -> Examples:  # fmt: skip
    """The movements of a set, or of one action of it.

    Args:
        demonstrations: the set.
        action: only this one.
        parameters: names of those that are learned; None: all that vary.
        body: transform everything into the person's frame, left arms as right ones.
        source: of the set, for the description.

    Raises DemonstrationError if there is no such action or parameter, if no parameter varies, or if a movement is so
    odd that no model can be learned with it (`oddities`); others that hardly fit are named in the remarks.
    """
    chosen = demonstrations.select(action)
    odd = oddities(chosen)
    spoiling = [oddity.message for oddity in odd if oddity.spoils]
    if spoiling:
        raise DemonstrationError("; ".join(spoiling) + ". Import it again, or remove it from labels.yaml")
    if body:
        chosen = chosen.in_body_frame().with_right_arms()
    rate_hz = float(f"{np.median([movement.rate_hz for movement in chosen]):.4g}")
    chosen = chosen.resampled(rate_hz)
    arrays = chosen.sequences()
    columns, remarks = _learned(arrays.theta, chosen.parameter_names, parameters)
    return Examples(
        sequences=arrays.sequences, theta=arrays.theta[:, columns], labels=arrays.labels, subjects=arrays.subjects,
        parameter_names=tuple(chosen.parameter_names[column] for column in columns), point_names=chosen.point_names,
        frame=chosen.frame, rate_hz=rate_hz, source=demonstrations.description or source,
        remarks=(*demonstrations.remarks, *(oddity.message for oddity in odd), *remarks),
    )  # fmt: skip


def _learned(theta: Floats, names: tuple[str, ...], requested: Sequence[str] | None) -> tuple[list[int], list[str]]:
    """Which components of theta are learned, and remarks on the others."""
    for name in requested or ():
        if name not in names:
            raise DemonstrationError(f"there is no parameter '{name}' in the set; {nearest(name, names)}")
    if requested:
        return [names.index(name) for name in requested], []
    ranges = np.ptp(theta, axis=0)
    is_position = [is_place(name) for name in names]
    widest = max((float(width) for width, position in zip(ranges, is_position, strict=True) if position), default=0.0)
    columns, remarks = [], []
    for number, (name, width, position) in enumerate(zip(names, ranges.tolist(), is_position, strict=True)):
        if width > (VARIES * widest if position else 0.0):
            columns.append(number)
        elif width > 0.0:
            remarks.append(
                f"{name} varies by only {width:.2g} m, little compared with {widest:.2g} m: it is left out; "
                "--parameters selects the ones to learn"
            )
        else:
            remarks.append(f"{name} is {theta[0, number]:g} in all movements: it is left out")
    if not columns:
        raise DemonstrationError(
            f"all {len(theta)} movements have the same parameters ({', '.join(names) or 'none'}); a parametric model "
            "learns how a movement changes with them: use movements of different theta"
        )
    return columns, remarks


def is_place(name: str) -> bool:
    """Whether a parameter is a coordinate of a position, in metres: its name ends in _x, _y or _z."""
    return name.endswith(AXIS_ENDINGS)
