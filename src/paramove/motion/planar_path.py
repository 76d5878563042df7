"""Paths of the end effector to paths of a servo arm's joints, whose pitch is free on the way.

An arm of four joints reaches a point with many pitches, within bounds that change along a path. A shortest path through
all solutions at all points (a ladder graph) keeps the pitch near what is wanted and the joints from jumping.
"""

from __future__ import annotations

import numpy as np

from paramove.documents import Floats
from paramove.motion.timing import smoothed
from paramove.robots import OutOfReachError, PlanarArm

OFFSETS = np.deg2rad(5.0) * np.arange(-30, 31)
"""Of the pitch from what is wanted, among which the search chooses, rad."""
PITCHES = (-0.6 * np.pi, 0.7 * np.pi)
LARGEST_STEP = 0.6
"""rad, from one point to the next; more is a change to another posture."""
PITCH_WEIGHT = 0.02
"""Of the squared way of the pitch from what is wanted, against that of the joints from point to point."""
SMOOTHING = 4.0
"""Points over which the pitch, which the search knows in steps, is smoothed."""


class NoJointPathError(ValueError):
    """The joints cannot follow a path; the message says where."""


def planar_path(arm: PlanarArm, positions: Floats, pitches: Floats, start: Floats) -> Floats:
    """Joint angles along a path, within the limits, that begin at `start` and end with the last pitch exactly.

    Args:
        arm: Whose roll, if it has one, is 0 from the second point on.
        positions: Of the end effector, [K, 3], frame of the base, m; the first is where it is at `start`.
        pitches: Wanted ones, [K], rad; the last is kept to, the others as well as it goes.
        start: [J], rad.

    Returns:
        [K, J], rad.

    Raises:
        NoJointPathError: Points are out of reach, or only reached by another posture.
    """
    grid = pitches[1:, None] + OFFSETS
    found = arm.all_joint_angles(positions[1:, None], grid)
    found[np.abs(grid - np.clip(grid, *PITCHES)) > 0.0] = np.nan
    found[-1, OFFSETS != 0.0] = np.nan
    n_points, n_states = len(positions) - 1, found.shape[1] * found.shape[2]
    offsets = np.tile(np.repeat(OFFSETS, found.shape[2]), (n_points, 1))
    chosen = _shortest(found.reshape(n_points, n_states, -1), PITCH_WEIGHT * offsets**2, start, positions)
    rough = np.concatenate([start[None], chosen])
    return _smoothed(arm, positions, pitches, rough)


def _shortest(found: Floats, extra: Floats, start: Floats, positions: Floats) -> Floats:
    """One solution [J] of each point's [P, S, J] so that the way from `start` over all is the least."""
    before, cost, origins = start[None], np.zeros(1), []
    for number, (states, offset) in enumerate(zip(found, extra, strict=True), start=1):
        kept = np.flatnonzero(np.isfinite(states).all(axis=-1))
        if len(kept) == 0:
            raise NoJointPathError(f"no posture reaches {_metres(positions[number])}, which lies on the way")
        steps = states[kept][:, None] - before[None]
        total = cost[None] + (steps**2).sum(axis=-1)
        total[np.abs(steps).max(axis=-1) > LARGEST_STEP] = np.inf
        origin = total.argmin(axis=1)
        cost = total[np.arange(len(kept)), origin] + offset[kept]
        possible = np.isfinite(cost)
        if not possible.any():
            raise NoJointPathError(f"the joints would have to jump near {_metres(positions[number])}, on the way")
        origins.append((states[kept][possible], origin[possible]))
        before, cost = states[kept][possible], cost[possible]
    path, at = [], int(cost.argmin())
    for states, origin in reversed(origins):
        path.append(states[at])
        at = int(origin[at])
    return np.array(path[::-1])


def _smoothed(arm: PlanarArm, positions: Floats, pitches: Floats, rough: Floats) -> Floats:
    """The path with the pitch's steps taken out; where that is out of reach it stays as it was."""
    smooth = pitches + smoothed(arm.forward(rough).pitch - pitches, SMOOTHING)
    n = len(smooth)
    path = rough.copy()
    for number in range(1, n - 1):
        try:
            near = arm.joint_angles(positions[number], float(smooth[number]), near=rough[number])
        except OutOfReachError:
            continue
        if np.abs(near - rough[number]).max() < LARGEST_STEP:
            path[number] = near
    return path


def _metres(point: Floats) -> str:
    return f"({', '.join(f'{value:.3f}' for value in point)}) m"
