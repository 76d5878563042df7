"""Losses of points: filled where short, named where long, and what was seen is never changed."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from paramove.demonstrations.gaps import fill_gaps

TIME = np.arange(60) / 100.0


def cubic(coefficients):
    return np.stack([TIME**power for power in range(4)], axis=1) @ np.asarray(coefficients)


@settings(deadline=None, max_examples=50, derandomize=True)
@given(
    first=st.integers(5, 40),
    length=st.integers(1, 10),
    seed=st.integers(0, 99),
)
def test_a_cubic_path_is_filled_exactly(first, length, seed):
    path = cubic(np.random.default_rng(seed).normal(size=(4, 3)))[:, None]
    holes = path.copy()
    holes[first : first + length] = np.nan
    result, filled, left = fill_gaps(TIME, holes, ("index",), 0.1)
    assert_allclose(result, path, rtol=0.0, atol=1e-9)
    seen = np.isfinite(holes)
    assert (result[seen] == holes[seen]).all()
    assert left == []
    (gap,) = filled
    assert (gap.first, gap.end) == (first, first + length)
    assert_allclose(gap.duration, length / 100.0, rtol=1e-9)


def test_longer_losses_and_those_at_the_ends_are_left():
    path = np.zeros((60, 2, 3))
    path[:3, 0] = np.nan
    path[20:31, 1] = np.inf
    path[58:, 1] = np.nan
    result, filled, left = fill_gaps(TIME, path, ("a", "b"), 0.1)
    assert filled == []
    assert [str(gap) for gap in left] == [
        "a in frames 0-2 (it is not valid on both sides)",
        "b in frames 20-30 (0.11 s)",
        "b in frames 58-59 (it is not valid on both sides)",
    ]
    assert np.isnan(result[20:31, 1]).all()


def test_few_frames_are_filled_by_a_line():
    path = np.array([[[0.0, 0.0, 0.0]], [[np.nan] * 3], [[2.0, 4.0, -2.0]]])
    result, _, left = fill_gaps(np.array([0.0, 0.01, 0.02]), path, ("a",), 0.1)
    assert left == []
    assert_allclose(result[1, 0], [1.0, 2.0, -1.0], rtol=0.0, atol=1e-12)
