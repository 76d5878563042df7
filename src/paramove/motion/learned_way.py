"""A person's reaching as the way that a servo arm's hand takes: how far along and how far beside it is at each time.

A small arm on a table does not begin where a person's hand does, and it turns about one upright axis. So the way from
its hand to the target is its own, an arc about that axis, and the person's are the progress along the way, the
deviation from it (the height of the arch above all), and the opening of the hand.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.interpolate import CubicSpline

from paramove.documents import Floats
from paramove.motion.reaching_movement import ArmPoses, ReachingMovement
from paramove.motion.timing import minimum_jerk, smoothed

AHEAD = np.deg2rad(45.0)
"""Up to here a target lies before the person; where it lies further aside, the person is turned towards it."""
SMOOTHING = 4.0
"""Points of a way over which it is smoothed: the states of a model are means of few frames each."""
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class LearnedWay:
    """N states of a movement from its beginning to its end.

    Attributes:
        progress: Along the straight line from the beginning to the end, [N], from 0 to 1.
        beside: From that line, [N, 3], m, 0 at both ends.
        length: Of the line, m.
        opening: Of the hand, ξ, 1 open, [N].
    """

    progress: Floats
    beside: Floats
    length: float
    opening: Floats

    @classmethod
    def of(cls, states: ArmPoses, opening: Floats, points: int) -> Self:
        """The way of the gripper, resampled to so many points."""
        at = np.linspace(0.0, 1.0, len(states))
        columns = np.concatenate([states.gripper, opening[:, None]], axis=1)
        values = smoothed(CubicSpline(at, columns, axis=0)(np.linspace(0.0, 1.0, points)), SMOOTHING)
        gripper = values[:, :3]
        line = gripper[-1] - gripper[0]
        length = float(np.linalg.norm(line))
        progress = (gripper - gripper[0]) @ line / length**2
        beside = gripper - gripper[0] - progress[:, None] * line
        return cls(progress, beside, length, np.clip(values[:, 3], 0.0, 1.0))

    def milder(self, share: float) -> Self:
        """The same with a share of what the person does; the rest is straight and evenly timed."""
        even = minimum_jerk(np.linspace(0.0, 1.0, len(self.progress)))
        progress = even + share * (self.progress - even)
        return replace(self, progress=progress, beside=share * self.beside)

    def raised(self, height: float) -> Self:
        """The same with an arch of this height, m, on top."""
        u = np.linspace(0.0, 1.0, len(self.progress))
        return replace(self, beside=self.beside + (16.0 * height * u**2 * (1.0 - u) ** 2)[:, None] * _UP)

    def between(self, start: Floats, end: Floats, axis: tuple[float, float]) -> Floats:
        """The way from a point [3] to another about an upright axis (x, y), [N, 3]; without the region behind it.

        A way that is shorter than the person's deviates less, in proportion.
        """
        about = np.array([*axis, 0.0])
        ends = [_cylindrical(point - about) for point in (start, end)]
        radius, azimuth, height = (ends[0] + self.progress[:, None] * (ends[1] - ends[0])).T
        way = about + np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height], axis=1)
        share = min(1.0, float(np.linalg.norm(end - start)) / self.length)
        return np.asarray(way + share * self.beside)


class PlacedPerson:
    """A person, as small as the arm, who sits at its table so that the trained targets lie before the arm.

    Args:
        movement: Converted to the length of the arm.
        middle: Where the middle of the trained targets lies, [3], frame of the base, m.
        axis: Upright axis of the arm, x and y, m.
        points: Of the ways.
    """

    def __init__(self, movement: ReachingMovement, middle: Floats, axis: tuple[float, float], points: int) -> None:
        self._movement, self._points = movement, points
        self._shoulder = middle - movement.centre
        self._axis = np.array([*axis, 0.0])

    def approach(self, target: Floats) -> LearnedWay:
        """To a target [3], frame of the base, m."""
        turn, seen = self._seen(target)
        return self._turned(turn, *self._movement.approach(seen))

    def retreat(self, target: Floats) -> LearnedWay:
        """Back from a target."""
        turn, seen = self._seen(target)
        return self._turned(turn, *self._movement.retreat(seen))

    def within_training(self, target: Floats) -> bool | None:
        """Whether a target lies between the demonstrated ones."""
        return self._movement.within_training(self._seen(target)[1])

    def _seen(self, target: Floats) -> tuple[float, Floats]:
        """By how much the person is turned, and the target from the shoulder."""
        x, y, _ = target - self._axis
        azimuth = float(np.arctan2(y, x))
        turn = azimuth - float(np.clip(azimuth, -AHEAD, AHEAD))
        return turn, _rotation(-turn) @ (target - self._axis) + self._axis - self._shoulder

    def _turned(self, turn: float, states: ArmPoses, opening: Floats) -> LearnedWay:
        way = LearnedWay.of(states, opening, self._points)
        return replace(way, beside=way.beside @ _rotation(turn).T)


def _cylindrical(point: Floats) -> Floats:
    return np.array([np.hypot(point[0], point[1]), np.arctan2(point[1], point[0]), point[2]])


def _rotation(angle: float) -> Floats:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
