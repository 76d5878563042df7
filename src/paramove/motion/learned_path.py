"""A person's reaching as a path for a servo arm's hand: its progress along a line and its deviation at each time.

A small arm on a table does not begin where a person's hand does, and it turns about one upright axis. So it
takes its own path from its hand to the target, an arc about that axis; the person gives the progress along it, the
deviation from it (the height of the arch above all), and the opening of the hand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.interpolate import CubicSpline

from paramove.documents import Floats
from paramove.motion.reaching_movement import ArmPoses, ReachingMovement
from paramove.motion.timing import minimum_jerk, smoothed

AHEAD = np.deg2rad(45.0)
"""Maximum azimuth of a target in front of the person; the person is turned towards targets further aside."""
SMOOTHING = 4.0
"""Number of points of a path over which it is smoothed: the states of a model are means of few frames each."""
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class LearnedPath:
    """N states of a movement from its beginning to its end.

    Attributes:
        progress: Along the straight line from the beginning to the end, [N], from 0 to 1.
        deviation: From that line, [N, 3], m, 0 at both ends.
        length: Of the line, m.
        opening: Of the hand, ξ, 1 open, [N].
    """

    progress: Floats
    deviation: Floats
    length: float
    opening: Floats

    @classmethod
    def of(cls, states: ArmPoses, opening: Floats, points: int) -> Self:
        """The path of the gripper, resampled to `points` points."""
        at = np.linspace(0.0, 1.0, len(states))
        columns = np.concatenate([states.gripper, opening[:, None]], axis=1)
        values = smoothed(CubicSpline(at, columns, axis=0)(np.linspace(0.0, 1.0, points)), SMOOTHING)
        gripper = values[:, :3]
        line = gripper[-1] - gripper[0]
        length = float(np.linalg.norm(line))
        progress = (gripper - gripper[0]) @ line / length**2
        deviation = gripper - gripper[0] - progress[:, None] * line
        return cls(progress, deviation, length, np.clip(values[:, 3], 0.0, 1.0))

    def milder(self, fraction: float) -> Self:
        """The same with a fraction of the person's deviation and timing; the rest is straight and evenly timed."""
        even = minimum_jerk(np.linspace(0.0, 1.0, len(self.progress)))
        progress = even + fraction * (self.progress - even)
        return replace(self, progress=progress, deviation=fraction * self.deviation)

    def raised(self, height: float) -> Self:
        """The same with an arch of this height, m, on top."""
        u = np.linspace(0.0, 1.0, len(self.progress))
        return replace(self, deviation=self.deviation + (16.0 * height * u**2 * (1.0 - u) ** 2)[:, None] * _UP)

    def between(self, start: Floats, end: Floats, axis: tuple[float, float]) -> Floats:
        """The path from a point [3] to another about an upright axis (x, y), [N, 3]; without the region behind it.

        A path that is shorter than the person's deviates less, in proportion.
        """
        about = np.array([*axis, 0.0])
        ends = [_cylindrical(point - about) for point in (start, end)]
        radius, azimuth, height = (ends[0] + self.progress[:, None] * (ends[1] - ends[0])).T
        path = about + np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height], axis=1)
        fraction = min(1.0, float(np.linalg.norm(end - start)) / self.length)
        return np.asarray(path + fraction * self.deviation)


class PlacedPerson:
    """A person, as small as the arm, who sits at its table so that the trained targets lie in front of the arm.

    Args:
        movement: Converted to the length of the arm.
        middle: Position of the middle of the trained targets, [3], frame of the base, m.
        axis: Upright axis of the arm, x and y, m.
        points: Number of points of the paths.
    """

    def __init__(self, movement: ReachingMovement, middle: Floats, axis: tuple[float, float], points: int) -> None:
        self._movement, self._points = movement, points
        self._shoulder = middle - movement.centre
        self._axis = np.array([*axis, 0.0])

    def approach(self, target: Floats) -> LearnedPath:
        """To a target [3], frame of the base, m."""
        return self._turned(target, self._movement.approach)

    def retreat(self, target: Floats) -> LearnedPath:
        """Back from a target."""
        return self._turned(target, self._movement.retreat)

    def within_training(self, target: Floats) -> bool | None:
        """Whether a target lies between the demonstrated ones."""
        return self._movement.within_training(self._relative(target)[1])

    def _relative(self, target: Floats) -> tuple[float, Floats]:
        """The angle by which the person is turned, and the target relative to the shoulder."""
        x, y, _ = target - self._axis
        azimuth = float(np.arctan2(y, x))
        turn = azimuth - float(np.clip(azimuth, -AHEAD, AHEAD))
        return turn, _rotation(-turn) @ (target - self._axis) + self._axis - self._shoulder

    def _turned(self, target: Floats, part: Callable[[Floats], tuple[ArmPoses, Floats]]) -> LearnedPath:
        """A part of the movement to a target, by the person turned towards it."""
        turn, from_shoulder = self._relative(target)
        path = LearnedPath.of(*part(from_shoulder), self._points)
        return replace(path, deviation=path.deviation @ _rotation(turn).T)


def _cylindrical(point: Floats) -> Floats:
    return np.array([np.hypot(point[0], point[1]), np.arctan2(point[1], point[0]), point[2]])


def _rotation(angle: float) -> Floats:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
