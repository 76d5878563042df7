"""Points to rows: where they rest, where they go straight, and how far they leave the straight line."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.safety.path_sampling import largest_detour, runs, sample_path


@pytest.mark.parametrize(
    ("gaps", "expected"),
    [
        ([0.05], [(0, 1)]),
        ([0.06], [(0, 1)]),
        ([0.01, 0.01, 0.05], [(0, 3)]),
        ([0.06, 0.01, 0.01, 0.06], [(0, 1), (1, 3), (3, 4)]),
        ([0.01, 0.06, 0.06, 0.01, 0.01], [(0, 1), (1, 2), (2, 3), (3, 5)]),
        ([0.01, 0.01, 0.01, 0.06], [(0, 3), (3, 4)]),
    ],
)
def test_runs_end_where_a_gap_is_longer_than_50_ms(gaps: list[float], expected: list[tuple[int, int]]) -> None:
    assert runs(np.concatenate([[0.0], np.cumsum(gaps)])) == expected


def test_points_2_ms_apart_are_joined_by_straight_lines() -> None:
    times = 0.002 * np.arange(41)
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (41, 2))
    rows = sample_path(times, points, 0.001)
    np.testing.assert_allclose(rows[::2], points, rtol=0, atol=1e-9)
    np.testing.assert_allclose(rows[1::2], 0.5 * (points[:-1] + points[1:]), rtol=0, atol=1e-9)


def test_a_dense_run_begins_and_ends_at_rest() -> None:
    times = 0.01 * np.arange(11)
    rows = sample_path(times, times[:, None], 0.001)
    assert rows.shape == (101, 1)
    steps = np.diff(rows[:, 0]) / 0.001
    assert 0.0 < steps[0] < 0.5
    assert 0.0 < steps[-1] < 0.5
    np.testing.assert_allclose(steps[45:55], 1.0, rtol=0, atol=0.02)


def test_two_points_50_ms_apart_are_still_dense() -> None:
    rows = sample_path(np.array([0.0, 0.05]), np.array([[0.0], [1.0]]), 0.001)
    u = np.arange(51) / 50
    np.testing.assert_allclose(rows[:, 0], 3 * u**2 - 2 * u**3, rtol=0, atol=1e-9)


def test_via_points_leave_the_straight_line_nowhere() -> None:
    assert largest_detour(np.array([0.0, 1.0, 2.0]), np.array([[0.0, 0.0], [1.0, -1.0], [0.0, 3.0]]))[2] < 1e-12


def test_where_nothing_moves_the_first_segment_and_joint_are_named_with_no_detour() -> None:
    assert largest_detour(np.array([0.0, 1.0, 2.0]), np.zeros((3, 2))) == (0, 0, 0.0)


def test_the_largest_detour_is_named_by_its_segment_and_joint() -> None:
    times = np.concatenate([[0.0], np.cumsum([1.0, 0.02, 0.02, 0.02, 0.02, 0.02, 1.0])])
    points = np.zeros((8, 3))
    points[5:, 1] = 1.0  # a step from point 4 to point 5, that the spline overshoots before and after
    segment, joint, detour = largest_detour(times, points)
    assert (segment, joint) == (3, 1)
    at = sample_path(times, points, 0.01)[round((times[3] + 0.01) / 0.01), 1]
    np.testing.assert_allclose(detour, abs(at), rtol=0, atol=1e-9)
    assert detour > 0.05
