"""Paths of the end effector to paths of a servo arm's joints, whose pitch is free in between.

An arm of four joints reaches a point with many pitches, within bounds that change along a path. A shortest path through
all solutions at all points (a ladder graph) keeps the pitch near the requested one and the joints from jumping.
"""

from __future__ import annotations

import numpy as np

from paramove.documents import Floats
from paramove.motion.plans import metres
from paramove.motion.timing import smoothed
from paramove.robots import OutOfReachError, PlanarArm

OFFSETS = np.deg2rad(5.0) * np.arange(-30, 31)
"""Candidate offsets from the requested pitch, rad."""
PITCHES = (-0.6 * np.pi, 0.7 * np.pi)
LARGEST_STEP = 0.6
"""rad, from one point to the next; more is a change to another posture."""
PITCH_WEIGHT = 0.02
"""Weight of the squared offset of the pitch against the squared steps of the joints."""
SMOOTHING = 4.0
"""Number of points over which the pitch, which the search varies in steps, is smoothed."""


class NoJointPathError(ValueError):
    """The joints cannot follow a path; the message gives the position."""


def planar_path(arm: PlanarArm, positions: Floats, pitches: Floats, start: Floats) -> Floats:
    """Joint angles along a path, within the limits, that begin at `start` and end with the last pitch exactly.

    Args:
        arm: Whose roll, if it has one, is 0 from the second point on.
        positions: Of the end effector, [K, 3], frame of the base, m; the first is where it is at `start`.
        pitches: Requested ones, [K], rad; the last is exact, the others as close as possible.
        start: [J], rad.

    Returns:
        [K, J], rad.

    Raises:
        NoJointPathError: Points are out of reach, or only reached by another posture.
    """
    grid = pitches[1:, None] + OFFSETS
    solutions = arm.all_joint_angles(positions[1:, None], grid)
    solutions[np.abs(grid - np.clip(grid, *PITCHES)) > 0.0] = np.nan
    solutions[-1, OFFSETS != 0.0] = np.nan
    n_points, n_states = len(positions) - 1, solutions.shape[1] * solutions.shape[2]
    offsets = np.tile(np.repeat(OFFSETS, solutions.shape[2]), (n_points, 1))
    chosen = _shortest(solutions.reshape(n_points, n_states, -1), PITCH_WEIGHT * offsets**2, start, positions)
    rough = np.concatenate([start[None], chosen])
    return _smoothed(arm, positions, pitches, rough)


def _shortest(solutions: Floats, extra: Floats, start: Floats, positions: Floats) -> Floats:
    """One solution [J] of each point's [P, S, J] so that the path from `start` over all is the shortest."""
    before, cost, origins = start[None], np.zeros(1), []
    for number, (states, offset) in enumerate(zip(solutions, extra, strict=True), start=1):
        reachable = np.flatnonzero(np.isfinite(states).all(axis=-1))
        if len(reachable) == 0:
            raise NoJointPathError(f"no posture reaches {metres(positions[number])}, on the path")
        steps = states[reachable][:, None] - before[None]
        total = cost[None] + (steps**2).sum(axis=-1)
        total[np.abs(steps).max(axis=-1) > LARGEST_STEP] = np.inf
        origin = total.argmin(axis=1)
        cost = total[np.arange(len(reachable)), origin] + offset[reachable]
        possible = np.isfinite(cost)
        if not possible.any():
            place = metres(positions[number])
            raise NoJointPathError(f"the joints would have to jump near {place}, on the path, to another posture")
        origins.append((states[reachable][possible], origin[possible]))
        before, cost = states[reachable][possible], cost[possible]
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
