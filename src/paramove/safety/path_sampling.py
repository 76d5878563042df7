"""Points of a trajectory to the rows that are streamed, one every millisecond.

Points closer than 50 ms are a densely described movement: a cubic spline through them, at rest at both ends (straight
lines where they are 2 ms apart or closer). Points further apart are via points: the arm rests at each and goes straight
to the next, so that it does not leave the straight lines that a planner has checked.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from paramove.documents import Floats

LINEAR_UP_TO_S = 0.002
DENSE_UP_TO_S = 0.050


def sample_path(times_s: Floats, positions: Floats, dt_s: float) -> Floats:
    """Rows at 0, dt, 2 dt, … up to the first at or after the last point.

    Args:
        times_s: Strictly increasing, the first 0, shape [P], P >= 2.
        positions: Shape [P, J], rad.

    Returns:
        Shape [N, J], rad; the last row is the last point.
    """
    n_rows = int(np.ceil(times_s[-1] / dt_s - 1e-9)) + 1
    row_times = np.minimum(np.arange(n_rows) * dt_s, times_s[-1])
    rows = np.empty((n_rows, positions.shape[1]))
    for first, last in runs(times_s):
        inside = (row_times >= times_s[first]) & (row_times <= times_s[last])
        rows[inside] = _run(times_s[first : last + 1], positions[first : last + 1], row_times[inside])
    return rows


def largest_detour(times_s: Floats, positions: Floats) -> tuple[int, int, float]:
    """Where the path lies furthest from the straight line between two points, at mid-segment: (segment, joint, rad)."""
    worst = (0, 0, 0.0)
    for first, last in runs(times_s):
        points = positions[first : last + 1]
        middle = 0.5 * (times_s[first:last] + times_s[first + 1 : last + 1])
        detour = np.abs(_run(times_s[first : last + 1], points, middle) - 0.5 * (points[:-1] + points[1:]))
        segment, joint = (int(i) for i in np.unravel_index(int(np.argmax(detour)), detour.shape))
        if detour[segment, joint] > worst[2]:
            worst = (first + segment, joint, float(detour[segment, joint]))
    return worst


def runs(times_s: Floats) -> list[tuple[int, int]]:
    """First and last point of each dense run and of each segment between via points, in order."""
    sparse = np.diff(times_s) > DENSE_UP_TO_S + 1e-9
    ends = [0]
    for segment in range(len(sparse)):
        if sparse[segment] or segment == len(sparse) - 1 or sparse[segment + 1]:
            ends.append(segment + 1)
    return list(pairwise(ends))


def minimum_jerk(u: Floats) -> Floats:
    """Progress 0 to 1 from rest to rest for u in 0 to 1 (Flash and Hogan 1985)."""
    return np.asarray(10 * u**3 - 15 * u**4 + 6 * u**5)


def _run(times_s: Floats, points: Floats, at_s: Floats) -> Floats:
    gaps = np.diff(times_s)
    if len(times_s) == 2 and gaps[0] > DENSE_UP_TO_S:
        u = ((at_s - times_s[0]) / gaps[0])[:, None]
        return np.asarray(points[0] + minimum_jerk(u) * (points[1] - points[0]))
    if gaps.max() <= LINEAR_UP_TO_S + 1e-9:
        segment = np.clip(np.searchsorted(times_s, at_s, side="right") - 1, 0, len(gaps) - 1)
        part = ((at_s - times_s[segment]) / gaps[segment])[:, None]
        return np.asarray((1.0 - part) * points[segment] + part * points[segment + 1])
    return np.asarray(CubicSpline(times_s, points, bc_type="clamped")(at_s))
