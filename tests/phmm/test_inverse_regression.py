"""Regression of theta on the last frame, stacked with the model's estimate: weights, honest errors, noise, persons."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.phmm.adaptation import Adaptation
from paramove.phmm.features import Monomials
from paramove.phmm.inverse_regression import InverseRegression
from paramove.phmm.left_out import LeftOut

COUNT, POINTS = 60, 4
FOLDS = [np.arange(fold, COUNT, 6) for fold in range(6)]


def recorded(end_noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two frames of four points each; the third one ends at theta. Also theta (K, 2) and what makes the last frame."""
    rng = np.random.default_rng(seed)
    theta = rng.uniform(-0.3, 0.3, (COUNT, 2))
    frames = rng.standard_normal((COUNT, 2, POINTS, 3))
    frames[:, 1, 2, :2] = theta + end_noise * rng.standard_normal((COUNT, 2))
    y = frames.reshape(COUNT, -1)
    return y, np.eye(y.shape[1])[:, -3 * POINTS :], theta


def found_with(deviation: float, theta: np.ndarray, seed: int = 1) -> LeftOut:
    missed = deviation * np.random.default_rng(seed).standard_normal(theta.shape)
    covariances = np.tile(deviation**2 * np.eye(2), (len(theta), 1, 1))
    return LeftOut(missed, covariances, np.ones(len(theta)))


def stacked(
    model: float, end: float, seed: int = 0, scale: float = 1.0
) -> tuple[InverseRegression, LeftOut, np.ndarray, np.ndarray]:
    y, last, theta = recorded(end, seed)
    inverse, (both,) = InverseRegression.stacked(scale * y, last, theta, [(FOLDS, found_with(model, theta))])
    return inverse, both, y, theta


@pytest.mark.parametrize(("model", "end", "low", "high"), [(0.1, 0.002, 0.95, 1.0), (0.002, 0.1, 0.0, 0.05)])
def test_what_is_better_has_the_weight(model: float, end: float, low: float, high: float) -> None:
    inverse, _, _, _ = stacked(model, end)
    assert low <= inverse.weight <= high


@pytest.mark.parametrize("seed", range(5))
def test_together_they_miss_less_than_either_and_predict_by_how_much(seed: int) -> None:
    inverse, both, y, theta = stacked(0.02, 0.02, seed)
    alone, _, _, _ = stacked(1e3, 0.02, seed)
    own = np.sqrt((found_with(0.02, theta).missed ** 2).mean())
    by_end = np.sqrt(((alone.combined(y, theta, np.zeros((COUNT, 2, 2)))[0] - theta) ** 2).mean())
    assert np.sqrt((both.missed**2).mean()) < min(own, by_end)
    assert 0.6 < both.squares.mean() / 2.0 < 1.6
    assert 0.3 < inverse.weight < 0.7


def test_left_out_errors_are_those_of_a_regression_of_the_others() -> None:
    y, last, theta = recorded(0.02)
    last = last[:, 6:9]  # of one point alone, so its weight is 1
    _, (both,) = InverseRegression.stacked(y, last, theta, [(FOLDS, found_with(1e6, theta))])
    for tested in FOLDS:
        others = np.setdiff1d(np.arange(COUNT), tested)
        kept = [np.flatnonzero(np.isin(others, fold)) for fold in FOLDS if fold is not tested]
        alone = InverseRegression.stacked(y[others], last, theta[others], [(kept, found_with(1e6, theta[others]))])[0]
        found = alone.combined(y[tested], theta[tested], np.zeros((len(tested), 2, 2)))[0]
        assert_allclose(both.missed[tested], found - theta[tested], atol=1e-4)


def test_a_component_that_never_varies_does_not_choose_the_weights() -> None:
    y, last, theta = recorded(0.02)
    model = found_with(0.02, theta)
    alone, _ = InverseRegression.stacked(y, last, theta, [(FOLDS, model)])
    height = np.full((COUNT, 1), 0.07)
    missed = np.concatenate([model.missed, 0.01 * np.ones((COUNT, 1))], axis=1)
    flat = LeftOut(missed, np.tile(0.02**2 * np.eye(3), (COUNT, 1, 1)), model.distances)
    inverse, (both,) = InverseRegression.stacked(y, last, np.hstack([theta, height]), [(FOLDS, flat)])
    assert_allclose(inverse.weight, alone.weight, rtol=1e-9)
    assert np.isfinite(both.squares).all()
    assert (np.linalg.eigvalsh(inverse.covariance) > 0.0).all()


def test_the_unit_of_frames_does_not_matter() -> None:
    metres, _, y, theta = stacked(0.02, 0.02)
    millimetres, _, _, _ = stacked(0.02, 0.02, scale=1000.0)
    none = np.zeros((COUNT, 2, 2))
    assert_allclose(millimetres.combined(1000.0 * y, theta, none)[0], metres.combined(y, theta, none)[0], atol=1e-9)


def test_frames_that_are_no_points_count_as_a_whole() -> None:
    theta = np.random.default_rng(2).uniform(size=(COUNT, 1))
    y = np.concatenate([theta, -2.0 * theta, np.ones((COUNT, 2))], axis=1)
    model = LeftOut(np.full((COUNT, 1), 0.1), np.full((COUNT, 1, 1), 0.01), np.ones(COUNT))
    inverse, _ = InverseRegression.stacked(y, np.eye(4), theta, [(FOLDS, model)])
    found, covariances = inverse.combined(y, theta + 0.1, np.full((COUNT, 1, 1), 0.01))
    assert_allclose(found, theta, atol=0.002)
    assert (covariances > 0.0).all()


def test_noise_of_the_last_frame_takes_weight_and_widens() -> None:
    inverse, _, y, _ = stacked(0.02, 0.02)
    noisy = inverse.widened(0.05**2 * np.eye(y.shape[1]))
    assert noisy.weight < 0.5 * inverse.weight
    assert (np.linalg.eigvalsh(noisy.covariance - inverse.covariance) >= 0.0).all()


def test_a_person_who_ends_elsewhere_is_followed() -> None:
    inverse, _, y, theta = stacked(0.1, 0.01)
    beside = y.copy()
    beside[:, -6] += 0.1  # x of the third point in the last frame
    own = inverse.adapted(beside[:5], theta[:5], Adaptation.of(Monomials.of_degree(1, theta), theta[:5]))
    zeros = np.zeros((COUNT, 2, 2))
    before = inverse.combined(beside, theta, zeros)[0] - theta
    after = own.combined(beside, theta, zeros)[0] - theta
    assert np.abs(after[:, 0].mean()) < 0.4 * np.abs(before[:, 0].mean())


def test_what_was_learned_comes_back_and_other_shapes_do_not() -> None:
    inverse, _, y, _ = stacked(0.02, 0.02)
    again = InverseRegression.from_array(inverse.array(), y.shape[1], 2)
    assert again.weight == inverse.weight
    assert np.array_equal(again.gains, inverse.gains)
    assert np.array_equal(again.offset, inverse.offset)
    assert np.array_equal(again.covariance, inverse.covariance)
    with pytest.raises(ValueError, match=r"shape \(2, 29\)"):
        InverseRegression.from_array(inverse.array(), y.shape[1] + 1, 2)
    spoilt = inverse.array()
    spoilt[0, -1] = 1.2
    with pytest.raises(ValueError, match="weight of 0 to 1"):
        InverseRegression.from_array(spoilt, y.shape[1], 2)
