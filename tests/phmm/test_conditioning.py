"""Movements through given poses, and to another theta on the way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from paramove.hmm import NotFittedError
from paramove.phmm import LinearPHMM, ParametricHMM
from tests.phmm.movements import CLASSES, FEW, shown, trained

every_class = pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
THETA, N = [0.4, 0.6], 101


@pytest.fixture(scope="module")
def models() -> dict[type[ParametricHMM], ParametricHMM]:
    return {kind: trained(kind) for kind in CLASSES}


def largest(movement: np.ndarray, order: int) -> float:
    return float(np.abs(np.diff(movement, order, axis=0)).max())


@every_class
def test_poses_are_passed_and_the_rest_stays_likely(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM]
) -> None:
    model = models[kind]
    usual = model.synthesize(THETA, N)
    wanted = usual[40] + [0.02, -0.02, 0.02]
    made = model.synthesize_through(THETA, {0.4: wanted, 0.8: usual[80]}, N)
    assert_allclose(made[[40, 80]], [wanted, usual[80]], rtol=0.0, atol=1e-5)
    assert_allclose(made[0], usual[0], rtol=0.0, atol=1e-5)
    assert np.abs(made - usual).max() < 0.1
    assert largest(made, 3) < 1.5 * largest(usual, 3)
    assert np.array_equal(model.synthesize_through(THETA, {}, N), usual)


def test_other_coordinates_follow_as_they_do_in_executions(models: dict[type[ParametricHMM], ParametricHMM]) -> None:
    """What moves together in the executions of the training moves together under a condition."""
    rng = np.random.default_rng(0)
    sequences, theta = shown(0, repetitions=12)
    habits = [0.1 * rng.standard_normal() * np.sin(np.linspace(0.0, np.pi, len(x)))[:, None] for x in sequences]
    together = [x + habit * [1.0, -1.0, 0.0] for x, habit in zip(sequences, habits, strict=True)]
    model = LinearPHMM(8, options=FEW).fit(together, theta)
    usual = model.synthesize(THETA, N)
    made = model.synthesize_through(THETA, {0.5: [usual[50, 0] + 0.1, np.nan, np.nan]}, N)
    moved = made[50] - usual[50]
    assert_allclose(moved[:2], [0.1, -0.1], rtol=0.0, atol=0.02)
    assert abs(moved[2]) < 0.03


@every_class
def test_a_new_theta_on_the_way_is_reached_smoothly(
    models: dict[type[ParametricHMM], ParametricHMM], kind: type[ParametricHMM]
) -> None:
    model = models[kind]
    old, new = model.synthesize(THETA, N), model.synthesize([0.9, 0.2], N)
    made = model.redirect(old, [0.9, 0.2], 0.4)
    assert np.array_equal(made[:41], old[:41])
    assert_allclose(made[70:], new[70:], rtol=0.0, atol=1e-9)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.floats(0.0, 0.95), st.floats(0.05, 0.9))
def test_a_turn_is_continuous_to_the_acceleration(
    models: dict[type[ParametricHMM], ParametricHMM], at: float, within: float
) -> None:
    model, n = models[LinearPHMM], 4001
    old, new = model.synthesize(THETA, n), model.synthesize([0.9, 0.2], n)
    made = model.redirect(old, [0.9, 0.2], at, within)
    assert ((made >= np.minimum(old, new) - 1e-9) & (made <= np.maximum(old, new) + 1e-9)).all()
    jumps = np.abs(np.diff(made, 3, axis=0)) * (n - 1) ** 2  # of the acceleration between frames
    assert jumps.max() < 60.0 / min(within, 1.0 - at) ** 3 / n * np.abs(new - old).max() + 2.0 * max(
        np.abs(np.diff(one, 3, axis=0)).max() * (n - 1) ** 2 for one in (old, new)
    )


def test_what_does_not_fit_is_named(models: dict[type[ParametricHMM], ParametricHMM]) -> None:
    model = models[LinearPHMM]
    made = model.synthesize(THETA, N)
    for via in ({1.2: made[0]}, {0.5: made[0, :2]}, {0.5: np.array([np.inf, 0.0, 0.0])}):
        with pytest.raises(ValueError, match="via has poses of 3 numbers by fractions from 0 to 1"):
            model.synthesize_through(THETA, via, N)
    for at, within in ((1.0, 0.3), (-0.1, 0.3), (0.5, 0.0), (np.nan, 0.3)):
        with pytest.raises(ValueError, match="expected 0 <= at < 1"):
            model.redirect(made, THETA, at, within)
    with pytest.raises(ValueError, match="3 dimensions per frame, the sequence has 2"):
        model.redirect(made[:, :2], THETA, 0.5)
    independent = trained(LinearPHMM, residuals="independent")
    with pytest.raises(ValueError, match="independent residuals"):
        independent.synthesize_through(THETA, {0.5: made[50]}, N)
    assert independent.redirect(made, [0.9, 0.2], 0.5).shape == made.shape
    with pytest.raises(NotFittedError):
        LinearPHMM().redirect(made, THETA, 0.5)
