"""A whole trajectory, judged before any of it is streamed, and the rows that will be streamed if it passes.

The check of a long one takes longer than a stop may wait, so it is done in slices of a few milliseconds.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.documents import Floats
from paramove.safety.limits import MotionLimits, Violation
from paramove.safety.path_sampling import ROWS_AT_ONCE, detours, minimum_jerk, n_rows, sampled_pieces

MAX_DURATION_S = 120.0
MAX_POINTS = 24_001
"""The longest movement by points 5 ms apart."""
MAX_DETOUR = np.deg2rad(1.0)
FADE_S = 0.5


class TrajectoryRejectedError(ValueError):
    """A trajectory that will not be played.

    Attributes:
        code: "joints", "points", "times", "not_finite", "joint_limit", "start", "detour", "jump", "velocity",
            "acceleration" or "jerk".
        index: Point of the trajectory, from 0; -1 where no single point is at fault.
        joint: Name of the joint; "" where no single joint is at fault.
        requested, allowed: The value in the trajectory, and what would have passed.
    """

    def __init__(self, code: str, index: int, joint: str, requested: str, allowed: str) -> None:
        where = f" at point {index}" if index >= 0 else ""
        who = f", joint {joint}" if joint else ""
        super().__init__(f"trajectory rejected ({code}){where}{who}: requested {requested}, allowed {allowed}")
        self.code = code
        self.index = index
        self.joint = joint
        self.requested = requested
        self.allowed = allowed


@dataclass(frozen=True, eq=False)
class CheckedPath:
    """Rows [N, J] of all joints, rad, one every `dt_s`; row 0 is the commanded pose, both ends are at rest."""

    rows: Floats
    dt_s: float

    @property
    def duration_s(self) -> float:
        """From the first row to the last."""
        return (len(self.rows) - 1) * self.dt_s


def check_trajectory(
    joints: Sequence[str],
    times_s: ArrayLike,
    positions: Sequence[Sequence[float]],
    commanded: Floats,
    limits: MotionLimits,
    start_tolerance: ArrayLike,
) -> CheckedPath:
    """Check a trajectory and expand it to rows at the stream's period, all at once: see `check_in_slices`."""
    checking = check_in_slices(joints, times_s, positions, commanded, limits, start_tolerance)
    while True:
        try:
            next(checking)
        except StopIteration as end:
            path: CheckedPath = end.value
            return path


def check_in_slices(
    joints: Sequence[str],
    times_s: ArrayLike,
    positions: Sequence[Sequence[float]],
    commanded: Floats,
    limits: MotionLimits,
    start_tolerance: ArrayLike,
) -> Generator[None, None, CheckedPath]:
    """Check a trajectory and expand it to rows at the stream's period; yields between slices of a few milliseconds.

    The result is the same however many slices there are.

    Args:
        joints: Names of the joints that move; the others stay at `commanded`.
        times_s: Shape [P], s, strictly increasing, the first 0.
        positions: P lists of angles in rad, each as long as `joints`.
        commanded: The pose that the robot is commanded to hold now, [J], rad.
        limits: Of all J joints.
        start_tolerance: How far the first point may lie from `commanded`, rad, for all joints or [J]. The difference is
            faded out.

    Returns:
        The rows, when the generator ends.

    Raises:
        TrajectoryRejectedError: With the point, the joint, the requested value and what is allowed.
    """
    indices = _indices(joints, limits)
    points = yield from _points(joints, positions)
    times = _times(times_s, len(points))
    tolerance = np.broadcast_to(np.asarray(start_tolerance, dtype=np.float64), commanded.shape)[indices]
    _check_points(joints, points, indices, commanded, limits, tolerance)
    yield
    yield from _check_detours(joints, times, points)
    moving = np.empty((n_rows(times, limits.dt_s), len(joints)))
    for first, piece in sampled_pieces(times, points, limits.dt_s):
        moving[first : first + len(piece)] = piece
        yield
    fade = _fade(len(moving), limits.dt_s)
    rows = np.empty((len(moving), len(commanded)))
    for first in range(0, len(rows), ROWS_AT_ONCE):
        part = slice(first, first + ROWS_AT_ONCE)
        rows[part] = commanded
        rows[part, indices] = moving[part] + fade[part, None] * (commanded[indices] - points[0])
        yield
    yield from _check_rows(rows, times, commanded, limits)
    return CheckedPath(rows, limits.dt_s)


def _indices(joints: Sequence[str], limits: MotionLimits) -> NDArray[np.intp]:
    if not joints:
        raise TrajectoryRejectedError("joints", -1, "", "no joints", "at least one")
    for joint in joints:
        if joint not in limits.names:
            raise TrajectoryRejectedError("joints", -1, joint, "an unknown joint", ", ".join(limits.names))
        if list(joints).count(joint) > 1:
            raise TrajectoryRejectedError("joints", -1, joint, "the joint twice", "once")
    return np.array([limits.names.index(joint) for joint in joints], dtype=np.intp)


def _points(joints: Sequence[str], positions: Sequence[Sequence[float]]) -> Generator[None, None, Floats]:
    if len(positions) < 2:
        raise TrajectoryRejectedError("times", -1, "", f"{len(positions)} points", "at least 2")
    if len(positions) > MAX_POINTS:
        allowed = f"up to {MAX_POINTS}; give points further apart"
        raise TrajectoryRejectedError("points", -1, "", f"{len(positions)} points", allowed)
    points = np.empty((len(positions), len(joints)))
    for first in range(0, len(positions), ROWS_AT_ONCE):
        part = positions[first : first + ROWS_AT_ONCE]
        for index, point in enumerate(part, first):
            if len(point) != len(joints):
                raise TrajectoryRejectedError("joints", index, "", f"{len(point)} angles", f"{len(joints)}")
        points[first : first + len(part)] = [list(point) for point in part]
        yield
    bad = np.argwhere(~np.isfinite(points))
    if len(bad):
        index, column = (int(i) for i in bad[0])
        raise TrajectoryRejectedError("not_finite", index, joints[column], f"{points[index, column]}", "finite angles")
    return points


def _times(times_s: ArrayLike, n_points: int) -> Floats:
    times = np.asarray(times_s, dtype=np.float64)
    if times.shape != (n_points,):
        raise TrajectoryRejectedError("times", -1, "", f"{times.size} times", f"{n_points}, one a point")
    if not np.isfinite(times).all():
        index = int(np.argmin(np.isfinite(times)))
        raise TrajectoryRejectedError("not_finite", index, "", f"time {times[index]} s", "finite times")
    if times[0] != 0.0:
        raise TrajectoryRejectedError("times", 0, "", f"{times[0]:.6g} s", "0 s at the first point")
    steps = np.diff(times)
    if (steps <= 0).any():
        index = int(np.argmax(steps <= 0)) + 1
        requested = f"{times[index]:.6g} s after {times[index - 1]:.6g} s"
        raise TrajectoryRejectedError("times", index, "", requested, "times that increase strictly")
    if times[-1] > MAX_DURATION_S:
        raise TrajectoryRejectedError("times", n_points - 1, "", f"{times[-1]:.6g} s", f"up to {MAX_DURATION_S:g} s")
    return times


def _check_points(
    joints: Sequence[str],
    points: Floats,
    indices: NDArray[np.intp],
    commanded: Floats,
    limits: MotionLimits,
    tolerance: Floats,
) -> None:
    # A joint commanded outside its range may begin there; the rows are judged to come inward.
    held = commanded[indices]
    lower = np.rad2deg(np.minimum(limits.lower[indices], held))
    upper = np.rad2deg(np.maximum(limits.upper[indices], held))
    degrees = np.rad2deg(points)
    outside = np.argwhere((degrees < lower - 1e-6) | (degrees > upper + 1e-6))
    if len(outside):
        index, column = (int(i) for i in outside[0])
        allowed = f"{lower[column]:.4g} to {upper[column]:.4g} deg"
        raise TrajectoryRejectedError(
            "joint_limit", index, joints[column], f"{degrees[index, column]:.4g} deg", allowed
        )
    away = np.abs(points[0] - held)
    if (away > tolerance).any():
        column = int(np.argmax(np.where(away > tolerance, away, 0.0)))
        allowed = f"within {np.rad2deg(tolerance[column]):.3g} deg of the commanded {_deg(held[column])}"
        raise TrajectoryRejectedError("start", 0, joints[column], _deg(points[0, column]), allowed)


def _check_detours(joints: Sequence[str], times: Floats, points: Floats) -> Generator[None, None, None]:
    worst = (0, 0, 0.0)
    for found in detours(times, points):
        worst = max(worst, found, key=lambda one: one[2])
        yield
    segment, column, detour = worst
    if detour > MAX_DETOUR:
        allowed = f"{np.rad2deg(MAX_DETOUR):.3g} deg between points; give points closer together"
        raise TrajectoryRejectedError("detour", segment, joints[column], f"{np.rad2deg(detour):.3g} deg", allowed)


def _check_rows(rows: Floats, times: Floats, commanded: Floats, limits: MotionLimits) -> Generator[None, None, None]:
    """Of all rows, the first violation of the first rule that is broken, in the gate's order."""
    violation: Violation | None = None
    before = commanded[None]
    for first in range(0, len(rows), ROWS_AT_ONCE):
        part = rows[first : first + ROWS_AT_ONCE]
        found = limits.first_violation(part, before, rest_at_end=first + len(part) == len(rows))
        if found is not None and (violation is None or found.rank < violation.rank):
            violation = replace(found, row=first + found.row)
        before = np.concatenate([before, part])[-limits.history :]
        yield
    if violation is None:
        return
    row_time = min(violation.row * limits.dt_s, times[-1])
    index = int(np.searchsorted(times, row_time, side="left"))
    requested = f"{violation.requested:.4g} {violation.unit}"
    raise TrajectoryRejectedError(violation.code, index, violation.joint, requested, violation.allowed)


def _fade(n_rows: int, dt_s: float) -> Floats:
    """From 1 at the first row to 0 after `FADE_S` or at the last row, at rest at both ends, [N]."""
    u = np.clip(np.arange(n_rows) * dt_s / min(FADE_S, (n_rows - 1) * dt_s), 0.0, 1.0)
    return np.asarray(1.0 - minimum_jerk(u))


def _deg(angle: float) -> str:
    return f"{np.rad2deg(angle):.4g} deg"
