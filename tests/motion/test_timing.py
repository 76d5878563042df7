"""Timing of sampled paths: smooth ends, and no joint faster than it may be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from paramove.motion.timing import (
    fade_in,
    minimum_jerk,
    ramped,
    resampled,
    rest_to_rest,
    slowed_times,
    smoothed,
    soft_ends,
)

PERIOD = 0.005


def derivative(f, u: float, order: int) -> float:
    """Central difference; beyond the ends the value stays."""
    h = 1e-3
    at = np.clip(u + h * np.arange(-1, 2), 0.0, 1.0)
    values = f(at)
    return float((values[2] - values[0]) / (2 * h) if order == 1 else (values[2] - 2 * values[1] + values[0]) / h**2)


def test_minimum_jerk_begins_and_ends_at_rest() -> None:
    u = np.linspace(0.0, 1.0, 1001)
    progress = minimum_jerk(u)
    assert (progress[0], progress[-1]) == (0.0, 1.0)
    assert (np.diff(progress) > 0).all()
    np.testing.assert_allclose(progress + progress[::-1], 1.0, rtol=0, atol=1e-12)
    for end in (0.0, 1.0):
        assert abs(derivative(minimum_jerk, end, 1)) < 1e-5
        assert abs(derivative(minimum_jerk, end, 2)) < 0.05
    np.testing.assert_allclose(derivative(minimum_jerk, 0.5, 1), 1.875, rtol=1e-4)


def test_soft_ends_keep_the_middle_even() -> None:
    u = np.linspace(0.0, 1.0, 101)
    progress = soft_ends(u)
    assert (progress[0], progress[-1]) == (0.0, 1.0)
    assert (np.diff(progress) > 0).all()
    np.testing.assert_allclose(np.diff(progress)[0] * 100, 0.6, rtol=0, atol=0.01)


def test_fade_in_rises_over_the_last_values_alone() -> None:
    faded = fade_in(50, 12)
    assert (faded[:39] == 0).all()
    assert faded[-1] == 1.0
    assert (np.diff(faded[38:]) > 0).all()
    np.testing.assert_array_equal(fade_in(3, 1), [0.0, 0.0, 0.0])


def smooth_path(seed: int, samples: int, joints: int) -> np.ndarray:
    draw = np.random.default_rng(seed)
    knots = np.cumsum(draw.normal(0.0, 0.5, (8, joints)), axis=0)
    u = minimum_jerk(np.linspace(0.0, 1.0, samples))
    return np.asarray(CubicSpline(np.linspace(0.0, 1.0, 8), knots, axis=0)(u))


def rates(times: np.ndarray, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Greatest speed and acceleration of each joint."""
    steps = np.diff(times)[:, None]
    speeds = np.diff(angles, axis=0) / steps
    accelerations = np.diff(speeds, axis=0) / (0.5 * (steps[1:] + steps[:-1]))
    return np.abs(speeds).max(axis=0), np.abs(accelerations).max(axis=0)


@settings(deadline=None, max_examples=60, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.integers(60, 900))
def test_slowed_times_keep_speed_and_acceleration(seed: int, samples: int) -> None:
    angles = smooth_path(seed, samples, 3)
    velocity, acceleration = np.array([2.0, 3.0, 4.0]), np.array([15.0, 20.0, 60.0])
    times = slowed_times(angles, PERIOD, velocity, acceleration)
    assert times[0] == 0.0
    assert (np.diff(times) >= PERIOD - 1e-12).all()
    fastest, hardest = rates(times, angles)
    assert (fastest <= velocity * (1 + 1e-9)).all()
    assert (hardest <= acceleration * 1.02).all()


def test_a_slow_path_keeps_its_times() -> None:
    angles = 0.01 * smooth_path(1, 400, 2)
    times = slowed_times(angles, PERIOD, np.array([2.0, 2.0]), np.array([15.0, 15.0]))
    np.testing.assert_allclose(times, PERIOD * np.arange(400), rtol=0, atol=1e-9)


def test_slowing_down_is_itself_smooth_and_only_where_needed() -> None:
    slow, fast = np.full(300, 0.002), np.full(100, 0.04)
    angles = np.cumsum(np.concatenate([slow, fast, slow]))[:, None]
    times = slowed_times(angles, PERIOD, np.array([2.0]), np.array([np.inf]))
    stretch = np.diff(times) / PERIOD
    np.testing.assert_allclose(stretch[[50, -50]], 1.0, rtol=0, atol=1e-9)
    np.testing.assert_allclose(stretch[350], 4.0, rtol=1e-9)
    assert np.abs(np.diff(stretch)).max() < 0.5


@pytest.mark.parametrize("duration", [0.30, 0.3021, 0.3049])
def test_resampled_at_even_times_with_the_same_ends(duration: float) -> None:
    times = np.linspace(0.0, duration, 40) ** 1.2 / duration**0.2
    values = np.column_stack([np.sin(times), times**2])
    even, found = resampled(times, values, PERIOD)
    np.testing.assert_allclose(np.diff(even), PERIOD, rtol=0, atol=1e-12)
    assert duration - 1e-9 <= even[-1] < duration + PERIOD
    np.testing.assert_allclose(found[[0, -1]], values[[0, -1]], rtol=0, atol=1e-12)
    stretched = even * duration / even[-1]
    np.testing.assert_allclose(found, np.column_stack([np.sin(stretched), stretched**2]), rtol=0, atol=1e-4)


def test_ramped_progress_rests_at_both_ends_and_is_even_between() -> None:
    u = np.linspace(0.0, 1.0, 401)
    way = ramped(u)
    np.testing.assert_allclose(way[[0, 200, 400]], [0.0, 0.5, 1.0], rtol=0, atol=1e-12)
    speed = np.diff(way) / np.diff(u)
    np.testing.assert_allclose(speed[100:300], speed[200], rtol=1e-9, atol=0)
    assert speed.min() >= 0.0
    assert max(speed[0], speed[-1]) < 1e-3
    assert np.abs(np.diff(speed)).max() < 0.025  # no jump


def test_smoothing_keeps_the_ends_and_straight_lines() -> None:
    line = np.linspace(1.0, 3.0, 30)[:, None] * [1.0, -2.0]
    np.testing.assert_allclose(smoothed(line, 4.0), line, rtol=0, atol=1e-9)
    rough = line + np.random.default_rng(0).normal(0.0, 0.1, line.shape)
    smooth = smoothed(rough, 4.0)
    np.testing.assert_allclose(smooth[[0, -1]], rough[[0, -1]], rtol=0, atol=1e-12)
    assert np.abs(np.diff(smooth, 2, axis=0)).max() < 0.1 * np.abs(np.diff(rough, 2, axis=0)).max()


def test_from_rest_to_rest_within_velocity_acceleration_and_jerk() -> None:
    knots = np.cumsum(np.random.default_rng(1).normal(0.0, 0.2, (12, 2)), axis=0)
    limits = (np.array([1.5, 1.0]), np.array([6.0, 8.0]), np.array([200.0, 100.0]))
    rows = rest_to_rest(knots, 0.5, 0.01, limits)
    np.testing.assert_allclose(rows[[0, -1]], knots[[0, -1]], rtol=0, atol=1e-12)
    padded = np.concatenate([rows[:1]] * 3 + [rows] + [rows[-1:]] * 3)
    for order, limit in enumerate(limits, start=1):
        assert (np.abs(np.diff(padded, order, axis=0)).max(axis=0) <= limit * 0.01**order * (1 + 1e-9)).all()
    short = rest_to_rest(np.zeros((4, 2)), 0.5, 0.01, limits)
    assert len(short) == 51
