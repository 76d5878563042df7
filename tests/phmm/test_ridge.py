"""What holds the slopes of whole movements back, and what the movements of a person have in common."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from paramove.phmm.features import Monomials
from paramove.phmm.ridge import GroupOffsets, chosen_ridge, penalties, smoothed

PROPERTY = settings(max_examples=20, deadline=None, derandomize=True)
PERSONS, MOVEMENTS = 9, 10


@PROPERTY
@given(st.integers(0, 2**31), st.floats(0.0, 50.0))
def test_whitened_rows_are_those_of_generalised_least_squares(seed: int, variance: float) -> None:
    rng = np.random.default_rng(seed)
    groups = rng.integers(0, 4, 12)
    rows = rng.standard_normal((12, 3))
    offsets = GroupOffsets(groups, variance)
    covariance = np.eye(12) + variance * (groups[:, None] == groups)
    white = offsets.whitened(rows)
    assert_allclose(white.T @ white, rows.T @ np.linalg.solve(covariance, rows), rtol=1e-8, atol=1e-9)
    assert_allclose(offsets.restored(white), rows, rtol=1e-9, atol=1e-9)


@PROPERTY
@given(st.integers(0, 2**31), st.floats(0.0, 20.0))
def test_a_group_left_out_at_once_is_as_if_it_had_not_been_seen(seed: int, variance: float) -> None:
    rng = np.random.default_rng(seed)
    groups = np.sort(rng.integers(0, 4, 24))
    features = np.column_stack([np.ones(24), rng.standard_normal((24, 2))])
    y, penalty = rng.standard_normal((24, 5)), np.diag([0.0, 0.3, 0.7])
    offsets = GroupOffsets(groups, variance)
    found = offsets.residuals((offsets.whitened(y), offsets.whitened(features)), penalty)
    for group in np.unique(groups):
        own, others = groups == group, groups != group
        inverse = np.linalg.inv(np.eye(others.sum()) + variance * (groups[others][:, None] == groups[others]))
        seen = features[others]
        solved = np.linalg.solve(seen.T @ inverse @ seen + penalty, seen.T @ inverse @ y[others])
        assert_allclose(found[own], y[own] - features[own] @ solved, rtol=1e-5, atol=1e-5)


def persons(habit: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Theta (K, 1), values (K, 6) with slope 1 and a habit of each person, and who it was (K,)."""
    groups = np.repeat(np.arange(PERSONS), MOVEMENTS)
    theta = 0.5 * rng.standard_normal(PERSONS)[groups] + 0.5 * rng.standard_normal(len(groups))
    own = habit * rng.standard_normal((PERSONS, 6))[groups]
    return theta[:, None], theta[:, None] + own + 0.1 * rng.standard_normal((len(groups), 6)), groups


def misses(habit: float, seed: int) -> tuple[float, float]:
    """Root mean square errors of the slope: with groups of persons, and were their movements independent."""
    theta, values, groups = persons(habit, np.random.default_rng(seed))
    monomials = Monomials.of_degree(1, theta)
    features = monomials.at(theta)
    found = smoothed(features, monomials.degrees, values, groups)
    held = penalties(
        chosen_ridge(values, features, monomials.degrees, groups, relative=False), monomials.degrees, len(values)
    )
    plain = np.linalg.solve(features.T @ features + held, features.T @ values).T
    off = [float(np.sqrt(((one[:, 1] - monomials.scale[0]) ** 2).mean())) for one in (found, plain)]
    return off[0], off[1]


def test_habits_of_persons_are_not_taken_for_an_effect_of_theta() -> None:
    found, plain = np.mean([misses(1.0, seed) for seed in range(8)], axis=0)
    assert found < 0.7 * plain


def test_without_habits_movements_are_independent() -> None:
    found, plain = np.mean([misses(0.0, seed) for seed in range(8)], axis=0)
    assert_allclose(found, plain, rtol=0.05, atol=0.0)


def test_groups_of_one_theta_are_movements_as_others() -> None:
    """As over the demonstrator's raster: nothing tells an offset from an effect of theta."""
    rng = np.random.default_rng(0)
    theta = np.repeat(rng.uniform(-1.0, 1.0, (9, 2)), 5, axis=0)
    groups = np.repeat(np.arange(9), 5)
    monomials = Monomials.of_degree(2, theta)
    features = monomials.at(theta)
    values = features @ rng.standard_normal((len(monomials), 4)) + rng.standard_normal((9, 4))[groups]
    held = penalties(chosen_ridge(values, features, monomials.degrees, groups), monomials.degrees, len(values))
    plain = np.linalg.solve(features.T @ features + held, features.T @ values).T
    assert_array_equal(smoothed(features, monomials.degrees, values, groups), plain)
