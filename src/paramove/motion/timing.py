"""Timing of sampled paths: smooth progress, and slowing down where a joint would be too fast."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from paramove.documents import Floats

PEAK_VELOCITY, PEAK_ACCELERATION = 1.875, 5.7735
"""Of `minimum_jerk`: 15/8 d/T and 10/√3 d/T² for a distance d in a time T."""
_WINDOW_S = 0.12
_ACCELERATION_ROUNDS = 6


def minimum_jerk(u: Floats) -> Floats:
    """Progress 0 to 1 from rest to rest for u in 0 to 1 (Flash and Hogan 1985)."""
    return np.asarray(u**3 * (10.0 - 15.0 * u + 6.0 * u**2))


def soft_ends(u: Floats) -> Floats:
    """Even progress with smooth ends, which keeps a movement's own timing in the middle."""
    return np.asarray(0.6 * u + 0.4 * minimum_jerk(u))


def fade_in(n: int, last: int) -> Floats:
    """0 up to the last `last` of n values, then smoothly to 1 at the end."""
    return minimum_jerk(np.clip((np.arange(n) - (n - last)) / max(1, last - 1), 0.0, 1.0))


def slowed_times(angles: Floats, period: float, velocity: Floats, acceleration: Floats) -> Floats:
    """Times of samples that were planned `period` apart, stretched where a joint would exceed its limits.

    The stretch is widened by a tenth of a second before and after, so that slowing down is itself smooth.

    Args:
        angles: [K, J], rad.
        period: s.
        velocity: Largest speed of each joint, [J], rad/s.
        acceleration: Largest acceleration of each joint, [J], rad/s².
    """
    stretch = _widened((np.abs(np.diff(angles, axis=0)) / velocity).max(axis=1) / period, period)
    for _ in range(_ACCELERATION_ROUNDS):
        steps = stretch * period
        rates = np.diff(angles, axis=0) / steps[:, None]
        excess = (np.abs(np.diff(rates, axis=0)) / (0.5 * (steps[1:] + steps[:-1]))[:, None] / acceleration).max(axis=1)
        if excess.max(initial=0.0) <= 1.0:
            break
        needed = np.sqrt(np.concatenate([excess[:1], np.maximum(excess[1:], excess[:-1]), excess[-1:]]))
        stretch = stretch * _widened(needed, period)
    return np.concatenate([[0.0], np.cumsum(stretch * period)])


def largest_excess(angles: Floats, period: float, velocity: Floats, acceleration: Floats) -> float:
    """The factor by which even samples [K, J] must be slowed to keep the limits; not above 1 if they do.

    Before and after the samples the joints rest.
    """
    rates = np.diff(angles, axis=0) / period
    rates = np.concatenate([0.0 * rates[:1], rates, 0.0 * rates[:1]])
    speed = (np.abs(rates) / velocity).max()
    change = (np.abs(np.diff(rates, axis=0)) / period / acceleration).max()
    return float(max(speed, np.sqrt(change)))


def _widened(needed: Floats, period: float) -> Floats:
    """At least 1 and at least `needed`, smooth in time."""
    window = max(1, round(_WINDOW_S / period))
    widest = maximum_filter1d(np.maximum(1.0, needed), 2 * window + 1, mode="nearest")
    return np.asarray(gaussian_filter1d(widest, window / 2.0, mode="nearest", truncate=2.0))


def resampled(times: Floats, values: Floats, period: float) -> tuple[Floats, Floats]:
    """A curve through `values` [K, J] at `times` [K], sampled every `period` and at its end."""
    n = max(1, int(np.ceil(times[-1] / period - 1e-9)))
    at = np.linspace(0.0, times[-1], n + 1)
    return np.asarray(period * np.arange(n + 1)), np.asarray(CubicSpline(times, values, axis=0)(at))


def smoothed(values: Floats, width: float) -> Floats:
    """Near the values [K, ...], with the same ends, and bent as little as possible over about `width` of them."""
    n = len(values)
    bends = np.diff(np.eye(n), 2, axis=0)
    inner = (np.eye(n) + width**4 * bends.T @ bends)[1:-1]
    right = values[1:-1] - np.tensordot(inner[:, [0, -1]], values[[0, -1]], axes=1)
    return np.concatenate([values[:1], np.linalg.solve(inner[:, 1:-1], right), values[-1:]])


def ramped(u: Floats, fraction: float = 0.25) -> Floats:
    """Even progress 0 to 1 for u in 0 to 1 that begins and ends at rest, without a jump of acceleration.

    The speed rises over the first `fraction` and falls over the last, which are at most half each.
    """
    rising, falling = np.clip(u / fraction, 0.0, 1.0), np.clip((1.0 - u) / fraction, 0.0, 1.0)
    even = np.clip(u - fraction, 0.0, 1.0 - 2.0 * fraction)
    distance = fraction * (_ramp(rising) + 0.5 - _ramp(falling)) + even
    return np.asarray(distance / (1.0 - fraction))


def _ramp(x: Floats) -> Floats:
    """Distance of a speed 3 x² - 2 x³ that rises from 0 to 1; half of the time at full speed."""
    return np.asarray(x**3 - 0.5 * x**4)


def rest_to_rest(
    knots: Floats,
    duration: float,
    period: float,
    limits: tuple[Floats, Floats, Floats],
    progress: Callable[[Floats], Floats] = minimum_jerk,
) -> Floats:
    """A curve through joint angles, sampled evenly from rest to rest, all of it slowed until the limits are kept.

    Args:
        knots: [K, J], rad, at even progress.
        duration: Minimum, s.
        period: Of the samples, s.
        limits: Largest velocity, acceleration and jerk, [J] each, rad/s, rad/s², rad/s³.
        progress: Along the knots, 0 to 1, for fractions of the duration.

    Returns:
        [N, J], rad, from the first knot to the last.
    """
    curve = CubicSpline(np.linspace(0.0, 1.0, len(knots)), knots, axis=0)
    velocity, acceleration, jerk = limits
    n = max(2, int(np.ceil(duration / period)))
    while True:
        values = np.asarray(curve(progress(np.arange(n + 1) / n)))
        resting = np.concatenate([values[:1]] * 3 + [values] + [values[-1:]] * 3)
        rough = np.abs(np.diff(resting, 3, axis=0)).max(axis=0) / period**3
        excess = max(
            largest_excess(values, period, velocity, acceleration), float(np.cbrt(rough / jerk).max(initial=0.0))
        )
        if excess <= 1.0:
            return values
        n = int(np.ceil(1.01 * excess * n))
