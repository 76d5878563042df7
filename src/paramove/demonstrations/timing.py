"""Movements in time: brought to a frame rate, and cut by one absolute rule for the speed of the fingertip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from paramove.demonstrations.frame_times import check_stretch, is_uneven, period_of
from paramove.demonstrations.movement import DemonstrationError, Movement, at_times
from paramove.documents import Floats

FINGERTIP = "index"
SLOW, FAST = 0.03, 0.15
"""m/s. A movement begins with the first frame above the one before it exceeds the other (`fast_parts`)."""
SPEED_WINDOW = 0.2
"""s. Speeds come from parabolas through this much of the path, so that markers' noise does not count as movement."""


def resampled(movement: Movement, rate_hz: float) -> Movement:
    """The movement at `rate_hz` frames a second, by cubic splines; it may end up to one new frame earlier.

    A movement that has these frame times already is returned as it is. Where the times are uneven, the splines are
    monotone between neighbours (PCHIP; Fritsch and Carlson 1980), so that a wrong time cannot make them overshoot.

    Raises ValueError for a rate that is not positive, DemonstrationError if fewer than 2 frames would be left, or far
    more than there are.
    """
    if not rate_hz > 0.0 or not np.isfinite(rate_hz):
        raise ValueError(f"a positive, finite frame rate expected, found {rate_hz}")
    count = int(np.floor(movement.duration * rate_hz + 1e-6)) + 1
    if count < 2:
        raise DemonstrationError(
            f"{movement.source}: {movement.duration:g} s are less than two frames at {rate_hz:g} Hz; "
            "choose a higher rate or a longer segment"
        )
    check_stretch(len(movement.time), count, movement.source)
    time: Floats = np.arange(count) / rate_hz
    if count == len(movement.time) and np.allclose(time, movement.time, rtol=0.0, atol=1e-8):
        return movement
    from scipy.interpolate import PchipInterpolator, make_interp_spline  # a third of a second, for a new rate only

    inside = np.minimum(time, movement.time[-1])
    if is_uneven(movement.time):
        return replace(movement, time=time, positions=PchipInterpolator(movement.time, movement.positions)(inside))
    degree = min(3, len(movement.time) - 1)
    spline = make_interp_spline(movement.time, movement.positions, k=degree)
    return replace(movement, time=time, positions=spline(inside))


def speeds(movement: Movement, point: str = FINGERTIP) -> Floats:
    """Speed of a point in each frame. Shape (T,), m/s; independent of the coordinate frame."""
    from scipy.signal import savgol_filter  # half a second, which only those who ask for speeds should wait

    path = movement.point(point)
    period = period_of(movement.time)
    count = int(np.floor(movement.duration / period + 1e-6)) + 1
    check_stretch(len(movement.time), count, movement.source)
    even = np.arange(count, dtype=np.float64) * period  # the filter needs equal steps, recordings may have others
    spaced = at_times(even, movement.time, path)
    window = min(2 * round(0.5 * SPEED_WINDOW / period) + 1, count - 1 + count % 2)
    if window < 3:
        velocity: Floats = np.asarray(np.gradient(spaced, period, axis=0), dtype=np.float64)
    else:
        velocity = savgol_filter(spaced, window, min(2, window - 1), deriv=1, delta=period, axis=0)
    magnitude = np.linalg.norm(velocity, axis=1)
    result: Floats = np.interp(movement.time, even, magnitude)
    return result


def fast_parts(speed: Floats) -> list[tuple[int, int]]:
    """Movements in speeds (T,), m/s: first frame and one past the last of each; the same rule for all actions.

    Each begins with the first frame above `SLOW` before the speed exceeds `FAST`, and ends with the last one before it
    falls to `SLOW`.
    """
    parts: list[tuple[int, int]] = []
    begin = 0
    for quick in np.flatnonzero(speed > FAST).tolist():
        if quick < begin:
            continue
        still = np.flatnonzero(speed[begin:quick] <= SLOW)
        after = np.flatnonzero(speed[quick:] <= SLOW)
        first = begin + int(still[-1]) + 1 if still.size else begin
        begin = quick + int(after[0]) if after.size else len(speed)
        parts.append((first, begin))
    return parts


def cut_by_speed(movement: Movement, point: str = FINGERTIP, *, end: bool = False) -> Movement:
    """The movement from its first frame above `SLOW` on; with `end` also only to the last one, after the last `FAST`.

    From frame 0 if the point is never at rest before. Raises DemonstrationError if it never exceeds `FAST`.
    """
    speed = speeds(movement, point)
    parts = fast_parts(speed)
    if not parts:
        raise DemonstrationError(
            f"{movement.source}: {point} never exceeds {FAST * 100:g} cm/s (its largest speed is "
            f"{speed.max() * 100:.1f} cm/s): this is no movement, or the unit is wrong"
        )
    inside = slice(parts[0][0], parts[-1][1] if end else None)
    time = movement.time[inside]
    return replace(movement, time=time - time[:1], positions=movement.positions[inside])
