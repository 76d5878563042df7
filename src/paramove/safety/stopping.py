"""The controlled stop: to rest along the commanded path, acceleration and jerk limited, all joints together.

The path's own time s runs slower and slower: ds/dt = 1 - 3u² + 2u³ with u = t/T, so the arm leaves its path nowhere.
|d²s/dt²| is at most 1.5/T, its product with ds/dt at most 1/T, and |d³s/dt³| at most 6/T²; T is the shortest that keeps
every joint within its limits.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from paramove.documents import Floats
from paramove.safety.limits import MotionLimits
from paramove.safety.path_sampling import minimum_jerk


def stop_ramp(last: Floats, path: Floats, limits: MotionLimits) -> Floats:
    """Rows that bring the joints to rest after `last`, along `path`.

    Args:
        last: The row commanded just before the ramp, [J], rad.
        path: The rows that would follow without the stop, [N, J], rad, N >= 1, within the operating limits. Where they
            end too soon for the ramp they are continued at their last speed: the caller judges what comes of it.
        limits: Of the joints.

    Returns:
        [M, J]; M = 0 if the path does not move.
    """
    rows = np.concatenate([last[None], path])
    speed = np.abs(np.diff(rows, axis=0)).max(axis=0) / limits.dt_s
    if not speed.any():
        return np.empty((0, len(last)))
    n_rows = int(np.ceil(np.max(_durations(speed, limits), where=speed > 0, initial=0.0) / limits.dt_s))
    u = np.arange(1, n_rows + 1) / n_rows
    path_time = n_rows * (u - u**3 + 0.5 * u**4)  # in rows; ends at n_rows / 2
    needed = int(np.ceil(path_time[-1])) + 2
    if len(rows) < needed:
        onward = np.arange(1, needed - len(rows) + 1)[:, None]
        rows = np.concatenate([rows, rows[-1] + onward * (rows[-1] - rows[-2])])
    return np.asarray(CubicSpline(np.arange(len(rows)), rows)(path_time))


def longest_path_s(limits: MotionLimits) -> float:
    """How much of the path, in its own time, a stop from the operating velocity needs: half of its duration."""
    return 0.5 * float(_durations(limits.velocity, limits).max()) + 2 * limits.dt_s


def _durations(speed: Floats, limits: MotionLimits) -> Floats:
    # The path itself may use the operating acceleration a and jerk j. Slowing adds 1.5 v/T to the one; to the other
    # 6 v/T² + 3 a/T, which may be j again.
    spare = limits.stop_acceleration - limits.acceleration
    a, j = limits.acceleration, limits.jerk
    return np.maximum(1.5 * speed / spare, (3 * a + np.sqrt(9 * a**2 + 24 * j * speed)) / (2 * j))


def straight_move(start: Floats, goal: Floats, limits: MotionLimits) -> Floats:
    """Rows [N, J] from rest after `start` to rest at `goal`, each [J], rad: minimum jerk, as fast as allowed."""
    distance = np.abs(goal - start)
    # Peaks of the profile: velocity 15/8 d/T, acceleration 10/√3 d/T², jerk 60 d/T³.
    slowest = np.max(
        [
            1.875 * distance / limits.velocity,
            np.sqrt(5.774 * distance / limits.acceleration),
            np.cbrt(60.0 * distance / limits.jerk),
        ]
    )
    n_rows = max(1, int(np.ceil(slowest / limits.dt_s)))
    u = (np.arange(1, n_rows + 1) / n_rows)[:, None]
    return np.asarray(start + minimum_jerk(u) * (goal - start))
