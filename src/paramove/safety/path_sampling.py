"""Points of a trajectory to the rows that are streamed, one every millisecond.

Points closer than 50 ms are a densely described movement: a cubic spline through them, at rest at both ends (straight
lines where they are 2 ms apart or closer). Points further apart are via points: the arm rests at each and goes straight
to the next, so that it does not leave the straight lines that a planner has checked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from paramove.documents import Floats

LINEAR_UP_TO_S = 0.002
DENSE_UP_TO_S = 0.050
ROWS_AT_ONCE = 1000
"""Of a piece, which takes a millisecond or two: a path of two minutes has 120 times as many."""


def sample_path(times_s: Floats, positions: Floats, dt_s: float) -> Floats:
    """Rows at 0, dt, 2 dt, … up to the first at or after the last point.

    Args:
        times_s: Strictly increasing, the first 0, shape [P], P >= 2.
        positions: Shape [P, J], rad.

    Returns:
        Shape [N, J], rad; the last row is the last point.
    """
    rows = np.empty((n_rows(times_s, dt_s), positions.shape[1]))
    for first, piece in sampled_pieces(times_s, positions, dt_s):
        rows[first : first + len(piece)] = piece
    return rows


def n_rows(times_s: Floats, dt_s: float) -> int:
    """Number of rows of `sample_path`."""
    return int(np.ceil(times_s[-1] / dt_s - 1e-9)) + 1


def sampled_pieces(times_s: Floats, positions: Floats, dt_s: float) -> Iterator[tuple[int, Floats]]:
    """The rows of `sample_path` in pieces: index of the first row, and up to `ROWS_AT_ONCE` rows [N, J], rad.

    A row at a point between two runs is in the pieces of both; the later one counts.
    """
    row_times = np.minimum(np.arange(n_rows(times_s, dt_s)) * dt_s, times_s[-1])
    for first, last in runs(times_s):
        begin = int(np.searchsorted(row_times, times_s[first], side="left"))
        end = int(np.searchsorted(row_times, times_s[last], side="right"))
        path = _run(times_s[first : last + 1], positions[first : last + 1])
        for start in range(begin, end, ROWS_AT_ONCE):
            yield start, path(row_times[start : min(start + ROWS_AT_ONCE, end)])


def largest_detour(times_s: Floats, positions: Floats) -> tuple[int, int, float]:
    """Where the path lies furthest from the straight line between two points, at mid-segment: (segment, joint, rad)."""
    worst = (0, 0, 0.0)
    for detour in detours(times_s, positions):
        worst = max(worst, detour, key=lambda one: one[2])
    return worst


def detours(times_s: Floats, positions: Floats) -> Iterator[tuple[int, int, float]]:
    """Of each run of `runs`, where its path lies furthest from the straight line between two points: see there."""
    for first, last in runs(times_s):
        points = positions[first : last + 1]
        middle = 0.5 * (times_s[first:last] + times_s[first + 1 : last + 1])
        path = _run(times_s[first : last + 1], points)
        detour = np.abs(path(middle) - 0.5 * (points[:-1] + points[1:]))
        segment, joint = (int(i) for i in np.unravel_index(int(np.argmax(detour)), detour.shape))
        yield first + segment, joint, float(detour[segment, joint])


def runs(times_s: Floats) -> list[tuple[int, int]]:
    """First and last point of each dense run and of each segment between via points, in order."""
    sparse = np.diff(times_s) > DENSE_UP_TO_S + 1e-9
    is_end = np.append(sparse[:-1] | sparse[1:], True)
    ends = [0, *(np.flatnonzero(is_end) + 1).tolist()]
    return list(pairwise(ends))


def minimum_jerk(u: Floats) -> Floats:
    """Progress 0 to 1 from rest to rest for u in 0 to 1 (Flash and Hogan 1985)."""
    return np.asarray(10 * u**3 - 15 * u**4 + 6 * u**5)


def _run(times_s: Floats, points: Floats) -> Callable[[Floats], Floats]:
    """The path of one run: times [N], s, to rows [N, J], rad."""
    gaps = np.diff(times_s)
    if len(times_s) == 2 and gaps[0] > DENSE_UP_TO_S:
        return lambda at_s: _from_rest_to_rest(times_s, points, at_s)
    if gaps.max() <= LINEAR_UP_TO_S + 1e-9:
        return lambda at_s: _straight_lines(times_s, points, at_s)
    spline = CubicSpline(times_s, points, bc_type="clamped")
    return lambda at_s: np.asarray(spline(at_s))


def _from_rest_to_rest(times_s: Floats, points: Floats, at_s: Floats) -> Floats:
    u = ((at_s - times_s[0]) / (times_s[1] - times_s[0]))[:, None]
    return np.asarray(points[0] + minimum_jerk(u) * (points[1] - points[0]))


def _straight_lines(times_s: Floats, points: Floats, at_s: Floats) -> Floats:
    gaps = np.diff(times_s)
    segment = np.clip(np.searchsorted(times_s, at_s, side="right") - 1, 0, len(gaps) - 1)
    part = ((at_s - times_s[segment]) / gaps[segment])[:, None]
    return np.asarray((1.0 - part) * points[segment] + part * points[segment + 1])
