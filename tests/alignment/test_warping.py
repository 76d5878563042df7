"""Dynamic time warping."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from paramove.alignment import movement_distance, warp
from paramove.alignment.warping import STEPS, StepPattern

PROPERTY = settings(max_examples=25, deadline=None, derandomize=True)


@PROPERTY
@given(st.integers(0, 2**31), st.integers(1, 30), st.sampled_from(["A", "B"]))
def test_a_sequence_aligns_with_itself(seed: int, length: int, pattern: StepPattern) -> None:
    sequence = np.random.default_rng(seed).standard_normal((length, 3))
    alignment = warp(sequence, sequence, pattern)
    assert alignment.distance == 0.0
    assert_array_equal(alignment.first, alignment.second)


@PROPERTY
@given(st.integers(0, 2**31), st.sampled_from(["A", "B"]))
def test_distance_is_the_least_of_all_paths(seed: int, pattern: StepPattern) -> None:
    rng = np.random.default_rng(seed)
    p, q = rng.standard_normal((4, 2)), rng.standard_normal((5, 2))
    cost = np.linalg.norm(p[:, None] - q[None], axis=2)
    best = np.inf
    for count in range(1, 9):
        for steps in itertools.product(STEPS[pattern].tolist(), repeat=count - 1):
            path = np.cumsum([[0, 0], *steps], axis=0)
            if tuple(path[-1]) == (3, 4) and (path <= [3, 4]).all():
                best = min(best, cost[path[:, 0], path[:, 1]].sum())
    alignment = warp(p, q, pattern)
    assert_allclose(alignment.distance, best, rtol=1e-12, atol=0.0)
    assert_allclose(cost[alignment.first, alignment.second].sum(), best, rtol=1e-12, atol=0.0)


def test_pattern_b_refuses_lengths_that_no_path_joins() -> None:
    with pytest.raises(ValueError, match=r"cannot align 10 with 25 frames.*within \[1/2, 2\]"):
        warp(np.zeros((10, 1)), np.zeros((25, 1)), "B")


def test_movement_distance_is_the_offset_of_shifted_points() -> None:
    time = np.linspace(0.0, 1.0, 100)[:, None]
    movement = np.tile(np.concatenate([time, time**2, np.zeros_like(time)], axis=1), 7)
    shifted = movement + np.tile([0.0, 0.0, 0.03], 7)
    assert_allclose(movement_distance(movement, shifted), 0.03, rtol=1e-9, atol=0.0)


def test_movement_distance_leaves_out_15_percent_at_both_ends() -> None:
    movement = np.tile(np.outer(np.arange(100.0), [1.0, 0.0, 0.0]), 7)
    aside = np.full(100, 0.03)
    aside[[15, 84]], aside[:15], aside[85:] = 0.06, 0.5, 0.5
    other = movement + np.tile(np.outer(aside, [0.0, 0.0, 1.0]), 7)
    inner = np.sqrt((68 * 0.03**2 + 2 * 0.06**2) / 70)
    assert_allclose(movement_distance(movement, other), inner, rtol=1e-9, atol=0.0)
    assert_allclose(movement_distance(movement, other, cut=0.0), np.sqrt((aside**2).mean()), rtol=1e-9, atol=0.0)


@PROPERTY
@given(st.integers(0, 2**31), st.integers(1, 40), st.integers(1, 40), st.integers(1, 9))
def test_pattern_a_measures_both_ways_alike(seed: int, n_first: int, n_second: int, dim: int) -> None:
    rng = np.random.default_rng(seed)
    p, q = rng.standard_normal((n_first, dim)), rng.standard_normal((n_second, dim))
    assert_allclose(warp(p, q).distance, warp(q, p).distance, rtol=1e-12, atol=0.0)
    if 2 * min(n_first, n_second) > max(n_first, n_second):
        assert_allclose(warp(p, q, "B").distance, warp(q, p, "B").distance, rtol=1e-12, atol=0.0)


@PROPERTY
@given(st.integers(0, 2**31), st.integers(20, 39), st.integers(20, 39), st.sampled_from(["A", "B"]))
def test_the_path_joins_the_ends_by_allowed_steps(seed: int, n_first: int, n_second: int, pattern: StepPattern) -> None:
    rng = np.random.default_rng(seed)
    p, q = rng.standard_normal((n_first, 3)), rng.standard_normal((n_second, 3))
    alignment = warp(p, q, pattern)
    path = np.stack([alignment.first, alignment.second], axis=1)
    assert_array_equal(path[0], [0, 0])
    assert_array_equal(path[-1], [n_first - 1, n_second - 1])
    allowed = {tuple(step) for step in STEPS[pattern].tolist()}
    assert {tuple(step) for step in np.diff(path, axis=0).tolist()} <= allowed
    along = np.linalg.norm(p[alignment.first] - q[alignment.second], axis=1).sum()
    assert_allclose(alignment.distance, along, rtol=1e-12, atol=0.0)


def test_what_cannot_be_aligned_is_refused_with_its_reason() -> None:
    with pytest.raises(ValueError, match=r"patterns are 'A' and 'B', found 'C'"):
        warp(np.zeros((3, 1)), np.zeros((3, 1)), "C")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="number of dimensions, found 2 and 3"):
        warp(np.zeros((3, 2)), np.zeros((3, 3)))
    with pytest.raises(ValueError, match="not finite"):
        warp(np.array([[0.0], [np.nan]]), np.zeros((2, 1)))


@pytest.mark.parametrize("count", [1, 7, 21])
def test_the_number_of_points_follows_from_the_frames(count: int) -> None:
    movement = np.random.default_rng(0).normal(size=(30, 3 * count)).cumsum(axis=0)
    shifted = movement + np.tile([0.03, 0.0, 0.0], count)
    assert_allclose(movement_distance(movement, shifted), 0.03, rtol=1e-9, atol=0.0)
    with pytest.raises(ValueError, match="give n_points"):
        movement_distance(movement, shifted, n_points=3 * count + 1)
    with pytest.raises(ValueError, match="give n_points"):
        movement_distance(movement[:, :-1], shifted[:, :-1])
