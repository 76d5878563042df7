"""Movements in time: brought to a frame rate, and cut by one absolute rule for the speed of the fingertip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from paramove.demonstrations.movement import DemonstrationError, Movement
from paramove.documents import Floats

FINGERTIP = "index"
SLOW, FAST = 0.03, 0.15
"""m/s. A movement begins with the first frame above the one before it exceeds the other."""
SPEED_WINDOW = 0.2
"""s. Speeds come from parabolas through this much of the path, so that markers' noise does not count as movement."""


def resampled(movement: Movement, rate_hz: float) -> Movement:
    """The movement at `rate_hz` frames a second, by cubic splines; it may end up to one new frame earlier.

    A movement that has these frame times already is returned as it is. Raises ValueError for a rate that is not
    positive, DemonstrationError if fewer than 2 frames would be left.
    """
    if not rate_hz > 0.0 or not np.isfinite(rate_hz):
        raise ValueError(f"a positive, finite frame rate expected, found {rate_hz}")
    count = int(np.floor(movement.duration * rate_hz + 1e-6)) + 1
    if count < 2:
        raise DemonstrationError(
            f"{movement.source}: {movement.duration:g} s are less than two frames at {rate_hz:g} Hz; "
            "choose a higher rate or a longer segment"
        )
    time: Floats = np.arange(count) / rate_hz
    if count == len(movement.time) and np.allclose(time, movement.time, rtol=0.0, atol=1e-8):
        return movement
    from scipy.interpolate import make_interp_spline  # a third of a second, which only a new rate should cost

    inside = np.minimum(time, movement.time[-1])
    degree = min(3, len(movement.time) - 1)
    spline = make_interp_spline(movement.time, movement.positions, k=degree)
    return replace(movement, time=time, positions=spline(inside))


def speeds(movement: Movement, point: str = FINGERTIP) -> Floats:
    """Speed of a point in each frame. Shape (T,), m/s; independent of the coordinate frame."""
    from scipy.signal import savgol_filter  # half a second, which only those who ask for speeds should wait

    path = movement.point(point)
    period = float(np.median(np.diff(movement.time)))
    count = int(np.floor(movement.duration / period + 1e-6)) + 1
    even = np.arange(count) * period  # the filter needs equal steps, recordings may have others
    spaced = np.stack([np.interp(even, movement.time, path[:, axis]) for axis in range(3)], axis=-1)
    window = min(2 * round(0.5 * SPEED_WINDOW / period) + 1, count - 1 + count % 2)
    if window < 3:
        velocity: Floats = np.asarray(np.gradient(spaced, period, axis=0), dtype=np.float64)
    else:
        velocity = savgol_filter(spaced, window, min(2, window - 1), deriv=1, delta=period, axis=0)
    magnitude = np.linalg.norm(velocity, axis=1)
    result: Floats = np.interp(movement.time, even, magnitude)
    return result


def onset(movement: Movement, point: str = FINGERTIP, slow: float = SLOW, fast: float = FAST) -> int:
    """The first frame above `slow` before the point exceeds `fast`, m/s: the same rule for all actions.

    Frame 0 if the point is never at rest before. Raises DemonstrationError if it never exceeds `fast`.
    """
    speed = speeds(movement, point)
    quick = np.flatnonzero(speed > fast)
    if not quick.size:
        raise DemonstrationError(
            f"{movement.source}: {point} never exceeds {fast * 100:g} cm/s (its largest speed is "
            f"{speed.max() * 100:.1f} cm/s): this is no movement, or the unit is wrong"
        )
    still = np.flatnonzero(speed[: quick[0]] <= slow)
    return int(still[-1]) + 1 if still.size else 0


def cut_by_speed(
    movement: Movement, point: str = FINGERTIP, slow: float = SLOW, fast: float = FAST, *, end: bool = False
) -> Movement:
    """The movement from its onset on; with `end` also only to the last frame above `slow` after the last above `fast`.

    Raises DemonstrationError as `onset` does.
    """
    first = onset(movement, point, slow, fast)
    last = len(movement.time)
    if end:
        speed = speeds(movement, point)
        after = int(np.flatnonzero(speed > fast)[-1])
        still = np.flatnonzero(speed[after:] <= slow)
        last = after + int(still[0]) if still.size else last
    return part(movement, first, last)


def part(movement: Movement, first: int, end: int) -> Movement:
    """Frames from `first` to before `end`; time begins at 0 again."""
    time = movement.time[first:end]
    return replace(movement, time=time - time[:1], positions=movement.positions[first:end])
