"""Closed-form kinematics of small servo arms: a yaw at the base, three parallel pitch joints, and perhaps a roll.

The pitch joints turn in one vertical plane that the yaw joint carries with it. Pitch is positive downward: 0 approaches
along the horizontal, away from the base, pi/2 straight down. The roll turns about the approach.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.documents import Floats

PITCHES = np.linspace(-np.pi, np.pi, 720, endpoint=False)
"""Searched for a reachable pitch, rad."""
PITCH_TOLERANCE = 1e-6
POINTS_TO_SHOULDER = 60
"""Between a point out of reach and the shoulder, searched for the nearest that is reachable."""
ROUNDING = 1e-9
"""Tolerance, rad or relative: rounding may carry an angle beyond its limit or a point beyond the reach."""


class OutOfReachError(ValueError):
    """A pose that an arm cannot take; the message names the cause and the nearest that is reachable.

    Attributes:
        pitch: Nearest reachable pitch at the same position, rad, if there is one.
        position: If not, a reachable point [3] nearer to the shoulder, frame of the base, m, if there is one.
    """

    def __init__(self, message: str, pitch: float | None = None, position: Floats | None = None) -> None:
        super().__init__(message)
        self.pitch = pitch
        self.position = position


Numbers = Floats | np.float64


@dataclass(frozen=True)
class EndEffector:
    """Where the end effector is in the frame of the base: position [..., 3], m; pitch, roll [...], rad."""

    position: Floats
    pitch: Floats
    roll: Floats


@dataclass(frozen=True, eq=False)
class PlanarArm:
    """An arm of four or five joints: yaw, three pitches, and a roll if it has five. All joints 0 is the zero pose.

    Attributes:
        names: Of the joints.
        lower, upper: Limits of solutions, rad, shape [4] or [5].
        yaw_axis: Where it stands in the frame of the base, x and y, m.
        shoulder: First pitch axis from the yaw axis in the zero pose: forward, left, and up from the base, m. The whole
            plane of the arm, with the roll axis, lies so far to the left.
        upper_arm, forearm: From a pitch axis to the next in the zero pose: forward and up, m.
        hand: From the last pitch axis, at the height of the roll axis, to the end effector: forward, left, up, m.
    """

    names: tuple[str, ...]
    lower: Floats
    upper: Floats
    yaw_axis: tuple[float, float]
    shoulder: tuple[float, float, float]
    upper_arm: tuple[float, float]
    forearm: tuple[float, float]
    hand: tuple[float, float, float]

    @property
    def n_joints(self) -> int:
        """4, or 5 with a roll."""
        return len(self.names)

    def forward(self, angles: ArrayLike) -> EndEffector:
        """Where the end effector is.

        Args:
            angles: Shape [..., J], rad.

        Raises:
            ValueError: The last axis does not hold J angles.
        """
        q = np.asarray(angles, dtype=np.float64)
        if q.ndim == 0 or q.shape[-1] != self.n_joints:
            raise ValueError(f"angles have shape {q.shape}; the last axis must hold the arm's {self.n_joints} joints")
        first, second = q[..., 1], q[..., 1] + q[..., 2]
        pitch = second + q[..., 3]
        roll = q[..., 4] if self.n_joints == 5 else np.zeros_like(pitch)
        left, up = self._rolled(roll)
        in_plane = _turned(*self.upper_arm, first) + _turned(*self.forearm, second) + _turned(self.hand[0], up, pitch)
        ahead, left = self.shoulder[0] + in_plane[..., 0], self.shoulder[1] + left
        cosine, sine = np.cos(q[..., 0]), np.sin(q[..., 0])
        x = self.yaw_axis[0] + cosine * ahead - sine * left
        y = self.yaw_axis[1] + sine * ahead + cosine * left
        position = np.stack([x, y, self.shoulder[2] + in_plane[..., 1]], axis=-1)
        return EndEffector(position, pitch, roll)

    def joint_angles(
        self, position: ArrayLike, pitch: float, roll: float = 0.0, near: ArrayLike | None = None
    ) -> Floats:
        """Joint angles that bring the end effector to a position with a pitch and roll, exactly.

        Of the solutions within the limits (elbow above or below, facing the position or with the back to it) the one
        nearest to the posture `near` [J] is taken, by the joint that moves most. Without `near`, facing comes first,
        then the elbow above.

        Args:
            position: Shape [3], frame of the base, m.
            pitch: Of the approach, rad.
            roll: Rad; 0 for an arm without a roll joint.

        Returns:
            Shape [J], rad.

        Raises:
            OutOfReachError: No solution within the limits; names the cause, and the nearest pose that is reachable.
            ValueError: Not finite, or of another shape.
        """
        goal = self._goal(position, pitch, roll)
        solutions = self._solutions(goal, np.float64(pitch), roll, near)
        good = solutions[self._within(solutions)]
        if len(good) == 0:
            raise self._out_of_reach(goal, pitch, roll, solutions)
        if near is None:
            return np.asarray(good[0])
        return np.asarray(good[np.abs(good - np.asarray(near)).max(axis=-1).argmin()])

    def all_joint_angles(self, positions: ArrayLike, pitches: ArrayLike) -> Floats:
        """All that bring the end effector to positions with pitches, and roll 0; nan where none is within the limits.

        Args:
            positions: Shape [..., 3], frame of the base, m.
            pitches: Shape [...], broadcast with the positions', rad.

        Returns:
            Shape [..., 4, J], rad: facing the position or with the back to it, the elbow above or below.
        """
        solutions = self._solutions(np.asarray(positions, dtype=np.float64), np.asarray(pitches), 0.0, None)
        return np.where(self._within(solutions)[..., None], solutions, np.nan)

    def nearest_pitch(self, position: ArrayLike, pitch: float, roll: float = 0.0) -> float:
        """The reachable pitch nearest to the requested one, to a millionth of a radian, from a search in half degrees.

        Raises:
            OutOfReachError: The position is reachable with no pitch.
            ValueError: Not finite, or of another shape.
        """
        goal = self._goal(position, pitch, roll)
        if self._reachable(goal, np.float64(pitch), roll):
            return float(pitch)
        nearest = self._nearest_pitch(goal, pitch, roll)
        if nearest is None:
            raise self._out_of_reach(goal, pitch, roll, self._solutions(goal, np.float64(pitch), roll, None))
        return nearest

    def _nearest_pitch(self, goal: Floats, pitch: float, roll: float) -> float | None:
        offsets = PITCHES[self._reachable(goal[None], pitch + PITCHES, roll)]
        if len(offsets) == 0:
            return None
        inside = float(offsets[np.abs(offsets).argmin()])
        outside = inside - np.copysign(PITCHES[1] - PITCHES[0], inside)
        while abs(inside - outside) > PITCH_TOLERANCE:
            middle = 0.5 * (inside + outside)
            if self._reachable(goal, np.float64(pitch + middle), roll):
                inside = middle
            else:
                outside = middle
        return float(np.remainder(pitch + inside + np.pi, 2 * np.pi) - np.pi)

    def _goal(self, position: ArrayLike, pitch: float, roll: float) -> Floats:
        goal = np.asarray(position, dtype=np.float64)
        if goal.shape != (3,):
            raise ValueError(f"a position has shape (3,), found {goal.shape}")
        if not (np.isfinite(goal).all() and np.isfinite(pitch) and np.isfinite(roll)):
            raise ValueError(f"position {goal}, pitch {pitch}, roll {roll}: expected finite numbers")
        if self.n_joints == 4 and roll != 0.0:
            raise OutOfReachError(f"roll {np.rad2deg(roll):.1f} deg is out of reach: the arm has no roll joint")
        return goal

    def _rolled(self, roll: Numbers) -> tuple[Numbers, Numbers]:
        """The end effector relative to the roll axis, left and up in the frame before the roll."""
        cosine, sine = np.cos(roll), np.sin(roll)
        return self.hand[1] * cosine - self.hand[2] * sine, self.hand[1] * sine + self.hand[2] * cosine

    def _solutions(self, goal: Floats, pitch: Numbers, roll: float, near: ArrayLike | None) -> Floats:
        """All four, [..., 4, J], where the arm is long enough, else nan, for positions [..., 3] and pitches [...]."""
        upper, fore = self._lengths
        solutions = []
        with np.errstate(invalid="ignore"):
            for facing in (1.0, -1.0):
                yaw, wrist = self._wrist(goal, pitch, roll, facing)
                bend = self._bend(wrist, upper, fore)
                for elbow in (bend, -bend):
                    first = np.arctan2(-wrist[..., 1], wrist[..., 0]) - _down(self.upper_arm)
                    first = first - np.arctan2(fore * np.sin(elbow), upper + fore * np.cos(elbow))
                    second = elbow + _down(self.upper_arm) - _down(self.forearm)
                    columns = np.broadcast_arrays(yaw, first, second, pitch - first - second, np.float64(roll))
                    solutions.append(np.stack(columns[: self.n_joints], axis=-1))
        return self._whole_turns(np.stack(solutions, axis=-2), near)

    @property
    def _lengths(self) -> tuple[float, float]:
        return float(np.hypot(*self.upper_arm)), float(np.hypot(*self.forearm))

    def _wrist(self, goal: Floats, pitch: Numbers, roll: float, facing: float) -> tuple[Floats, Floats]:
        """Yaw, rad, and the wrist from the shoulder, forward and up, m, facing (1) the goal or with the back to it."""
        left, up = self._rolled(np.float64(roll))
        left = self.shoulder[1] + left
        x, y = goal[..., 0] - self.yaw_axis[0], goal[..., 1] - self.yaw_axis[1]
        ahead = facing * np.sqrt(x**2 + y**2 - left**2)
        yaw = np.arctan2(y, x) - np.arctan2(left, ahead)
        end = np.stack([ahead - self.shoulder[0], goal[..., 2] - self.shoulder[2]], axis=-1)
        return yaw, end - _turned(self.hand[0], up, pitch)

    @staticmethod
    def _bend(wrist: Floats, upper: float, fore: float) -> Floats:
        """Between upper arm and forearm, rad, nan where the wrist is too far or too near."""
        cosine = (np.sum(wrist**2, axis=-1) - upper**2 - fore**2) / (2 * upper * fore)
        rounded = np.where(np.abs(cosine) <= 1.0 + ROUNDING, np.clip(cosine, -1.0, 1.0), np.nan)
        return np.asarray(np.arccos(rounded))

    def _whole_turns(self, angles: Floats, near: ArrayLike | None) -> Floats:
        """The same angles with the whole turns that bring them between the limits, and then nearest to `near`."""
        middle = 0.5 * (self.lower + self.upper)
        target = middle if near is None else np.asarray(near, dtype=np.float64)
        if target.shape != middle.shape:
            raise ValueError(f"a posture has shape {middle.shape}, found {target.shape}")
        nearest = target + np.remainder(angles - target + np.pi, 2 * np.pi) - np.pi
        central = middle + np.remainder(angles - middle + np.pi, 2 * np.pi) - np.pi
        return np.where(self._inside(nearest), nearest, central)

    def _inside(self, angles: Floats) -> NDArray[np.bool_]:
        return (angles >= self.lower - ROUNDING) & (angles <= self.upper + ROUNDING)

    def _within(self, solutions: Floats) -> NDArray[np.bool_]:
        return np.asarray(self._inside(solutions).all(axis=-1))

    def _reachable(self, goal: Floats, pitch: Numbers, roll: float) -> NDArray[np.bool_]:
        return np.asarray(self._within(self._solutions(goal, pitch, roll, None)).any(axis=-1))

    def _cause(self, goal: Floats, pitch: float, roll: float, solutions: Floats) -> str:
        """Why none of the solutions [S, J], some of them nan, is within the limits."""
        finite = solutions[np.isfinite(solutions).all(axis=-1)]
        if len(finite):
            beyond = np.maximum(self.lower - finite, finite - self.upper)
            best = beyond.max(axis=-1).argmin()  # with the smallest excess, of its worst joint
            joint = int(beyond[best].argmax())
            angle, low, high = np.rad2deg([finite[best, joint], self.lower[joint], self.upper[joint]])
            return (
                f"{self.names[joint]} would have to turn to {angle:.1f} deg, its range is {low:.1f} to {high:.1f} deg"
            )
        with np.errstate(invalid="ignore"):
            away = np.linalg.norm(self._wrist(goal, np.float64(pitch), roll, 1.0)[1])
        if np.isnan(away):
            return "it is nearer to the yaw axis than the plane of the arm"
        upper, fore = self._lengths
        reach = f"{abs(upper - fore):.3f} to {upper + fore:.3f} m"
        return f"the wrist would have to be {away:.3f} m from the shoulder, its links reach {reach}"

    def _out_of_reach(self, goal: Floats, pitch: float, roll: float, solutions: Floats) -> OutOfReachError:
        cause = self._cause(goal, pitch, roll, solutions)
        where = f"{_metres(goal)} with pitch {np.rad2deg(pitch):.1f} deg"
        other = self._nearest_pitch(goal, pitch, roll)
        if other is not None:
            hint = f"the nearest reachable pitch there is {np.rad2deg(other):.1f} deg"
            return OutOfReachError(f"{where} is out of reach: {cause}; {hint}", pitch=other)
        shoulder = np.array([*self.yaw_axis, self.shoulder[2]])
        line = goal + np.linspace(0.0, 1.0, POINTS_TO_SHOULDER)[:, None] * (shoulder - goal)
        reachable = self._reachable(line[:, None], PITCHES[None], roll).any(axis=-1)
        if not reachable.any():
            return OutOfReachError(f"{where} is out of reach: {cause}; so is every point between it and the shoulder")
        point = line[reachable.argmax()]
        hint = f"no pitch helps; towards the shoulder, the first reachable point is {_metres(point)}"
        return OutOfReachError(f"{where} is out of reach: {cause}; {hint}", position=point)


def _turned(forward: float, up: float | Numbers, angle: Numbers) -> Floats:
    """Forward and up of a vector turned downward by angles [...]; [..., 2]."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([forward * cosine + up * sine, up * cosine - forward * sine], axis=-1)


def _down(vector: tuple[float, float]) -> float:
    """How far a vector points below the horizontal, rad."""
    return float(np.arctan2(-vector[1], vector[0]))


def _metres(point: Floats) -> str:
    return f"({', '.join(f'{value:.3f}' for value in point)}) m"
