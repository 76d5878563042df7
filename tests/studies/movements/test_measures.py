import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from studies.movements.measures import auroc, covered, synthesis_errors, theta_error
from studies.movements.method import Estimate


def path(n: int = 100) -> np.ndarray:
    time = np.linspace(0.0, 1.0, n)[:, None]
    return np.concatenate([time * np.array([1.0, 0.0, 0.5]), time**2 * np.array([0.0, 0.3, 0.2])], axis=1)


def test_a_movement_against_itself() -> None:
    assert max(synthesis_errors(path(), path(), tip=1).values()) == 0.0


def test_a_shift_of_all_points_is_seen_by_every_measure() -> None:
    errors = synthesis_errors(path() + np.tile([0.0, 0.0, 0.0, 0.0, 0.03, 0.04], 1), path(), tip=1)
    assert errors["end"] == pytest.approx(5.0)
    assert errors["tip_rms"] == pytest.approx(5.0)
    assert errors["rms"] == pytest.approx(5.0 / np.sqrt(2.0))
    assert errors["dtw"] <= errors["rms"] + 1e-9


def test_the_cut_leaves_out_15_percent_at_both_ends() -> None:
    aside = np.zeros((100, 6))
    aside[:15, 2] = aside[85:, 2] = 0.02
    errors = synthesis_errors(100.0 * path() + aside, 100.0 * path(), tip=1)  # so fast that nothing is warped
    assert errors["dtw"] == pytest.approx(2.0 * np.sqrt(0.3 / 2.0))
    assert errors["dtw_cut"] == 0.0
    aside[15, 2] = 0.02
    assert synthesis_errors(100.0 * path() + aside, 100.0 * path(), tip=1)["dtw_cut"] > 0.0


def test_warping_forgives_another_pace() -> None:
    slow = path()[np.round(99 * np.linspace(0, 1, 100) ** 2).astype(int)]
    errors = synthesis_errors(slow, path(), tip=1)
    assert errors["dtw"] < 0.2 * errors["rms"]


def test_angles_between_directions() -> None:
    assert theta_error(np.array([0.1, 0.0]), np.array([0.0, 0.0]), "direction") == pytest.approx(np.degrees(0.1))
    assert theta_error(np.array([np.pi, 0.0]), np.array([-np.pi, 0.0]), "direction") == pytest.approx(0.0, abs=1e-5)


def test_distances_of_places() -> None:
    assert theta_error(np.array([0.03, 0.04, 0.0]), np.zeros(3), "place") == pytest.approx(5.0)
    assert theta_error(np.array([0.1, 0.2]), np.zeros(2), "raster") == pytest.approx(10.0)


def test_a_right_covariance_covers_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    covariance = np.array([[0.04, 0.01], [0.01, 0.09]])
    drawn = rng.multivariate_normal(np.zeros(2), covariance, size=4000)
    share = np.mean([covered(Estimate(theta, covariance), np.zeros(2)) for theta in drawn])
    assert share == pytest.approx(0.95, abs=0.012)


def test_no_covariance_no_coverage() -> None:
    assert covered(Estimate(np.zeros(2), None), np.zeros(2)) is None
    assert covered(Estimate(np.zeros(2), np.zeros((2, 2))), np.ones(2)) == 0.0


@settings(deadline=None, max_examples=30, derandomize=True)
@given(st.lists(st.integers(0, 5), min_size=1, max_size=8), st.lists(st.integers(0, 5), min_size=1, max_size=8))
def test_auroc_counts_pairs(genuine: list[int], others: list[int]) -> None:
    pairs = [1.0 if a > b else 0.5 if a == b else 0.0 for a in genuine for b in others]
    assert_allclose(auroc(np.array(genuine, float), np.array(others, float)), np.mean(pairs), rtol=0, atol=1e-12)
