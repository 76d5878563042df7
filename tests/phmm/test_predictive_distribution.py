"""Predictive distribution of p-values: Student's t against its definition, and what it promises about new groups."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.special import log_ndtr, stdtr

from paramove.phmm.predictive_distribution import PredictiveDistribution, log_upper_tail

PROPERTY = settings(max_examples=60, deadline=None, derandomize=True)


@PROPERTY
@given(st.floats(1.0, 200.0), st.floats(-50.0, 1e6))
def test_the_tail_of_student_s_t_is_finite_falls_and_is_scipy_s_where_that_is_above_zero(
    freedom: float, t: float
) -> None:
    found = log_upper_tail(t, freedom)
    assert np.isfinite(found)
    assert log_upper_tail(t + 0.01 * abs(t) + 1e-3, freedom) <= found <= 0.0
    if stdtr(freedom, -t) > 1e-280:
        assert_allclose(found, np.log(stdtr(freedom, -t)), rtol=1e-12, atol=1e-300)


@pytest.mark.parametrize("freedom", [80.0, 300.0, 3000.0])
def test_the_far_tail_goes_on_where_the_near_one_ends(freedom: float) -> None:
    places = np.geomspace(20.0, 2e7, 400)
    found = np.array([log_upper_tail(t, freedom) for t in places])
    assert (np.diff(found) < 0.0).all()
    slopes = np.diff(found) / np.diff(np.log(places))  # -t^2 (n + 1) / (t^2 + n): no jump
    assert (np.abs(np.diff(slopes)) < 0.1 * np.abs(slopes[1:])).all()


def test_many_groups_make_a_normal_distribution() -> None:
    rng = np.random.default_rng(0)
    values = rng.standard_normal(4000)
    found = PredictiveDistribution.of(values, np.arange(4000))
    assert_allclose(found.log_above(2.0), log_ndtr(-2.0), rtol=0.05)


def test_movements_of_their_own_are_the_textbook_prediction() -> None:
    """A new value of a normal distribution: t with K - 1 degrees of freedom, deviation s sqrt(1 + 1/K)."""
    values = np.array([0.3, 1.4, -0.2, 0.9, 0.1])
    found = PredictiveDistribution.of(values, np.array([4, 2, 7, 1, 9]))
    assert_allclose([found.mean, found.freedom], [values.mean(), 4.0], rtol=1e-12)
    assert_allclose(found.deviation, values.std(ddof=1) * np.sqrt(1.2), rtol=1e-12)


def test_groups_that_hold_the_same_value_count_once() -> None:
    means = np.array([0.3, 1.4, -0.2, 0.9, 0.1])
    groups = np.repeat(np.arange(5), 20)
    found = PredictiveDistribution.of(means[groups], groups)
    single = PredictiveDistribution.of(means, np.arange(5))
    assert_allclose(
        [found.mean, found.deviation, found.freedom], [single.mean, single.deviation, single.freedom], rtol=1e-9
    )


def test_groups_that_do_not_differ_count_by_their_values() -> None:
    values = np.random.default_rng(1).standard_normal(100)
    found = PredictiveDistribution.of(values, np.arange(100) % 10)
    assert found.freedom > 50.0
    assert_allclose(found.deviation, values.std(ddof=1), rtol=0.1)


def test_one_group_tells_about_itself() -> None:
    values = np.array([0.3, 1.4, -0.2, 0.9])
    assert PredictiveDistribution.of(values, np.zeros(4, int)) == PredictiveDistribution.of(values, np.arange(4))


@pytest.mark.parametrize("values", [[], [0.7]])
def test_of_too_few_values_the_probability_is_unknown(values: list[float]) -> None:
    found = PredictiveDistribution.of(np.array(values), np.zeros(len(values), int))
    assert np.isnan(found.log_above(1e6))


def test_values_that_are_all_the_same_give_finite_answers() -> None:
    found = PredictiveDistribution.of(np.full(6, 0.4), np.arange(6) // 2)
    assert found.log_above(0.4) == pytest.approx(np.log(0.5))
    assert np.isfinite(found.log_above(1e3))
    assert found.log_above(1e3) < -10.0


@pytest.mark.parametrize(("between", "within"), [(0.25, 0.13), (0.0, 0.2), (0.3, 0.0)])
def test_as_many_movements_of_a_new_person_are_rejected_as_promised(between: float, within: float) -> None:
    """Nine persons with ten movements each, then one of a tenth, often."""
    rng, people = np.random.default_rng(2), np.repeat(np.arange(9), 10)
    rejected = []
    for _ in range(3000):
        means = between * rng.standard_normal(10)
        values = means[people] + within * rng.standard_normal(90)
        new = means[9] + within * rng.standard_normal()
        rejected.append(PredictiveDistribution.of(values, people).log_above(new) < np.log([0.01, 0.05]))
    assert_allclose(np.mean(rejected, axis=0), [0.01, 0.05], rtol=0.5)
