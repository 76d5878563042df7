"""The search of interpolative models against dense rasters, its gradient, and covariances that hold."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.stats import chi2

from paramove.phmm import InterpolativePHMM, NeuralPHMM, ParametricHMM, QuadraticPHMM
from paramove.phmm.interpolation_kernels import expectation_at, value_at
from tests.phmm.movements import FEW, numerical_gradient, shown, wave
from tests.phmm.table import RASTER_CM, table_movements

PROPERTY = settings(max_examples=25, deadline=None, derandomize=True)


@pytest.fixture(scope="module")
def three() -> InterpolativePHMM:
    return InterpolativePHMM(20, 4, 6, residuals="independent").fit(*table_movements(3, 3, 10, seed=0))


@pytest.fixture(scope="module")
def two() -> InterpolativePHMM:
    return InterpolativePHMM(20, 4, 6, residuals="independent").fit(*table_movements(2, 2, 10, seed=0))


UNSEEN, LABELS = table_movements(7, 5, 1, seed=1)


@PROPERTY
@given(st.tuples(st.floats(-0.2, 1.2), st.floats(-0.2, 1.2)), st.integers(0, 34))
def test_value_and_gradient_are_those_of_the_model(
    three: InterpolativePHMM, place: tuple[float, float], number: int
) -> None:
    """Means, covariances and durations all move with the place; outside the last two stand still."""
    at, columns, arrays = np.array(place), np.ascontiguousarray(UNSEEN[number].T), three._kernel_arrays()
    if min(abs(x - knot) for x in place for knot in (0.0, 0.5, 1.0)) < 1e-4:
        return  # a kink has two gradients
    cell = three.grid_.cell(at)
    value, gradient, information = expectation_at(at, cell, columns, *arrays)
    assert_allclose(value, three.log_likelihood(UNSEEN[number], at), rtol=1e-9, atol=1e-6)
    expected = numerical_gradient(lambda u: value_at(u, cell, columns, *arrays), at, 1e-6)
    assert_allclose(gradient, expected, rtol=1e-3, atol=1e-3 * np.abs(expected).max() + 1e-2)
    assert np.linalg.eigvalsh(information).min() > 0.0


def dense_maximum(model: InterpolativePHMM, sequence: np.ndarray) -> float:
    """Greatest ln p on a raster over the grid and its margin, then on a fine one around the three best places."""
    columns, arrays = np.ascontiguousarray(sequence.T), model._kernel_arrays()
    dimension = model.grid_.dimension

    def values(places: list[np.ndarray]) -> np.ndarray:
        return np.array([value_at(one, model.grid_.cell(one), columns, *arrays) for one in places])

    line = np.linspace(-0.25, 1.25, {1: 301, 2: 31, 3: 13}[dimension])
    places = [np.array(one) for one in itertools.product(line, repeat=dimension)]
    found = values(places)
    best = float(found.max())
    for number in np.argsort(found)[-3:]:
        centre, width = places[number], float(line[1] - line[0])
        for _ in range(5):
            fine = np.linspace(-width, width, 7)
            around = [np.clip(centre + one, -0.25, 1.25) for one in itertools.product(fine, repeat=dimension)]
            tried = values(around)
            centre, best, width = around[int(tried.argmax())], max(best, float(tried.max())), width / 3.0
    return best


@pytest.mark.parametrize("name", ["three", "two"])
def test_the_maximum_over_the_table_is_that_of_a_dense_raster(name: str, request: pytest.FixtureRequest) -> None:
    model = request.getfixturevalue(name)
    gaps = np.array([dense_maximum(model, one) - model.estimate(one).log_likelihood for one in UNSEEN[::3]])
    assert (gaps <= 0.5).all()


@pytest.mark.parametrize(("dimension", "lines"), [(1, 4), (3, 2)])
def test_the_maximum_in_other_dimensions_is_that_of_a_dense_raster(dimension: int, lines: int) -> None:
    model = InterpolativePHMM(8, 4, 6, options=FEW, residuals="independent").fit(*shown(2, lines, dimension))
    rng = np.random.default_rng(4)
    movements = [wave(rng.uniform(0.0, 1.0, dimension), rng) for _ in range(12)]
    gaps = np.array([dense_maximum(model, one) - model.estimate(one).log_likelihood for one in movements])
    assert (gaps <= 0.5).all()


def coverage(model: ParametricHMM, unseen: list[np.ndarray], labels: np.ndarray) -> tuple[float, float]:
    """Share of 95 % regions that hold theta, and the mean error in cm over the table."""
    inside, errors = [], []
    for sequence, label in zip(unseen, labels, strict=True):
        found = model.estimate(sequence)
        error = found.theta - label
        inside.append(error @ np.linalg.solve(found.covariance, error) <= chi2.ppf(0.95, 2))
        errors.append(np.linalg.norm(error * RASTER_CM))
    return float(np.mean(inside)), float(np.mean(errors))


@pytest.mark.parametrize("kind", [InterpolativePHMM, NeuralPHMM, QuadraticPHMM], ids=lambda kind: kind.__name__)
def test_regions_of_95_percent_hold_theta_over_the_table(kind: type[ParametricHMM]) -> None:
    """Trained on the 3 x 3 raster, asked at the 7 x 5 raster, whose places are mostly others."""
    sequences, theta = table_movements(3, 3, 10, seed=0)
    unseen, labels = table_movements(7, 5, 3, seed=2)
    share, error = coverage(kind(20, 4, 6).fit(sequences, theta), unseen, labels)
    assert 0.85 <= share <= 1.0
    assert error <= 1.5


def test_regions_between_two_lines_allow_for_what_was_never_shown() -> None:
    two = InterpolativePHMM(20, 4, 6).fit(*table_movements(2, 2, 10, seed=0))
    share, error = coverage(two, UNSEEN, LABELS)
    assert 0.75 <= share <= 1.0
    assert error <= 3.5


def test_a_model_of_independent_residuals_knows_the_likelihood_alone(three: InterpolativePHMM) -> None:
    assert three.residuals == "independent"
    with pytest.raises(ValueError, match="independent residuals"):
        three.examine(UNSEEN[3])
