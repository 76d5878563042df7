"""The learned reaching on a small servo arm: reach for a position, or pick an object up and place it elsewhere.

As the relocation action of the thesis (5.2.5): a learned movement brings the open hand over the object, a straight line
lowers it, the hand closes and lifts the object, a learned movement carries it over the target, and so on. See
`learned_path.py` for the part that is learned from the person.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.documents import Floats
from paramove.motion.arm_pose import UnreachablePoseError
from paramove.motion.clearance import ClearanceChecker
from paramove.motion.gripper_arm import GripperArm
from paramove.motion.hand_poses import HandPoses
from paramove.motion.learned_path import SMOOTHING, LearnedPath, PlacedPerson
from paramove.motion.modelled_movement import robot_movement
from paramove.motion.planar_path import NoJointPathError, planar_path
from paramove.motion.plans import (
    USUAL,
    Grasp,
    Held,
    MisfitError,
    NoPlanError,
    PlannedMotion,
    RestPose,
    check_number,
    metres,
)
from paramove.motion.timing import PEAK_VELOCITY, minimum_jerk, ramped, rest_to_rest, smoothed
from paramove.phmm import ParametricHMM
from paramove.robots import DescriptionError, OutOfReachError, RobotDescription, SurfaceParameters, WorkingSurface

POINTS = 48
"""Number of points of a learned path."""
_FRACTIONS = (1.0, 0.6, 0.3, 0.0)
_ARCHES_M = (0.0, 0.02, 0.04, 0.07, 0.10)
_CHECKED_EVERY = 3
_GAP_TO_ENDS_M = 0.0005
_TABLE_M = 1.0  # to each side of the base
_UP = np.array([0.0, 0.0, 1.0])


USUAL_REACH = 0.8
"""Quantile of the reachable distances: an object whose target is not known yet is grasped as for one so far away."""
WIDTH_ERROR_M = 0.004
"""Of a width that was measured in an image."""
FINGER_GAP_M = 0.0045
"""Between an object to be grasped and the face of a finger that does not move: positions of objects are estimates."""
NOTHING = np.empty((0, 2))
"""No standing objects."""


class ServoArmReaching:
    """`MotionPlans` of one arm. Angles are [J + 1], rad: the arm's joints and the gripper.

    Args:
        description: Of a robot with a chain.
        model: Of a person's reaching, its parameter the position that is reached; scaled to the size of the arm.
        surface: Shape of the objects that stand on the table, which is the plane z = 0 of the base.

    Raises:
        DescriptionError: The robot has no such arm.
        ValueError: The model is not one of reaching.

    Attributes:
        arm: Joints, the gripper last; its base pose is the end of motions that go home.
        lower, upper: Limits of the angles.
        start_tolerance: Maximum distance of a motion's start from the limits, rad.
        options: Sizes.
    """

    def __init__(
        self,
        description: RobotDescription,
        model: ParametricHMM,
        surface: WorkingSurface | None = None,
    ) -> None:
        chain = description.chain
        if chain is None:
            raise DescriptionError(f"{description.name} has no chain in its robot.yaml: it is not a servo arm")
        self._arm, self.arm = chain.kinematics, GripperArm.of(description, "")
        self.options = o = ServoReachingOptions()
        self._reach_band, self._grasp_band = np.deg2rad(o.reach_band_deg), np.deg2rad(o.grasp_band_deg)
        self.offer_opening, self.closed_opening = o.work_opening, o.closed_opening
        indices = [*chain.indices, chain.gripper_index]
        self.base_angles = self.arm.base_angles
        self.lower, self.upper = description.soft_lower[indices], description.soft_upper[indices]
        rates = (description.operating_velocity, description.operating_acceleration, description.jerk)
        velocity, acceleration, jerk = (o.limit_fraction * limit[indices] for limit in rates)
        self._limits = (velocity, acceleration, jerk)
        self.start_tolerance = float(np.deg2rad(description.stream.start_tolerance_deg))
        self._period = description.stream.period_us * 1e-6
        sides = (-_TABLE_M, _TABLE_M)
        surface = surface or SurfaceParameters().of(description, "")
        table = surface.model_copy(update={"x": sides, "y": sides, "z": 0.0})
        self._clearance = ClearanceChecker(description, self.arm, table)
        self._poses = HandPoses(chain, self._clearance, self.arm.angle_of(o.work_opening), self.base_angles[:-1])
        length = float(np.hypot(*self._arm.upper_arm) + np.hypot(*self._arm.forearm) + self._arm.hand[0])
        ahead = self._poses.ahead(0.0, self._grasp_band)
        self._usual_reach = float(np.quantile(ahead[:, 0], USUAL_REACH) - self._arm.yaw_axis[0])
        self._person = PlacedPerson(robot_movement(model, length), ahead.mean(axis=0), self._arm.yaw_axis, POINTS)
        self._fixed_finger, self._widths = chain.fixed_finger, chain.object_width
        self._usual_width = min(2.0 * table.object_radius, chain.object_width[1])

    def reach(self, position: ArrayLike, standing: Floats = NOTHING, start: RestPose | None = None) -> PlannedMotion:
        """Bring the end effector to a position with an open gripper, by the learned movement.

        Args:
            position: Shape [3], frame of the base, m.
            standing: Objects to keep clear of, [M, 2], m.
            start: Where the motion begins; None for the base pose.

        Raises:
            OutOfReachError: With the reason and the nearest reachable position.
            NoPlanError: There is no clear path.
        """
        goal = np.asarray(position, dtype=np.float64)
        pitch = self._poses.pitch_at(goal, np.deg2rad(self.options.pitch_deg), self._reach_band)
        motion = self._begun(start, standing)
        path = self._learned(self._person.approach, goal)
        self._go(motion, "reach", goal, pitch, path, self.options.work_opening, self.options.clearance)
        return self._finished(motion)

    def fetch(
        self,
        source: ArrayLike,
        standing: Floats = NOTHING,
        start: RestPose | None = None,
        grasp: Grasp = USUAL,
    ) -> PlannedMotion:
        """Grasp the object at `source` and lift it. Arguments and errors as for `reach`.

        Where the target is known, it is grasped with a pitch that reaches that, too, so that it will stand upright.
        Every second attempt is made with another pitch and a wider gripper; the widest objects need that, too. A low
        object is grasped below its top, one of unknown height low in every second attempt. An arm with a roll turns its
        fingers along the sides of a square foot, or along the length of an object that lies.
        """
        grasp.check_height(self._clearance.surface.object_height)
        askew, lowered = self._askew(source, grasp), self._lowered(source, grasp)
        turned = askew if self._arm.n_joints == 5 else 0.0
        width = self._held_width(grasp, askew - turned)
        point = self._beside(source, width, FINGER_GAP_M, turned) - lowered * _UP
        target = None if grasp.target is None else self._beside(grasp.target, width) - lowered * _UP
        pitch = self._pitch_of_both(point, target)
        opening = self.options.work_opening
        if grasp.attempt % 2 == 0:
            pitch = self._grasp_pitch(point, pitch - np.deg2rad(self.options.second_turn_deg))
        if grasp.attempt % 2 == 0 or (self._fixed_finger is None and width > self._widths[1] - 2 * FINGER_GAP_M):
            opening = self.options.second_opening
        motion = self._begun(start, standing)
        motion.held, motion.roll = Held(pitch, width, float(point[2]), lowered), -turned  # the hand points down
        self._over(motion, "approach", point, pitch, opening)
        self._line(motion, "lower", point, pitch)
        self._fingers(motion, "grasp", self.options.closed_opening)
        self._line(motion, "lift", *self._above(point, pitch), holding=True)
        return self._finished(motion)

    def deliver(self, start: RestPose, target: ArrayLike, standing: Floats = NOTHING) -> PlannedMotion:
        """Carry the held object to `target`, release it, go back to the base pose. Errors as for `reach`."""
        held = start.held
        point = self._beside(target, self._usual_width if held is None else held.width)
        point = point if held is None else point - held.lowered * _UP
        pitch = self._grasp_pitch(point, None if held is None else held.pitch)
        motion = self._begun(start, standing)
        self._over(motion, "carry", point, pitch, self.options.closed_opening, holding=True)
        self._put(motion, point, pitch)
        return self._finished(motion)

    def hold(self, start: RestPose, position: ArrayLike, standing: Floats = NOTHING) -> PlannedMotion:
        """Carry the held object to `position` and stay there. Errors as for `reach`."""
        point, o = np.asarray(position, dtype=np.float64), self.options
        pitch = self._poses.pitch_at(point, np.deg2rad(o.pitch_deg), self._reach_band)
        motion = self._begun(start, standing)
        motion.held = start.held
        path = self._learned(self._person.approach, point)
        self._go(motion, "carry", point, pitch, path, o.closed_opening, o.clearance, holding=True)
        return self._finished(motion)

    def fingers(self, here: RestPose, opening: float, end: float, standing: Floats = NOTHING) -> PlannedMotion:
        """Open or close the gripper where it is."""
        motion = self._begun(here, standing)
        self._fingers(motion, "fingers", end)
        return self._finished(motion)

    def leave(self, here: RestPose, opening: float, standing: Floats = NOTHING) -> PlannedMotion:
        """Open the gripper where it is, draw it up, go back to the base pose. Errors as for `reach`."""
        motion = self._begun(here, standing)
        self._fingers(motion, "release", self.options.work_opening)
        self._home(motion, self._before_roll(motion.end)[1])
        return self._finished(motion)

    def home(
        self, here: RestPose, opening: float = 1.0, holding: bool = False, standing: Floats = NOTHING
    ) -> PlannedMotion:
        """Back to the base pose, by the learned retreat; a held object is put down first. Errors as for `reach`."""
        motion = self._begun(here, standing)
        hand = self._before_roll(motion.end)[1]
        if holding:
            held = here.held
            grasped_z = self.options.low_grasp if held is None else held.z
            below = np.array([*hand[:2], min(hand[2], grasped_z)])
            self._put(motion, below, self._grasp_pitch(below, None if held is None else held.pitch))
        else:
            self._home(motion, hand)
        return self._finished(motion)

    def within_training(self, target: ArrayLike) -> bool | None:
        """Whether a target [3] lies between those that the person reached for; None if that is not known."""
        return self._person.within_training(np.asarray(target, dtype=np.float64))

    # The parts of a motion

    def _put(self, motion: MotionRows, point: Floats, pitch: float) -> None:
        """Lower the held object, release it, go back to the base pose."""
        self._line(motion, "place", point, pitch, holding=True)
        self._fingers(motion, "release", self.options.work_opening)
        self._line(motion, "withdraw", *self._above(point, pitch))
        self._home(motion, point)

    def _over(
        self, motion: MotionRows, name: str, point: Floats, pitch: float, opening: float, holding: bool = False
    ) -> None:
        """By the learned movement to above an object or its target."""
        above, above_pitch = self._above(point, pitch)
        path = self._learned(self._person.approach, above)
        self._go(motion, name, above, above_pitch, path, opening, self.options.carry_clearance, holding)

    def _home(self, motion: MotionRows, from_point: Floats) -> None:
        """By the learned retreat to above the base pose; the last bit, the roll and the gripper, in joint angles."""
        base = self.base_angles
        path = self._learned(self._person.retreat, from_point)
        pitch = float(self._arm.forward(base[:-1]).pitch)
        self._go(motion, "retreat", self.arm.position(base), pitch, path, None, self.options.clearance)
        if np.abs(motion.end - base).max() > 1e-9:
            rows = rest_to_rest(np.linspace(motion.end, base, 6), 0.2, self._period, self._limits)
            motion.add("retreat", rows, False)

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
            rows, fault = self._clear(motion, mild, point, pitch, gripper, clearance, holding)
            reason = reason or fault
            if rows is not None and (best is None or len(rows) < len(best)):
                best = rows
            if best is not None and self._period * len(best) <= self.options.longest_duration:
                break
        if best is None:
            raise motion.no_plan(
                f"there is no path to {metres(point)} from {metres(self.arm.position(motion.end))}: {reason}"
            )
        motion.add(name, best, holding)

    def _clear(
        self,
        motion: MotionRows,
        path: LearnedPath,
        point: Floats,
        pitch: float,
        gripper: Floats,
        clearance: float,
        holding: bool,
    ) -> tuple[Floats | None, str]:
        """Rows along a path with the smallest arch that is clear; if none is, None and the obstacle."""
        reason = ""
        for arch in _ARCHES_M:
            try:
                rows = self._along(motion, path.raised(arch), point, pitch, gripper)
            except NoJointPathError as error:
                reason = reason or str(error)
                continue
            fault = self._fault(motion, rows, clearance, holding)
            if not fault:
                return rows, ""
            reason = reason or fault
        return None, reason

    def _line(self, motion: MotionRows, name: str, point: Floats, pitch: float, holding: bool = False) -> None:
        """Straight, with the gripper as it is."""
        start, here = self._before_roll(motion.end)
        distance = float(np.linalg.norm(point - here))
        n = max(6, int(np.ceil(distance / 0.004)))
        positions = here + np.linspace(0.0, 1.0, n)[:, None] * (point - here)
        try:
            arm = planar_path(self._arm, positions, np.full(n, pitch), start)
        except NoJointPathError as error:
            raise motion.no_plan(f"no straight line leads to {metres(point)}: {error}") from error
        arm[:, 4:] = motion.end[4:-1]
        knots = np.concatenate([arm, np.full((n, 1), motion.end[-1])], axis=1)
        duration = PEAK_VELOCITY * distance / self.options.speed
        rows = self._inside(rest_to_rest(knots, duration, self._period, self._limits))
        fault = self._fault(motion, rows, self.options.clearance, holding)
        if fault:
            raise motion.no_plan(f"no straight line leads to {metres(point)}: {fault}")
        motion.add(name, rows, holding)

    def _fingers(self, motion: MotionRows, name: str, opening: float) -> None:
        end = np.append(motion.end[:-1], self.arm.angle_of(opening))
        closing = opening == self.options.closed_opening
        knots = np.linspace(motion.end, end, 6)
        rows = rest_to_rest(knots, self.options.gripper_duration, self._period, self._limits)
        rest = np.repeat(rows[-1:], round(self.options.settle_duration / self._period), axis=0)
        motion.add(name, np.concatenate([rows, rest]), closing)

    def _along(self, motion: MotionRows, path: LearnedPath, point: Floats, pitch: float, gripper: Floats) -> Floats:
        start, here = self._before_roll(motion.end)
        positions = path.between(here, point, self._arm.yaw_axis)
        fraction = minimum_jerk(np.linspace(0.0, 1.0, POINTS))
        before = float(self._arm.forward(start).pitch)
        arm = planar_path(self._arm, positions, before + fraction * (pitch - before), start)
        # the search has no roll: it changes evenly along the path
        arm[:, 4:] = (1.0 - fraction[:, None]) * motion.end[4:-1] + fraction[:, None] * motion.roll
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
        angles = np.array([self.arm.angle_of(opening * float(np.clip(xi / last, 0.0, 1.0))) for xi in path.opening])
        return smoothed(angles + (1.0 - fraction) * (start[-1] - angles[0]), SMOOTHING)

    def _fault(self, motion: MotionRows, rows: Floats, clearance: float, holding: bool) -> str:
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
        if touching is not None:
            return f"its {touching[0]} would touch its {touching[1]}"
        if not len(motion.standing):
            return ""
        closest = self._clearance.to_standing(checked, motion.standing, holding)
        if closest.standing is None or closest.distance >= self.options.clearance:
            return ""
        motion.in_the_way.add(closest.standing)
        where = metres(hand[closest.sample])
        return f"it would come within {1000 * closest.distance:.1f} mm of a standing object at {where}"

    # Positions

    def _begun(self, start: RestPose | None, standing: Floats) -> MotionRows:
        angles = self.base_angles if start is None else start.angles
        if angles.shape != self.base_angles.shape or not np.isfinite(angles).all():
            names = ", ".join(self.arm.joints)
            raise ValueError(f"expected a start with the angles of {names}, found {angles.tolist()}")
        check_number(standing)
        outside = np.maximum(self.lower - angles, angles - self.upper)
        if outside.max() > self.start_tolerance:
            joint, degrees = self.arm.joints[int(outside.argmax())], np.rad2deg(outside.max())
            raise NoPlanError(
                f"joint {joint} stands {degrees:.1f} deg outside its range; disarm, move it by hand, arm again"
            )
        return MotionRows([self._inside(angles)[None]], [np.zeros(1, dtype=bool)], standing=standing)

    def _finished(self, motion: MotionRows) -> PlannedMotion:
        rows = np.concatenate(motion.rows)
        phases = tuple((name, self._period * first) for name, first in motion.phases)
        times: Floats = self._period * np.arange(len(rows), dtype=np.float64)
        hand, holding = self.arm.position(rows), np.concatenate(motion.holding)
        return PlannedMotion(times, rows, hand, holding, phases, 0.0, motion.held)

    def _learned(self, path: Callable[[Floats], LearnedPath], target: Floats) -> LearnedPath:
        try:
            return path(target)
        except (UnreachablePoseError, np.linalg.LinAlgError) as error:
            raise OutOfReachError(f"the learned movement does not lead to {metres(target)}: {error}") from error

    def _grasp_pitch(self, point: Floats, preferred: float | None = None) -> float:
        """The pitch nearest to the preferred one, or else to that of the options, with which it grasps there."""
        wanted = np.deg2rad(self.options.pitch_deg) if preferred is None else preferred
        return self._poses.pitch_at(point, wanted, self._grasp_band)

    def _pitch_of_both(self, source: Floats, target: Floats | None) -> float:
        """The pitch to grasp with at `source`, if possible one that reaches `target`, or most positions, too."""
        preferred = self._grasp_pitch(source)
        if target is not None:
            return self._grasp_pitch(source, self._grasp_pitch(target, preferred))
        axis = np.array([*self._arm.yaw_axis, source[2]])
        ahead = (source - axis) / np.linalg.norm(source - axis)
        with contextlib.suppress(OutOfReachError):
            preferred = self._grasp_pitch(axis + self._usual_reach * ahead, preferred)
        return self._grasp_pitch(source, preferred)

    def _held_width(self, grasp: Grasp, askew: float) -> float:
        """A width that the gripper holds, m, as measured ones are not exact; raises MisfitError.

        Args:
            askew: Angle between fingers and sides of the object, rad: it must fit between them before it turns.
        """
        narrowest, widest = self._widths
        width = grasp.width
        if width is None:
            return self._usual_width
        across = width * np.cos(askew) + (grasp.length or width) * abs(np.sin(askew))
        if not narrowest - WIDTH_ERROR_M <= width <= across <= widest + WIDTH_ERROR_M:
            raise MisfitError(
                f"the object looks {1000 * across:.0f} mm wide as it stands; this gripper holds objects of "
                f"{1000 * narrowest:.0f} to {1000 * widest:.0f} mm"
            )
        return min(max(width, narrowest), widest)

    def _lowered(self, source: ArrayLike, grasp: Grasp) -> float:
        """How far below the height of the goal the object is to be grasped, m."""
        o, height = self.options, float(np.asarray(source, dtype=np.float64)[-1])
        if grasp.height is not None:
            return max(0.0, height - max(o.low_grasp, o.grasp_share * grasp.height))
        return max(0.0, height - o.low_grasp) if grasp.attempt % 2 == 0 else 0.0

    def _askew(self, source: ArrayLike, grasp: Grasp) -> float:
        """Angle, rad, from the fingers of the hand without roll to the object's length, or the nearest of its sides."""
        if grasp.turn is None:
            return 0.0
        x, y = np.asarray(source, dtype=np.float64)[:2] - self._arm.yaw_axis
        alike = np.pi / 2 if grasp.length is None else np.pi
        return float(np.remainder(grasp.turn - np.arctan2(y, x) + alike / 2, alike) - alike / 2)

    def _beside(self, position: ArrayLike, width: float, gap: float = 0.0, turned: float = 0.0) -> Floats:
        """The end effector when an object at `position` is so far from the face of a finger that does not move.

        Args:
            turned: Of the hand, about the vertical, after it has come there without roll, rad.
        """
        point, face = np.asarray(position, dtype=np.float64), self._fixed_finger
        if point.shape != (3,) or (face is None and turned == 0.0):
            return point
        aside = 0.0 if face is None else face - np.copysign(width / 2 + gap, face)
        ahead = (point[:2] - self._arm.yaw_axis) / max(float(np.linalg.norm(point[:2] - self._arm.yaw_axis)), 1e-9)
        left = np.array([-ahead[1], ahead[0]])
        from_roll_axis = self._arm.hand[1] * left + self._arm.hand[2] * ahead  # of a hand that points down
        rotation = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
        moved = from_roll_axis - rotation @ (aside * left + from_roll_axis)
        return np.asarray(point + np.append(moved, 0.0))

    def _before_roll(self, row: Floats) -> tuple[Floats, Floats]:
        """The arm's angles [J] of a row with roll 0, and where the end effector then is, [3]."""
        arm = row[:-1].copy()
        arm[4:] = 0.0
        return arm, self._arm.forward(arm).position

    def _above(self, point: Floats, pitch: float) -> tuple[Floats, float]:
        above = point + self.options.lift * _UP
        return above, self._poses.pitch_at(above, pitch, self._reach_band)

    def _inside(self, angles: Floats) -> Floats:
        return np.asarray(np.clip(angles, self.lower, self.upper))


@dataclass(frozen=True)
class ServoReachingOptions:
    """Sizes, m, s, m/s, deg."""

    pitch_deg: float = 90.0  # of the hand at the target: straight down
    reach_band_deg: tuple[float, float] = (-90.0, 120.0)
    grasp_band_deg: tuple[float, float] = (50.0, 110.0)  # further from straight down an open gripper strikes the object
    lift: float = 0.05  # height above an object at which learned movements end and begin
    speed: float = 0.06  # maximum, of straight lines
    learned_duration: float = 1.6  # minimum, of a learned movement
    longest_duration: float = 6.0  # where a learned movement takes longer, as joints turn far, a milder one is tried
    grasp_share: float = 0.72  # of an object's height, at which it is grasped if that is below the goal's
    low_grasp: float = 0.020  # above the table, of one of unknown height; also where an interrupted arm puts one down
    gripper_duration: float = 0.8
    settle_duration: float = 0.4  # time for the closed gripper to press
    work_opening: float = 0.6  # ξ
    second_opening: float = 0.8  # of every second attempt to grasp, and the turn of its hand from the first one's pitch
    second_turn_deg: float = 15.0
    closed_opening: float = 0.0
    clearance: float = 0.005  # of every part from the table
    carry_clearance: float = 0.02
    near: float = 0.03  # within this distance of a path's ends the hand may be as low as there
    limit_fraction: float = 0.8  # of the operating velocity, acceleration and jerk


@dataclass
class MotionRows:
    """A motion under construction: rows of joint angles, rad, among standing objects [M, 2], m."""

    rows: list[Floats]
    holding: list[NDArray[np.bool_]] = field(default_factory=list)
    phases: list[tuple[str, int]] = field(default_factory=list)
    standing: Floats = field(default_factory=lambda: NOTHING)
    in_the_way: set[int] = field(default_factory=set)
    held: Held | None = None
    roll: float = 0.0  # with which its learned movements end, rad

    @property
    def end(self) -> Floats:
        """The last row [J]."""
        return np.asarray(self.rows[-1][-1])

    def no_plan(self, message: str) -> NoPlanError:
        """The error that it cannot go on, with the standing objects that prevented a path."""
        return NoPlanError(message, frozenset(self.in_the_way))

    def add(self, name: str, rows: Floats, holding: bool) -> None:
        """Adds rows, of which the first repeats the last existing one."""
        if not self.phases or self.phases[-1][0] != name:
            self.phases.append((name, sum(map(len, self.rows)) - 1))
        self.rows.append(rows[1:])
        self.holding.append(np.full(len(rows) - 1, holding))
