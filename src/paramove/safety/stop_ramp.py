"""The controlled stop: to rest along the commanded path, acceleration and jerk limited, all joints together.

The path's own time s runs slower and slower: ds/dt = 1 - 3u² + 2u³ with u = t/T, so the arm leaves its path nowhere.
|d²s/dt²| is at most 1.5/T and |d³s/dt³| at most 6/T²; T is the shortest that keeps every joint within its limits.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paramove.safety.limits import MotionLimits

FloatArray = NDArray[np.float64]


def stop_ramp(last: FloatArray, path: FloatArray, limits: MotionLimits) -> FloatArray:
    """Rows that bring the joints to rest after `last`, along `path`.

    Args:
        last: The row commanded just before the ramp, [J], rad.
        path: The rows that would follow without the stop, [N, J], rad, N >= 1, within the operating limits. Where they
            end too soon for the ramp they are continued at their last speed and kept inside the position range.
        limits: Of the joints.

    Returns:
        [M, J]; M = 0 if the path does not move.
    """
    rows = np.concatenate([last[None], path])
    speed = np.abs(np.diff(rows, axis=0)).max(axis=0) / limits.dt_s
    spare = limits.stop_acceleration - limits.acceleration  # the path itself may use the operating acceleration
    duration_s = max(float(np.max(1.5 * speed / spare)), float(np.max(np.sqrt(6.0 * speed / limits.jerk))))
    n_rows = int(np.ceil(duration_s / limits.dt_s))
    if n_rows == 0:
        return np.empty((0, len(last)))
    u = np.arange(1, n_rows + 1) / n_rows
    path_time = n_rows * (u - u**3 + 0.5 * u**4)  # in rows; ends at n_rows / 2
    needed = int(np.ceil(path_time[-1])) + 1
    if len(rows) < needed + 1:
        rows = _continued(rows, needed + 1, limits)
    whole = np.minimum(path_time.astype(int), len(rows) - 2)
    part = (path_time - whole)[:, None]
    return np.asarray((1.0 - part) * rows[whole] + part * rows[whole + 1])


def _continued(rows: FloatArray, length: int, limits: MotionLimits) -> FloatArray:
    steps = np.arange(1, length - len(rows) + 1)[:, None]
    onward = rows[-1] + steps * (rows[-1] - rows[-2])
    return np.concatenate([rows, np.clip(onward, limits.lower, limits.upper)])
