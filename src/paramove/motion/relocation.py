"""The relocation action: fetch an object and put it elsewhere with a learned reaching movement (thesis 5.2.5).

Approach and retreat are the synthesised movement; in between, the state T in which the gripper has reached the target
is kept and only the parameter t varies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

from paramove.documents import Floats
from paramove.motion.arm_pose import ArmPoseSolver
from paramove.motion.plans import PlannedMotion
from paramove.motion.reaching_movement import ArmPoses, ReachingMovement
from paramove.motion.timing import fade_in, largest_excess, minimum_jerk, resampled, slowed_times, soft_ends
from paramove.robots import AboveTable, Arm, DescriptionError, RobotDescription

_UP = np.array([0.0, 0.0, 1.0])
_SLOWING_ROUNDS = 6
_FINAL_SHARE = 0.93  # of the limits, reached by the finished samples at most


@dataclass(frozen=True)
class RelocationOptions:
    """Sizes of the relocation action, m, s, m/s. Where the thesis gives a number it is named."""

    before: float = 0.03  # 3 cm before the object
    aside: float = 0.008  # thesis 1 cm to the right
    grasp_aside: float = 0.004  # thesis 1 cm; the gripper site already lies next to the forearm's axis
    release_aside: float = 0.006  # 0.6 cm
    lift: float = 0.048  # thesis 1.5 cm; this much clears standing objects
    entry_height: float = 0.048  # the synthesised approach ends and the retreat begins so far above the table target
    release_height: float = 0.001
    approach_duration: float = 3.0  # about 3 s
    retreat_duration: float = 2.6
    speed: float = 0.10
    careful_speed: float = 0.05
    finger_duration: float = 0.5
    settle_duration: float = 0.3
    work_opening: float = 0.75  # ξ while approaching and leaving an object
    offer_opening: float = 0.95  # ξ while waiting for an object from somebody's hand
    closed_opening: float = 0.02  # ξ of the hand that closes on an object, which stops it earlier
    work_slope: float = 0.25  # rad; the forearm's slope while it interacts, the same everywhere: objects stay upright
    level_states: int = 12  # over so many states the hand is levelled before, and let free after, the interaction
    limit_fraction: float = 0.85  # of the arm's operating velocity and acceleration, used at most
    reach_margin: float = 0.002  # the synthesised path keeps this much outside the smallest reach of the arm
    reach_width: float = 0.012  # and begins to be moved outward from twice so much on
    turn_smoothing: float = 0.15  # s, over which a turn of the elbow rises and falls
    blend_share: float = 0.45  # part of the approach over which the robot's own base pose fades into the movement
    raise_duration: float = 1.6  # from the base pose to where a movement begins that begins above the table
    sample_period: float = 0.005


@dataclass
class Path:
    """A path under construction: samples of pose, opening and level, and where phases begin."""

    period: float
    poses: list[ArmPoses] = field(default_factory=list)
    opening: list[Floats] = field(default_factory=list)
    level: list[Floats] = field(default_factory=list)
    holding: list[NDArray[np.bool_]] = field(default_factory=list)
    phases: list[tuple[str, float]] = field(default_factory=list)

    def add(
        self, name: str, poses: ArmPoses, opening: ArrayLike, level: ArrayLike = 1.0, holding: bool = False
    ) -> None:
        n = len(poses)
        start = self.period * sum(len(p) for p in self.poses)
        if not self.phases or self.phases[-1][0] != name:
            self.phases.append((name, start))
        self.poses.append(poses)
        self.opening.append(np.broadcast_to(np.asarray(opening, dtype=np.float64), n))
        self.level.append(np.broadcast_to(np.asarray(level, dtype=np.float64), n))
        self.holding.append(np.full(n, holding))

    @property
    def end(self) -> ArmPoses:
        return self.poses[-1][-1:]


class RelocationPlanner:
    """Builds the motions of the relocation action from a converted model.

    Args:
        movement: The converted reaching movement.
        solver: Inverse kinematics of the arm.
        robot: The robot's description: base pose and operating limits.
        arm: The arm's joints and fingers.

    Raises DescriptionError for a movement that begins above a table, and an arm that has no `above_table`.

    Attributes:
        options: Sizes.
        velocity: Largest speed of the five joints and the fingers, [6], rad/s.
        acceleration: Largest acceleration of them, [6], rad/s².
        base_angles: Their base pose, [6], rad; every motion starts or ends there or where the last one ended.
    """

    def __init__(self, movement: ReachingMovement, solver: ArmPoseSolver, robot: RobotDescription, arm: Arm) -> None:
        self.movement, self.solver, self.arm = movement, solver, arm
        self.options = RelocationOptions()
        if movement.begins_above_table and arm.above_table is None:
            raise DescriptionError(
                f"the arm of {arm.joints[0]} has no above_table in its robot.yaml; this movement begins above a table"
            )
        joints = [*arm.indices, arm.fingers_index]
        self.velocity, self.acceleration = robot.operating_velocity[joints], robot.operating_acceleration[joints]
        self.base_angles = base = robot.base_pose[joints]
        self._base = self._pose_of(base[None, :5])
        self._base_opening = float((base[5] - arm.fingers_closed) / (arm.fingers_open - arm.fingers_closed))

    def fetch(self, target: Floats, entry_height: float | None = None, from_above: bool = False) -> PlannedMotion:
        """From the base pose to the object at `target`, close the hand, lift (first part of 5.2.5).

        Args:
            target: Where the gripper grasps it, [3], m, shoulder frame.
            entry_height: Height above t′ at which the synthesised movement ends; None for the options' one.
            from_above: Lower the open hand over the object instead of reaching from 3 cm before it.
        """
        t, o, path = target, self.options, self._new_path()
        before = t + o.aside * self._right(t) if from_above else self._before(t)
        grasp = t + o.grasp_aside * self._right(t)
        entry = before + (o.entry_height if entry_height is None else entry_height) * _UP
        self._approach(path, entry, o.work_opening)
        self._move(path, "lower", [before], o.speed, o.work_opening)
        self._move(path, "reach", [grasp], o.careful_speed, o.work_opening)
        self._fingers(path, "grasp", o.work_opening, o.closed_opening)
        self._move(path, "lift", [grasp + o.lift * _UP], o.careful_speed, o.closed_opening, holding=True)
        return self._finish(path)

    def deliver(
        self,
        start: Floats,
        target: Floats,
        via: Sequence[Floats] = (),
        upward: bool = False,
        opened: float | None = None,
    ) -> PlannedMotion:
        """Carry a held object from gripper position `start` over `via` to `target`, let go, back to the base pose.

        `upward` raises the open hand straight up afterwards instead of drawing it back; `opened` is its ξ then, None
        for the options' one.
        """
        o, path = self.options, self._new_path()
        self._carry(path, start, [*via, target + o.lift * _UP])
        self._move(path, "place", [target + o.release_height * _UP], o.careful_speed, o.closed_opening, holding=True)
        self._leave(path, target, o.closed_opening, upward, o.work_opening if opened is None else opened)
        return self._finish(path)

    def hold(self, start: Floats, position: Floats, via: Sequence[Floats] = ()) -> PlannedMotion:
        """Carry a held object from gripper position `start` over `via` to `position` and stay there."""
        path = self._new_path()
        self._carry(path, start, [*via, position])
        return self._finish(path)

    def leave(self, start: Floats, opening: float, upward: bool = False) -> PlannedMotion:
        """Open the hand where it is and go back to the base pose (last part of 5.2.5)."""
        path = self._new_path()
        self._stay(path, "release", start, opening)
        self._leave(path, start, opening, upward, self.options.work_opening)
        return self._finish(path)

    def offer(self, target: Floats) -> PlannedMotion:
        """Go to `target` with an open hand and stay there."""
        path = self._new_path()
        self._approach(path, target, self.options.offer_opening)
        return self._finish(path)

    def fingers(self, here: Floats, start: float, end: float) -> PlannedMotion:
        """Open or close the hand where it is."""
        path = self._new_path()
        self._stay(path, "fingers", here, start)
        self._fingers(path, "fingers", start, end)
        return self._finish(path)

    def _new_path(self) -> Path:
        return Path(self.options.sample_period)

    def _approach(self, path: Path, target: Floats, final_opening: float) -> None:
        """States 1..T of the movement for `target`, started from the base pose."""
        o = self.options
        states, opening = self.movement.approach(self.far_enough(target))
        n = len(states)
        opening = _crossfaded(np.full(n, self._base_opening), opening, n)
        level = fade_in(n, self._level_states(n))
        opening = _crossfaded(opening, np.full(n, final_opening), n)
        states = self._begun(states)
        if self.movement.begins_above_table:
            self._way_to_table(path, "approach", states[:1])
        self._synthesised(path, "approach", states, opening, level, o.approach_duration)

    def _leave(self, path: Path, target: Floats, opening: float, upward: bool, opened: float) -> None:
        o = self.options
        self._fingers(path, "release", opening, opened)
        aside = target + o.release_aside * self._right(target)
        before = aside if upward else self._before(target)
        high = self.far_enough(before + o.entry_height * _UP)
        self._move(path, "withdraw", [aside], o.careful_speed, opened)
        if not upward:
            self._move(path, "withdraw", [before], o.speed, opened)
        self._move(path, "withdraw", [high], o.speed, opened)
        states, opening_path = self.movement.retreat(high)
        n = len(states)
        opening_path = _crossfaded(np.full(n, opened), opening_path, n)
        opening_path = _crossfaded(opening_path, np.full(n, self._base_opening), n)
        level = fade_in(n, self._level_states(n))[::-1]
        values = self._begun(states[::-1])[::-1].stacked()
        fade = fade_in(n, n // 2)[::-1, None]
        states = ArmPoses.from_stacked(values + fade * (path.end.stacked()[0] - values[0]))
        self._synthesised(path, "retreat", states, opening_path, level, o.retreat_duration)
        if self.movement.begins_above_table:
            self._way_to_table(path, "retreat", states[-1:], backwards=True)

    def _level_states(self, n: int) -> int:
        """Over how many of n states the hand is levelled: all of them where people did not grasp but touch."""
        return n if self.movement.begins_above_table else self.options.level_states

    def _synthesised(
        self, path: Path, name: str, states: ArmPoses, opening: Floats, level: Floats, duration: float
    ) -> None:
        """State means in order (synthesis method D), smoothly timed from rest to rest."""
        at = np.linspace(0.0, 1.0, len(states))
        columns = np.concatenate([states.stacked(), opening[:, None], level[:, None]], axis=1)
        curve = CubicSpline(at, columns, axis=0, bc_type="clamped")
        n = max(2, round(duration / path.period))
        values = curve(soft_ends(np.arange(1, n + 1) / n))
        poses = self._outward(ArmPoses.from_stacked(values[:, :9]))
        path.add(name, poses, np.clip(values[:, 9], 0.0, 1.0), np.clip(values[:, 10], 0.0, 1.0))

    @property
    def _above_table(self) -> AboveTable:
        assert self.arm.above_table is not None  # checked when the planner is made
        return self.arm.above_table

    def _way_to_table(self, path: Path, name: str, begin: ArmPoses, backwards: bool = False) -> None:
        """From the base pose to where the movement begins, or back: no movement of people, who sit at the table."""
        o = self.options
        first = self.solver.solve(self._outward(begin)).angles[0]
        corners = np.concatenate([self.base_angles[None, :5], self._above_table.via, first[None]])
        at = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(corners, axis=0)).max(axis=1))])
        n = max(2, round(o.raise_duration / path.period))
        along = minimum_jerk((np.arange(n, 0, -1) - 1 if backwards else np.arange(1, n + 1)) / n)
        path.add(name, self._pose_of(PchipInterpolator(at / at[-1], corners)(along)), self._base_opening, 0.0)

    def far_enough(self, point: Floats) -> Floats:
        """The point moved away from the shoulder until `_outward` leaves it where it is."""
        minimum = self.solver.reach[0] + self.options.reach_margin + self.options.reach_width
        return point * max(1.0, minimum / float(np.linalg.norm(point)))

    def _outward(self, poses: ArmPoses) -> ArmPoses:
        """The same with grippers nearer to the shoulder than the elbow can bend moved outward; the rest stays."""
        o = self.options
        return replace(poses, gripper=self.solver.moved_outward(poses.gripper, o.reach_margin, o.reach_width))

    def _move(
        self, path: Path, name: str, points: Sequence[Floats], speed: float, opening: float, holding: bool = False
    ) -> None:
        """θ_T^t along straight lines of t, at rest at every point."""
        here = path.end.gripper[0]
        for point in points:
            distance = float(np.linalg.norm(point - here))
            n = max(2, int(np.ceil(1.6 * distance / speed / path.period)))
            along = minimum_jerk(np.arange(1, n + 1) / n)[:, None]
            path.add(name, self._reached(here + along * (point - here)), opening, holding=holding)
            here = point

    def _carry(self, path: Path, here: Floats, points: Sequence[Floats]) -> None:
        o = self.options
        self._stay(path, "carry", here, o.closed_opening, holding=True)
        self._move(path, "carry", points, o.speed, o.closed_opening, holding=True)

    def _stay(self, path: Path, name: str, here: Floats, opening: float, holding: bool = False) -> None:
        path.add(name, self._reached(here[None]), opening, holding=holding)

    def _fingers(self, path: Path, name: str, start: float, end: float) -> None:
        o = self.options
        n = max(2, round(o.finger_duration / path.period))
        rest = max(1, round(o.settle_duration / path.period))
        along = minimum_jerk(np.arange(1, n + 1) / n)
        opening = np.concatenate([start + along * (end - start), np.full(rest, end)])
        path.add(name, self._reached(np.repeat(path.end.gripper, n + rest, axis=0)), opening, holding=end < start)

    def _reached(self, gripper: Floats) -> ArmPoses:
        """Poses of state T in which the gripper is at the given points [K, 3]."""
        m = self.movement
        poses = m.poses_of_state(m.reach_state, m.parameter_for(m.reach_state, gripper))
        return replace(poses, gripper=gripper)

    def _right(self, target: Floats) -> Floats:
        """b′⊥ of 5.2.5: level, to the right of the forearm when the gripper is at `target`."""
        b = self._forward(target)
        return np.array([b[1], -b[0], 0.0])

    def _forward(self, target: Floats) -> Floats:
        """b′ of 5.2.5: the forearm's direction projected onto the table plane."""
        pose = self._reached(target[None])
        solution = self.solver.solve(pose, 1.0, self.options.work_slope)
        b = (pose.gripper - solution.elbow)[0] * [1.0, 1.0, 0.0]
        return np.asarray(b / np.linalg.norm(b))

    def _before(self, target: Floats) -> Floats:
        """t′ = t - 0.03 b′ + 0.01 b′⊥ of 5.2.5."""
        return target - self.options.before * self._forward(target) + self.options.aside * self._right(target)

    def _begun(self, states: ArmPoses) -> ArmPoses:
        """The movement begun where the robot can: at its base pose, which fades out, or above the table."""
        o = self.options
        if not self.movement.begins_above_table:
            return self._blended(states, self._base, o.blend_share)
        gripper = np.clip(states.gripper[:1], self._above_table.lowest, self._above_table.highest)
        return self._blended(states, replace(states[:1], gripper=gripper), 1.0)

    def _blended(self, states: ArmPoses, first: ArmPoses, fraction: float) -> ArmPoses:
        """The movement started from another pose, which fades out over the first `fraction`."""
        values = states.stacked()
        n = len(values)
        fade = 1.0 - minimum_jerk(np.clip(np.arange(n) / (fraction * (n - 1)), 0.0, 1.0))
        return ArmPoses.from_stacked(values + fade[:, None] * (first.stacked()[0] - values[0]))

    def _pose_of(self, angles: Floats) -> ArmPoses:
        """Poses of joint angles [K, 5]."""
        points = self.arm.kinematics.forward(angles)
        return ArmPoses(points.elbow, points.gripper, points.shoulder_from_hand[..., :, 1] * self.movement.o_max)

    def _finish(self, path: Path) -> PlannedMotion:
        poses = ArmPoses.from_stacked(np.concatenate([part.stacked() for part in path.poses]))
        opening, level = np.concatenate(path.opening), np.concatenate(path.level)
        smoothing = round(self.options.turn_smoothing / path.period)
        solution = self.solver.solve(poses, level, self.options.work_slope, smoothing)
        closed, opened = self.arm.fingers_closed, self.arm.fingers_open
        fingers = closed + opening * (opened - closed)
        angles = np.concatenate([solution.angles, fingers[:, None]], axis=1)
        fraction = self.options.limit_fraction
        stretched = slowed_times(angles, path.period, fraction * self.velocity, fraction * self.acceleration)
        holding = np.concatenate(path.holding).astype(np.float64)
        columns = np.concatenate([angles, poses.gripper], axis=1)
        times, values = self._sampled(stretched, columns, path.period)
        for _ in range(_SLOWING_ROUNDS):
            excess = largest_excess(values[:, :6], path.period, self.velocity, self.acceleration) / _FINAL_SHARE
            if excess <= 1.0:
                break
            stretched = 1.01 * excess * stretched
            times, values = self._sampled(stretched, columns, path.period)
        planned = path.period * np.arange(len(poses))
        phases = [(name, float(np.interp(start, planned, stretched))) for name, start in path.phases]
        return PlannedMotion(
            times=times,
            angles=values[:, :6],
            gripper=values[:, 6:],
            holding=np.interp(times, stretched, holding) > 0.5,
            phases=tuple(phases),
            elbow_turn=float(np.abs(solution.elbow_turn).max()),
        )

    def _sampled(self, times: Floats, columns: Floats, period: float) -> tuple[Floats, Floats]:
        """Joint angles and gripper positions at even times, the arm's joints within their limits."""
        even, values = resampled(times, columns, period)
        values[:, :5] = self.solver.pressed_inside(values[:, :5])
        return even, values


def _crossfaded(first: Floats, second: Floats, n: int) -> Floats:
    """From one curve of n values to another."""
    fraction = fade_in(n, n)
    return np.asarray((1.0 - fraction) * first + fraction * second)
