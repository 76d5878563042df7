"""Regression of whole movements: which distance belongs to which training movement."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.phmm.correlated_regression import CorrelatedRegression
from paramove.phmm.features import Monomials


def movements(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Movements as six numbers each, and theta of two components."""
    rng = np.random.default_rng(seed)
    theta = rng.uniform(0.0, 1.0, (count, 2))
    slopes = rng.standard_normal((2, 6))
    return theta @ slopes + 0.1 * rng.standard_normal((count, 6)) @ rng.standard_normal((6, 6)), theta


def fitted(y: np.ndarray, theta: np.ndarray, groups: np.ndarray) -> CorrelatedRegression:
    return CorrelatedRegression.fitted_with_errors([y], theta, Monomials.of_degree(1, theta), groups)[0][0]


@pytest.mark.parametrize("n_groups", [2, 3, 5, 13])
def test_distances_are_in_the_order_of_the_training_movements(n_groups: int) -> None:
    y, theta = movements(26)
    groups = np.arange(26) % n_groups
    order = np.random.default_rng(1).permutation(26) if n_groups > 2 else np.arange(26)  # two: folds by place
    plain, shuffled = fitted(y, theta, groups), fitted(y[order], theta[order], groups[order])
    assert plain.distances.shape == (26,)
    assert_allclose(shuffled.distances, plain.distances[order], rtol=1e-6)
    assert np.array_equal(shuffled.groups, groups[order])


@pytest.mark.parametrize("groups", [np.arange(20) % 4, np.arange(20) // 5, np.zeros(20, int)])
def test_the_movement_that_is_strange_has_the_greatest_distance(groups: np.ndarray) -> None:
    y, theta = movements(20)
    for strange in (0, 7, 19):
        spoilt = y.copy()
        spoilt[strange] += 3.0 * np.random.default_rng(3).standard_normal(6)
        assert fitted(spoilt, theta, groups).distances.argmax() == strange


@pytest.mark.parametrize("count", [2, 3, 4, 11])
@pytest.mark.parametrize("n_groups", [1, 2, 3])
def test_every_movement_of_a_tiny_training_set_has_a_distance(count: int, n_groups: int) -> None:
    y, theta = movements(count)
    found = fitted(y, theta, np.arange(count) % n_groups)
    assert found.distances.shape == found.groups.shape == (count,)
    assert np.isfinite(found.distances).all()
    assert (found.distances >= 0.0).all()
    assert np.isfinite(found.log_p_value(1e12))


def test_what_was_learned_comes_back() -> None:
    y, theta = movements(12)
    monomials = Monomials.of_degree(1, theta)
    regression = fitted(y, theta, np.arange(12) % 4)
    arrays = {f"own_{name}": value for name, value in regression.arrays().items()}
    again = CorrelatedRegression.from_arrays(arrays, "own_", monomials)
    assert np.array_equal(again.groups, regression.groups)
    assert again.log_p_value(9.0) == regression.log_p_value(9.0)
    with pytest.raises(ValueError, match=r"of shape \(3,\), found \(12,\)"):
        CorrelatedRegression.from_arrays({**arrays, "own_groups": np.zeros(3)}, "own_", monomials)
