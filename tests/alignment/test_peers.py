"""Dynamic time warping compared with dtaidistance and with stored results of dtw-python."""

import json
from typing import Any

import pytest
from dtaidistance import dtw_ndim
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from paramove.alignment import warp
from tests.alignment.dtw_python import REFERENCES, pair

PROPERTY = settings(max_examples=25, deadline=None, derandomize=True)
SEEDS = st.integers(0, 2**31)


@pytest.mark.parametrize(
    "known", json.loads(REFERENCES.read_text()), ids=lambda known: f"{known['pattern']}{known['seed']}"
)
def test_distance_and_path_are_those_of_dtw_python(known: dict[str, Any]) -> None:
    p, q = pair(known["seed"], known["n_first"], known["n_second"], known["dim"])
    ours = warp(p, q, known["pattern"])
    assert_allclose(ours.distance, known["distance"], rtol=1e-9, atol=1e-9)
    assert_array_equal(ours.first, known["first"])
    assert_array_equal(ours.second, known["second"])


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
