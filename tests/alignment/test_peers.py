"""Dynamic time warping beside dtaidistance and dtw-python."""

import numpy as np
import pytest
from dtaidistance import dtw_ndim
from dtw import dtw
from dtw.stepPattern import StepPattern as PeerPattern
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from paramove.alignment import warp
from paramove.alignment.warping import STEPS, StepPattern

PROPERTY = settings(max_examples=25, deadline=None, derandomize=True)
LENGTHS = st.integers(20, 39)
SEEDS = st.integers(0, 2**31)


def peer_pattern(pattern: StepPattern) -> PeerPattern:
    """Rows of dtw-python: number of the step, how far back in both, weight (-1: where the step comes from)."""
    rows = []
    for number, (back_in_first, back_in_second) in enumerate(STEPS[pattern], start=1):
        rows += [[number, back_in_first, back_in_second, -1], [number, 0, 0, 1]]
    return PeerPattern(np.array(rows, dtype=np.float64), "NA")


def pair(seed: int, n_first: int, n_second: int, dim: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    walks = [np.cumsum(rng.standard_normal((length, dim)), axis=0) for length in (n_first, n_second)]
    return walks[0], walks[1]


@PROPERTY
@given(SEEDS, LENGTHS, LENGTHS, st.integers(1, 21), st.sampled_from(["A", "B"]))
def test_distance_and_path_are_those_of_dtw_python(
    seed: int, n_first: int, n_second: int, dim: int, pattern: StepPattern
) -> None:
    p, q = pair(seed, n_first, n_second, dim)
    peer = dtw(p, q, dist_method="euclidean", step_pattern=peer_pattern(pattern))
    ours = warp(p, q, pattern)
    assert_allclose(ours.distance, peer.distance, rtol=1e-9, atol=1e-9)
    assert_array_equal(ours.first, peer.index1)
    assert_array_equal(ours.second, peer.index2)


@PROPERTY
@given(SEEDS, st.integers(1, 60), st.integers(1, 60), st.integers(1, 23))
def test_distance_is_that_of_dtaidistance(seed: int, n_first: int, n_second: int, dim: int) -> None:
    p, q = pair(seed, n_first, n_second, dim)
    theirs = dtw_ndim.distance(p, q, use_c=True, inner_dist="euclidean")
    assert_allclose(warp(p, q).distance, theirs, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("offset", [0.0, 1e3])
def test_sequences_that_nearly_meet_lose_no_digits(offset: float) -> None:
    p, q = pair(0, 50, 50, 21)
    q = p + 1e-9 * q
    assert_allclose(
        warp(p + offset, q + offset).distance,
        dtw_ndim.distance(p + offset, q + offset, use_c=True, inner_dist="euclidean"),
        rtol=1e-9,
        atol=0.0,
    )
