"""Arm poses of a person to joint angles of a robot's arm, in closed form (thesis 5.2.4).

The gripper is placed exactly; the elbow as near to the person's as the robot's proportions and joint limits allow. The
gripper site (the centre of a held cylinder) lies next to the forearm's axis; the solution includes that offset.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from paramove.documents import Floats
from paramove.motion.plans import centimetres
from paramove.motion.reaching_movement import ArmPoses
from paramove.robots import Arm, RobotDescription

# The elbow is turned on this grid, then refined by bisection to a hundredth of a step.
_TURNS = np.deg2rad(np.arange(0.0, 181.0, 1.0))
_TURNS_BOTH = np.stack([_TURNS, -_TURNS], axis=1).ravel()
_BISECTIONS = 7
_JUMP = np.deg2rad(20.0)
_MARGIN = np.deg2rad(0.3)  # inside the limits of the safety gate: paths are curves through these poses
_NEARLY_STRAIGHT = 1e-9
_X, _Y, _Z = range(3)


class UnreachablePoseError(ValueError):
    """No joint angles exist for a pose; the message names the pose and the reason."""


@dataclass(frozen=True)
class JointSolution:
    """Joint angles for a sequence of K poses.

    Attributes:
        angles: Shoulder pitch, roll, torsion, elbow, wrist, [K, 5], rad.
        elbow: The elbow that was set (q′ of 5.2.4), [K, 3], m, shoulder frame.
        elbow_turn: How far a joint limit turned the elbow about the shoulder-gripper line, [K], rad.
    """

    angles: Floats
    elbow: Floats
    elbow_turn: Floats


class ArmPoseSolver:
    """Inverse kinematics of an arm with three shoulder joints, an elbow and a wrist that twists.

    Args:
        robot: The robot's description: limits.
        arm: The arm's chain and lengths.
    """

    def __init__(self, robot: RobotDescription, arm: Arm) -> None:
        self._lower = robot.soft_lower[arm.indices] + _MARGIN
        self._upper = robot.soft_upper[arm.indices] - _MARGIN
        self._joints = arm.joints
        self._upper_arm = arm.kinematics.upper_arm
        along, aside, above = arm.kinematics.gripper_from_elbow
        if above != 0.0:
            raise ValueError(f"the gripper site lies {above} m above the hand's plane; the closed form needs 0")
        self._along, self._aside = along, aside
        self._forearm = float(np.hypot(along, aside))  # elbow to gripper site

    @property
    def length(self) -> float:
        """l = a + b, upper arm and forearm up to the gripper, m (5.2.3)."""
        return self._upper_arm + self._along

    @property
    def reach(self) -> tuple[float, float]:
        """Minimum and maximum distance of the gripper from the shoulder, m, by the elbow's limits."""
        bend = np.array([self._lower[3], min(self._upper[3], 0.0)])
        squared = self._upper_arm**2 + self._forearm**2 + 2 * self._upper_arm * self._forearm * np.cos(bend)
        return float(np.sqrt(squared[0])), float(np.sqrt(squared[1]))

    def moved_outward(self, gripper: Floats, margin: float, width: float) -> Floats:
        """A path [K, 3] with points nearer to the shoulder than the elbow can bend moved outward; the rest stays.

        No point ends nearer than `margin` beyond the smallest reach; the change begins `width` before that, m.
        """
        minimum = self.reach[0] + margin
        distance = np.linalg.norm(gripper, axis=1, keepdims=True)
        beyond = distance - minimum
        softened = np.where(beyond > width, beyond, np.clip(beyond + width, 0.0, None) ** 2 / (4.0 * width))
        return np.asarray(gripper * (minimum + softened) / distance)

    def solve(
        self,
        poses: ArmPoses,
        level: ArrayLike = 0.0,
        slope: float | None = None,
        smoothing: int = 0,
    ) -> JointSolution:
        """Joint angles that place the gripper exactly and the elbow near the one given.

        Where the elbow of 5.2.4 breaks a joint limit it is turned about the shoulder-gripper line by the smallest
        angle that breaks none. If the smallest angles of one sequence lie on both sides, the side that suits all poses
        is kept, so that the elbow never jumps.

        Args:
            poses: The person's elbow scaled to the robot, where the gripper site shall be, and the direction from index
                finger to thumb.
            level: Fraction 0 to 1, [K] or one, by which o is replaced by the direction o′ that aligns the hand to the
                table plane, thumb on the left (5.2.5).
            slope: Angle by which the forearm shall slope down, rad: by the fraction `level` the elbow is turned towards
                the nearest position with this slope, so that a held object keeps its tilt. None: as the person does.
            smoothing: Number of poses over which a turn of the elbow rises and falls; 0 for independent poses.

        Raises:
            UnreachablePoseError: A gripper point is out of reach, or no turn of the elbow keeps the joint limits.
        """
        self._check_reach(poses.gripper)
        fraction = np.broadcast_to(np.asarray(level, dtype=np.float64), len(poses))
        if slope is not None:
            poses = replace(poses, elbow=self._sloped(poses.elbow, poses.gripper, slope, fraction))
        solution = self._one_sided(poses, fraction, self._nearest(poses, fraction, _TURNS_BOTH))
        return self._smoothed(poses, fraction, solution, smoothing) if smoothing else solution

    def without_limits(self, poses: ArmPoses) -> JointSolution:
        """The closed form of 5.2.4 as it is, whether or not the joints reach it; poses as for `solve`.

        The gripper's distance from the shoulder is taken to close the triangle of the arm.
        """
        zero = np.zeros(len(poses))
        return JointSolution(*self._pose(poses, zero, zero), zero)

    def outside_limits(self, angles: Floats) -> Floats:
        """By how much each joint of angles [K, 5] lies outside the limits that `solve` keeps, rad; 0 inside."""
        return np.asarray(np.clip(self._beyond(angles), 0.0, None))

    def pressed_inside(self, angles: Floats) -> Floats:
        """A curve [K, 5] through solved poses with what overshoots their limits pressed into the margin beyond them.

        A curve overshoots where the elbow begins to turn at a limit. Joints that stay within half of the margin are
        left as they are; of the others the last two margins before the limit of the safety gate are compressed.
        """
        over = (self.outside_limits(angles) > 0.5 * _MARGIN).any(axis=0)
        room = 1.8 * _MARGIN
        low, high = self._lower + _MARGIN, self._upper - _MARGIN
        pressed = np.where(angles > high, high + room * np.tanh((angles - high) / room), angles)
        pressed = np.where(pressed < low, low + room * np.tanh((pressed - low) / room), pressed)
        return np.asarray(np.where(over, pressed, angles))

    def _smoothed(self, poses: ArmPoses, level: Floats, solution: JointSolution, smoothing: int) -> JointSolution:
        """The turn begun a little earlier and ended later, so that the elbow does not jerk; limits still hold."""
        turn = solution.elbow_turn
        if not turn.any():
            return solution
        sign = 1.0 if turn.max() >= -turn.min() else -1.0
        wider = maximum_filter1d(np.maximum(sign * turn, 0.0), 2 * smoothing + 1, mode="nearest")
        smooth = sign * gaussian_filter1d(wider, smoothing / 2.0, mode="nearest", truncate=2.0)
        ends = np.minimum(np.arange(len(turn)), np.arange(len(turn))[::-1])
        smooth = np.where(ends < smoothing, turn + np.clip(ends / smoothing, 0.0, 1.0) ** 2 * (smooth - turn), smooth)
        angles, q_set = self._pose(poses, level, smooth)
        return JointSolution(angles, q_set, smooth) if (self._excess(angles) <= 0.0).all() else solution

    def _one_sided(self, poses: ArmPoses, level: Floats, solution: JointSolution) -> JointSolution:
        turn = solution.elbow_turn
        if np.any(np.abs(np.diff(turn)) > _JUMP) and turn.min() < 0.0 < turn.max():
            one_sided = []
            for side in (1.0, -1.0):
                try:
                    one_sided.append(self._nearest(poses, level, side * _TURNS))
                except UnreachablePoseError:
                    continue
            if one_sided:
                return min(one_sided, key=lambda s: float(np.abs(s.elbow_turn).max()))
        return solution

    def _check_reach(self, r: Floats) -> None:
        minimum, maximum = self.reach
        minimum, maximum = minimum - self._aside * 0.1, maximum + 1e-9  # the offset changes the bend by up to 2.6 deg
        distance = np.linalg.norm(r, axis=1)
        bad = np.flatnonzero(~((distance >= minimum) & (distance <= maximum)))
        if bad.size:
            k = int(bad[0])
            raise UnreachablePoseError(
                f"pose {k}: gripper at {centimetres(r[k])} is {distance[k] * 100:.1f} cm from the shoulder; "
                f"the arm reaches {minimum * 100:.1f} to {maximum * 100:.1f} cm"
            )

    def _nearest(self, poses: ArmPoses, level: Floats, turns: Floats) -> JointSolution:
        """The first of `turns` (sorted by size) that breaks no limit, refined; only poses that need a turn search."""
        best = np.zeros(len(poses))
        angles, _ = self._pose(poses, level, best)
        stuck = np.flatnonzero(self._excess(angles) > 0.0)
        if stuck.size:
            some, levels = poses[stuck], level[stuck]
            excess = np.stack(
                [self._excess(self._pose(some, levels, np.full(stuck.size, turn))[0]) for turn in turns], axis=1
            )
            good = excess <= 0.0  # [K, S]
            if not good.any(axis=1).all():
                k = int(stuck[np.flatnonzero(~good.any(axis=1))[0]])
                raise UnreachablePoseError(
                    f"pose {k}: gripper at {centimetres(poses.gripper[k])} breaks {self._broken(angles[k])} "
                    "and another limit wherever the elbow is turned"
                )
            best[stuck] = self._refine(some, levels, turns[np.argmax(good, axis=1)])
        angles, q_set = self._pose(poses, level, best)
        return JointSolution(angles, q_set, best)

    def _refine(self, poses: ArmPoses, level: Floats, turn: Floats) -> Floats:
        good, bad = turn.copy(), turn - _TURNS[1] * np.sign(turn)
        for _ in range(_BISECTIONS):
            middle = 0.5 * (good + bad)
            inside = self._excess(self._pose(poses, level, middle)[0]) <= 0.0
            good, bad = np.where(inside, middle, good), np.where(inside, bad, middle)
        return good

    def _excess(self, angles: Floats) -> Floats:
        """How far the worst joint lies outside its limits, rad; not positive inside."""
        return np.asarray(self._beyond(angles).max(axis=-1))

    def _beyond(self, angles: Floats) -> Floats:
        return np.asarray(np.maximum(self._lower - angles, angles - self._upper))

    def _broken(self, angles: Floats) -> str:
        worst = int(np.argmax(self._beyond(angles)))
        low, high, angle = np.rad2deg([self._lower[worst], self._upper[worst], angles[worst]])
        return f"the limit of {self._joints[worst]} ({angle:.1f} deg, allowed {low:.1f} to {high:.1f})"

    def _pose(self, poses: ArmPoses, level: Floats, turn: Floats) -> tuple[Floats, Floats]:
        """Angles [K, 5] and elbow [K, 3] for the elbow of 5.2.4 turned by `turn` [K]."""
        r, o = poses.gripper, poses.finger_to_thumb
        q = self._elbow(poses.elbow, r, turn)
        o = o / np.maximum(np.linalg.norm(o, axis=-1, keepdims=True), _NEARLY_STRAIGHT)
        fraction = level[:, None]
        forearm, aside = self._hand(q, r, (1.0 - fraction) * o + fraction * _level(q, r))
        return _angles(q / self._upper_arm, forearm, aside), q

    def _elbow(self, q: Floats, r: Floats, turn: Floats) -> Floats:
        middle, radius, w2, w3 = self._elbow_circle(q, r)
        side = np.cos(turn)[..., None] * w2 + np.sin(turn)[..., None] * w3
        return np.asarray(middle + radius * side)  # (5.10)

    def _elbow_circle(self, q: Floats, r: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Where the elbow can be: middle [K, 3], radius [K, 1], direction w2 towards q and w3 across, [K, 3]."""
        a, b = self._upper_arm, self._forearm
        c = np.linalg.norm(r, axis=-1, keepdims=True)  # c = |r - p| with p = 0; corrected (printed |r - q|)
        w1 = r / c  # (5.11)
        w2 = q - np.sum(q * w1, axis=-1, keepdims=True) * w1  # (5.13)
        length = np.linalg.norm(w2, axis=-1, keepdims=True)
        straight_down = np.array([0.0, 0.0, -1.0])
        fallback = straight_down - np.sum(straight_down * w1, axis=-1, keepdims=True) * w1
        w2 = np.where(length > _NEARLY_STRAIGHT, w2, fallback)
        w2 = w2 / np.linalg.norm(w2, axis=-1, keepdims=True)  # (5.12)
        cos_beta = np.clip((a**2 + c**2 - b**2) / (2 * a * c), -1.0, 1.0)  # (5.8)
        return a * cos_beta * w1, a * np.sqrt(1.0 - cos_beta**2), w2, np.cross(w1, w2)

    def _sloped(self, q: Floats, r: Floats, slope: float, fraction: Floats) -> Floats:
        """The elbow turned by a fraction [K] towards the nearest position at which the forearm slopes by `slope`."""
        middle, radius, w2, w3 = self._elbow_circle(q, r)
        target_z = r[:, 2] + self._forearm * np.sin(slope)
        along, across = radius[:, 0] * w2[:, 2], radius[:, 0] * w3[:, 2]
        amplitude = np.maximum(np.hypot(along, across), _NEARLY_STRAIGHT)
        centre = np.arctan2(across, along)
        half_angle = np.arccos(np.clip((target_z - middle[:, 2]) / amplitude, -1.0, 1.0))
        turns = np.stack([centre + half_angle, centre - half_angle])
        turns = (turns + np.pi) % (2 * np.pi) - np.pi
        nearest = np.where(np.abs(turns[0]) <= np.abs(turns[1]), turns[0], turns[1])
        return self._elbow(q, r, fraction * nearest)

    def _hand(self, q: Floats, r: Floats, o: Floats) -> tuple[Floats, Floats]:
        """Unit forearm axis b and the hand's sideward axis y (towards the thumb), with r = q + along b + aside y.

        y is o made perpendicular to b, (5.22) corrected. As r - q and o span both, y follows without iteration.
        """
        d = r - q
        length = np.linalg.norm(d, axis=-1, keepdims=True)
        d = d / length
        across = o - np.sum(o * d, axis=-1, keepdims=True) * d
        norm = np.linalg.norm(across, axis=-1, keepdims=True)
        across = np.where(norm > _NEARLY_STRAIGHT, across, _level(q, r))
        across = across / np.linalg.norm(across, axis=-1, keepdims=True)
        sine = self._aside / length
        y = sine * d + np.sqrt(1.0 - sine**2) * across
        b = (length * d - self._aside * y) / self._along  # (5.23) corrected: from the robot's elbow
        return b, y


def _level(q: Floats, r: Floats) -> Floats:
    """o′ of 5.2.5: level and across the line from elbow to gripper, to the left, [K, 3]."""
    d = r - q
    level = np.stack([-d[..., 1], d[..., 0], np.zeros_like(d[..., 0])], axis=-1)
    return np.asarray(level / np.linalg.norm(level, axis=-1, keepdims=True))


def _angles(upper_arm: Floats, forearm: Floats, aside: Floats) -> Floats:
    """Joint angles from the axes of the upper arm, the forearm and the hand's side.

    Cardan angles as in (5.17)-(5.20), corrected; derived for HOAP-3's chain R_y(α1) R_z(α2) R_x(α3) R_y(α4) R_x(α5) and
    verified by its forward kinematics.
    """
    pitch = np.arctan2(-upper_arm[..., 2], upper_arm[..., 0])
    roll = np.arcsin(np.clip(upper_arm[..., 1], -1.0, 1.0))
    b = _rotated(_rotated(forearm, _Y, -pitch), _Z, -roll)
    elbow = -np.arccos(np.clip(b[..., 0], -1.0, 1.0))  # α4 = -(180° - γ°), corrected
    torsion = np.arctan2(-b[..., 1], b[..., 2])
    y = _rotated(_rotated(aside, _Y, -pitch), _Z, -roll)
    y = _rotated(_rotated(y, _X, -torsion), _Y, -elbow)
    wrist = np.arctan2(y[..., 2], y[..., 1])  # (5.21) with atan2, corrected
    return np.stack([pitch, roll, torsion, elbow, wrist], axis=-1)


def _rotated(v: Floats, axis: int, angle: Floats) -> Floats:
    """Vectors [..., 3] turned about a coordinate axis."""
    c, s = np.cos(angle), np.sin(angle)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turned = v.copy()
    turned[..., first] = c * v[..., first] - s * v[..., second]
    turned[..., second] = s * v[..., first] + c * v[..., second]
    return turned
