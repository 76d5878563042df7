"""The learned reaching on a small servo arm: reach for a position, or pick an object up and place it elsewhere.

As the relocation action of the thesis (5.2.5): a learned movement brings the open hand over the object, a straight line
lowers it, the hand closes and lifts the object, a learned movement carries it over the target, and so on. See
`learned_path.py` for the part that is learned from the person.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.documents import Floats
from paramove.motion.arm_pose import UnreachablePoseError
from paramove.motion.hand_poses import HandPoses, metres
from paramove.motion.learned_path import SMOOTHING, LearnedPath, PlacedPerson
from paramove.motion.modelled_movement import robot_movement
from paramove.motion.planar_path import NoJointPathError, planar_path
from paramove.motion.planned_motion import PlannedMotion
from paramove.motion.table_clearance import TableClearance
from paramove.motion.timing import minimum_jerk, ramped, rest_to_rest, smoothed
from paramove.phmm import ParametricHMM
from paramove.robots import DescriptionError, OutOfReachError, RobotDescription

POINTS = 48
"""Number of points of a learned path."""
_FRACTIONS = (1.0, 0.6, 0.3, 0.0)
_ARCHES_M = (0.0, 0.02, 0.04, 0.07, 0.10)
_CHECKED_EVERY = 3
_GAP_TO_ENDS_M = 0.0005
_UP = np.array([0.0, 0.0, 1.0])


class ServoArmReaching:
    """Plans motions of one arm. Angles are [J + 1], rad: the arm's joints and the gripper.

    Args:
        description: Of a robot with a chain.
        model: Of a person's reaching, its parameter the position that is reached; scaled to the size of the arm.
        options: Sizes.

    Raises:
        DescriptionError: The robot has no such arm.
        ValueError: The model is not one of reaching.

    Attributes:
        joints: Names, the gripper last.
        base_angles: The end of motions that go home.
        lower, upper: Limits of the angles.
        start_tolerance: Maximum distance of a motion's start from the commanded angles, rad.
    """

    def __init__(
        self, description: RobotDescription, model: ParametricHMM, options: ServoReachingOptions | None = None
    ) -> None:
        chain = description.chain
        if chain is None:
            raise DescriptionError(f"{description.name} has no chain in its robot.yaml: it is not a servo arm")
        self._chain, self._arm = chain, chain.kinematics
        self.options = o = options or ServoReachingOptions()
        self.joints = (*chain.joints, chain.gripper)
        indices = [*chain.indices, chain.gripper_index]
        self.base_angles = description.base_pose[indices]
        self.lower, self.upper = description.soft_lower[indices], description.soft_upper[indices]
        rates = (description.operating_velocity, description.operating_acceleration, description.jerk)
        velocity, acceleration, jerk = (o.limit_fraction * limit[indices] for limit in rates)
        self._limits = (velocity, acceleration, jerk)
        self.start_tolerance = float(np.deg2rad(description.stream.start_tolerance_deg))
        self._period = description.stream.period_us * 1e-6
        self._clearance = TableClearance(description, chain, o.table_z)
        self._poses = HandPoses(chain, self._clearance, self._gripper(o.work_opening))
        length = float(np.hypot(*self._arm.upper_arm) + np.hypot(*self._arm.forearm) + self._arm.hand[0])
        middle = self._poses.middle(o.table_z, self._band(o.grasp_band_deg))
        self._person = PlacedPerson(robot_movement(model, length), middle, self._arm.yaw_axis, POINTS)

    def reach(self, target: ArrayLike, start: ArrayLike | None = None) -> PlannedMotion:
        """Bring the end effector to a position with an open hand, by the learned movement.

        Args:
            target: Shape [3], frame of the base, m.
            start: Angles from which the motion begins; None for the base pose.

        Raises:
            OutOfReachError: With the reason and the nearest reachable position, or that there is no path.
        """
        goal = np.asarray(target, dtype=np.float64)
        pitch = self._poses.pitch_at(goal, np.deg2rad(self.options.pitch_deg), self._band(self.options.reach_band_deg))
        motion = self._begun(start)
        path = self._learned(self._person.approach, goal)
        self._go(motion, "reach", goal, pitch, path, self.options.work_opening, self.options.clearance)
        return self._finished(motion)

    def pick_and_place(self, source: ArrayLike, place: ArrayLike, start: ArrayLike | None = None) -> PlannedMotion:
        """Fetch the object at `source`, put it at `place` and go back to the base pose.

        Args:
            source, place: Of the end effector when it grasps and releases, [3], frame of the base, m.
            start: As for `reach`.

        Raises:
            OutOfReachError: With the reason and the nearest reachable position, or that there is no path.
        """
        o = self.options
        ends = [np.asarray(point, dtype=np.float64) for point in (source, place)]
        pitches = [self._grasp_pitch(point) for point in ends]
        motion = self._begun(start)
        self._over(motion, "approach", ends[0], pitches[0], o.work_opening)
        self._line(motion, "lower", ends[0], pitches[0])
        self._fingers(motion, "grasp", o.closed_opening)
        self._line(motion, "lift", *self._above(ends[0], pitches[0]), holding=True)
        self._over(motion, "carry", ends[1], pitches[1], o.closed_opening, holding=True)
        self._line(motion, "place", ends[1], pitches[1], holding=True)
        self._fingers(motion, "release", o.work_opening)
        self._line(motion, "withdraw", *self._above(ends[1], pitches[1]))
        self._home(motion, "retreat", ends[1])
        return self._finished(motion)

    def home(self, start: ArrayLike) -> PlannedMotion:
        """Back to the base pose, by the learned retreat.

        Raises:
            OutOfReachError: There is no path.
        """
        motion = self._begun(start)
        self._home(motion, "retreat", self._hand(motion.end))
        return self._finished(motion)

    def within_training(self, target: ArrayLike) -> bool | None:
        """Whether a target [3] lies between those that the person reached for; None if that is not known."""
        return self._person.within_training(np.asarray(target, dtype=np.float64))

    # The parts of a motion

    def _over(
        self, motion: MotionRows, name: str, point: Floats, pitch: float, opening: float, holding: bool = False
    ) -> None:
        """By the learned movement to above an object or its target."""
        above, above_pitch = self._above(point, pitch)
        path = self._learned(self._person.approach, above)
        self._go(motion, name, above, above_pitch, path, opening, self.options.carry_clearance, holding)

    def _home(self, motion: MotionRows, name: str, from_point: Floats) -> None:
        base = self.base_angles
        path = self._learned(self._person.retreat, from_point)
        pitch = float(self._arm.forward(base[:-1]).pitch)
        self._go(motion, name, self._hand(base), pitch, path, None, self.options.clearance)
        self._joints(motion, name, base)

    def _go(
        self,
        motion: MotionRows,
        name: str,
        point: Floats,
        pitch: float,
        path: LearnedPath,
        opening: float | None,
        clearance: float,
        holding: bool = False,
    ) -> None:
        """Along a learned path; with an arch or less of the person's deviation where it is not clear, or slow."""
        reason, best = "", None
        for fraction in _FRACTIONS:
            mild = path.milder(fraction)
            gripper = self._openings(motion.end, mild, opening)
            rows, fault = self._clear(motion.end, mild, point, pitch, gripper, clearance)
            reason = reason or fault
            if rows is not None and (best is None or len(rows) < len(best)):
                best = rows
            if best is not None and self._period * len(best) <= self.options.longest_duration:
                break
        if best is None:
            raise OutOfReachError(
                f"there is no path to {metres(point)} from {metres(self._hand(motion.end))}: {reason}"
            )
        motion.add(name, best, holding)

    def _clear(
        self,
        start: Floats,
        path: LearnedPath,
        point: Floats,
        pitch: float,
        gripper: Floats,
        clearance: float,
    ) -> tuple[Floats | None, str]:
        """Rows along a path with the smallest arch that is clear; if none is, None and the obstacle."""
        reason = ""
        for arch in _ARCHES_M:
            try:
                rows = self._along(start, path.raised(arch), point, pitch, gripper)
            except NoJointPathError as error:
                reason = reason or str(error)
                continue
            fault = self._fault(rows, clearance)
            if not fault:
                return rows, ""
            reason = reason or fault
        return None, reason

    def _line(self, motion: MotionRows, name: str, point: Floats, pitch: float, holding: bool = False) -> None:
        """Straight, with the gripper as it is."""
        here = self._hand(motion.end)
        distance = float(np.linalg.norm(point - here))
        n = max(6, int(np.ceil(distance / 0.004)))
        positions = here + np.linspace(0.0, 1.0, n)[:, None] * (point - here)
        try:
            arm = planar_path(self._arm, positions, np.full(n, pitch), motion.end[:-1])
        except NoJointPathError as error:
            raise OutOfReachError(f"no straight line leads to {metres(point)}: {error}") from error
        knots = np.concatenate([arm, np.full((n, 1), motion.end[-1])], axis=1)
        duration = 1.875 * distance / self.options.speed  # the peak of the minimum-jerk profile
        rows = self._inside(rest_to_rest(knots, duration, self._period, self._limits))
        fault = self._fault(rows, self.options.clearance)
        if fault:
            raise OutOfReachError(f"no straight line leads to {metres(point)}: {fault}")
        motion.add(name, rows, holding)

    def _fingers(self, motion: MotionRows, name: str, opening: float) -> None:
        end = np.append(motion.end[:-1], self._gripper(opening))
        closing = opening == self.options.closed_opening
        knots = np.linspace(motion.end, end, 6)
        rows = rest_to_rest(knots, self.options.gripper_duration, self._period, self._limits)
        rest = np.repeat(rows[-1:], round(self.options.settle_duration / self._period), axis=0)
        motion.add(name, np.concatenate([rows, rest]), closing)

    def _joints(self, motion: MotionRows, name: str, end: Floats) -> None:
        """The last bit in joint angles: the roll, and the gripper."""
        if np.abs(motion.end - end).max() > 1e-9:
            motion.add(name, rest_to_rest(np.linspace(motion.end, end, 6), 0.2, self._period, self._limits), False)

    def _along(self, start: Floats, path: LearnedPath, point: Floats, pitch: float, gripper: Floats) -> Floats:
        here = self._arm.forward(start[:-1])
        positions = path.between(here.position, point, self._arm.yaw_axis)
        fraction = minimum_jerk(np.linspace(0.0, 1.0, POINTS))
        pitches = float(here.pitch) + fraction * (pitch - float(here.pitch))
        arm = planar_path(self._arm, positions, pitches, start[:-1])
        if self._arm.n_joints == 5:  # the search has no roll: it is turned back along the path
            arm[:, 4] = (1.0 - fraction) * start[4]
        knots = np.concatenate([arm, gripper[:, None]], axis=1)
        return self._inside(rest_to_rest(knots, self.options.learned_duration, self._period, self._limits, ramped))

    def _openings(self, start: Floats, path: LearnedPath, opening: float | None) -> Floats:
        """Angles of the gripper along a path: the person's opening, scaled to `opening`; constant if closed."""
        fraction = minimum_jerk(np.linspace(0.0, 1.0, POINTS))
        if opening is None:
            return np.asarray((1.0 - fraction) * start[-1] + fraction * self.base_angles[-1])
        if opening == self.options.closed_opening:
            return np.full(POINTS, start[-1])
        last = max(float(path.opening[-1]), 1e-3)
        angles = np.array([self._gripper(opening * float(np.clip(xi / last, 0.0, 1.0))) for xi in path.opening])
        return smoothed(angles + (1.0 - fraction) * (start[-1] - angles[0]), SMOOTHING)

    def _fault(self, rows: Floats, clearance: float) -> str:
        """The obstacle on a path; empty if it is clear."""
        checked = np.concatenate([rows[:-1:_CHECKED_EVERY], rows[-1:]])
        heights, hand = self._clearance.heights(checked), self._arm.forward(checked[:, :-1]).position
        minimum = np.full(len(checked), clearance)
        for end in (0, -1):
            near = np.linalg.norm(hand - hand[end], axis=1) < self.options.near
            minimum[near] = np.minimum(minimum[near], heights[end] - _GAP_TO_ENDS_M)
        worst = int((heights - minimum).argmin())
        if heights[worst] < minimum[worst]:
            return f"the arm would be {1000 * heights[worst]:.0f} mm above the table at {metres(hand[worst])}"
        touching = self._clearance.touching(checked[:: 2 * _CHECKED_EVERY])
        return "" if touching is None else f"its {touching[0]} would touch its {touching[1]}"

    # Positions

    def _begun(self, start: ArrayLike | None) -> MotionRows:
        angles = self.base_angles if start is None else np.asarray(start, dtype=np.float64)
        if angles.shape != self.base_angles.shape or not np.isfinite(angles).all():
            raise ValueError(f"expected a start with the angles of {', '.join(self.joints)}, found {angles.tolist()}")
        return MotionRows([self._inside(angles)[None]], [np.zeros(1, dtype=bool)])

    def _finished(self, motion: MotionRows) -> PlannedMotion:
        rows = np.concatenate(motion.rows)
        phases = tuple((name, self._period * first) for name, first in motion.phases)
        times: Floats = self._period * np.arange(len(rows), dtype=np.float64)
        return PlannedMotion(times, rows, self._hand(rows), np.concatenate(motion.holding), phases, 0.0)

    def _learned(self, path: Callable[[Floats], LearnedPath], target: Floats) -> LearnedPath:
        try:
            return path(target)
        except (UnreachablePoseError, np.linalg.LinAlgError) as error:
            raise OutOfReachError(f"the learned movement does not lead to {metres(target)}: {error}") from error

    def _grasp_pitch(self, point: Floats) -> float:
        return self._poses.pitch_at(point, np.deg2rad(self.options.pitch_deg), self._band(self.options.grasp_band_deg))

    def _above(self, point: Floats, pitch: float) -> tuple[Floats, float]:
        above = point + self.options.lift * _UP
        return above, self._poses.pitch_at(above, pitch, self._band(self.options.reach_band_deg))

    def _hand(self, angles: Floats) -> Floats:
        return self._arm.forward(angles[..., :-1]).position

    def _gripper(self, opening: float) -> float:
        return self._chain.gripper_closed + opening * (self._chain.gripper_open - self._chain.gripper_closed)

    def _inside(self, angles: Floats) -> Floats:
        return np.asarray(np.clip(angles, self.lower, self.upper))

    @staticmethod
    def _band(degrees: tuple[float, float]) -> tuple[float, float]:
        lowest, highest = np.deg2rad(degrees)
        return float(lowest), float(highest)


@dataclass(frozen=True)
class ServoReachingOptions:
    """Sizes, m, s, m/s, deg."""

    table_z: float = 0.0  # frame of the base
    pitch_deg: float = 90.0  # of the hand at the target: straight down
    reach_band_deg: tuple[float, float] = (-90.0, 120.0)
    grasp_band_deg: tuple[float, float] = (50.0, 110.0)  # further from straight down an open gripper strikes the object
    lift: float = 0.05  # height above an object at which learned movements end and begin
    speed: float = 0.06  # maximum, of straight lines
    learned_duration: float = 1.6  # minimum, of a learned movement
    longest_duration: float = 6.0  # where a learned movement takes longer, as joints turn far, a milder one is tried
    gripper_duration: float = 0.8
    settle_duration: float = 0.4  # time for the closed gripper to press
    work_opening: float = 0.6  # ξ
    closed_opening: float = 0.0
    clearance: float = 0.005  # of every part from the table
    carry_clearance: float = 0.02
    near: float = 0.03  # within this distance of a path's ends the hand may be as low as there
    limit_fraction: float = 0.8  # of the operating velocity, acceleration and jerk


@dataclass
class MotionRows:
    """A motion under construction: rows of joint angles, rad."""

    rows: list[Floats]
    holding: list[NDArray[np.bool_]] = field(default_factory=list)
    phases: list[tuple[str, int]] = field(default_factory=list)

    @property
    def end(self) -> Floats:
        """The last row [J]."""
        return np.asarray(self.rows[-1][-1])

    def add(self, name: str, rows: Floats, holding: bool) -> None:
        """Adds rows, of which the first repeats the last existing one."""
        if not self.phases or self.phases[-1][0] != name:
            self.phases.append((name, sum(map(len, self.rows)) - 1))
        self.rows.append(rows[1:])
        self.holding.append(np.full(len(rows) - 1, holding))
