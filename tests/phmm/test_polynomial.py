"""Polynomial parametric HMMs: mathematics against plain formulas, finite differences and scipy."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import minimize

from paramove.demonstrations import nine_pairs, redirect_demonstrations
from paramove.hmm import TrainingOptions
from paramove.hmm.estimation import Evaluator
from paramove.hmm.training import LikelihoodDecreaseWarning, equal_segments
from paramove.phmm import CubicPHMM, LinearPHMM, PolynomialPHMM, QuadraticPHMM
from paramove.phmm.features import Monomials
from paramove.phmm.regression import RegressedParameters, train_regressed
from paramove.phmm.search_kernels import expectation_at
from studies.chapter4.redirect import jerk
from tests.phmm.movements import numerical_gradient, shown, wave

PROPERTY = settings(max_examples=12, deadline=None, derandomize=True)
PLAIN = TrainingOptions.maximum_likelihood(12)


@PROPERTY
@given(st.integers(0, 2**31), st.integers(1, 3), st.integers(1, 3))
def test_gradient_of_the_likelihood_equals_finite_differences(seed: int, degree: int, dimension: int) -> None:
    rng = np.random.default_rng(seed)
    theta = rng.uniform(-1.0, 2.0, (24, dimension))
    model = PolynomialPHMM(8, 4, 6, degree=degree, options=TrainingOptions(max_iterations=6))
    model.fit([wave(one, rng) for one in theta], theta)
    sequence, place = wave(theta[0], rng), rng.uniform(-1.0, 2.0, dimension)
    value, gradient, _ = expectation_at(model._scaled(place), model._prepared(sequence))
    assert_allclose(value, model.log_likelihood(sequence, place), rtol=1e-10, atol=1e-8)
    expected = numerical_gradient(lambda at: model.log_likelihood(sequence, at), place)
    assert_allclose(gradient / model.monomials_.scale, expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())


@PROPERTY
@given(st.integers(0, 2**31), st.integers(1, 3), st.sampled_from([None, 0.05]), st.integers(1, 2))
def test_the_objective_never_falls_once_the_prior_is_constant(
    seed: int, degree: int, smoothness: float | None, dimension: int
) -> None:
    rng = np.random.default_rng(seed)
    theta = rng.uniform(0.0, 1.0, (20, dimension))
    sequences = [wave(one, rng) + 0.05 * rng.standard_normal((40, 3)) for one in theta]
    model = PolynomialPHMM(8, 4, 6, degree=degree, smoothness=smoothness, residuals="independent")
    with warnings.catch_warnings():
        warnings.simplefilter("error", LikelihoodDecreaseWarning)
        model.fit(sequences, theta)
    objectives = np.array(model.training_.objectives)
    assert (np.diff(objectives) >= -1e-7 * np.abs(objectives[:-1])).all()


def test_linear_model_without_prior_follows_the_plain_formulas() -> None:
    """(3.3) and (3.4), corrected, written out frame by frame."""
    sequences, theta = shown(4, lines=2)
    options = TrainingOptions.maximum_likelihood(1)
    begin = equal_segments(sequences, 8, 4, 6, TrainingOptions())
    monomials = Monomials.of_degree(1, theta)
    features = monomials.at(theta)
    coefficients = np.zeros((8, 3, 3))
    coefficients[..., 0] = begin.means
    initial = RegressedParameters(coefficients, begin.covariances, begin.durations, 4)
    trained, _ = train_regressed(initial, sequences, features, monomials.degrees, options, None)
    gammas = [Evaluator.of(initial.at(one)).expectation(x)[1] for one, x in zip(features, sequences, strict=True)]
    for i in range(8):
        left, right, scatter = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
        for gamma, x, one in zip(gammas, sequences, features, strict=True):
            left += np.einsum("t,td,f->df", gamma[:, i], x, one)
            right += gamma[:, i].sum() * np.outer(one, one)
        z = left @ np.linalg.inv(right)
        for gamma, x, one in zip(gammas, sequences, features, strict=True):
            scatter += np.einsum("t,td,te->de", gamma[:, i], x - z @ one, x - z @ one)
        assert_allclose(trained.coefficients[i], z, rtol=0.0, atol=1e-9)
        assert_allclose(
            trained.covariances[i], scatter / sum(gamma[:, i].sum() for gamma in gammas), rtol=1e-7, atol=1e-12
        )


@pytest.mark.parametrize("kind", [LinearPHMM, QuadraticPHMM, CubicPHMM])
def test_estimate_by_em_is_the_maximum_that_scipy_finds(kind: type[PolynomialPHMM]) -> None:
    sequences, theta = shown(6)
    model = kind(8, 4, 6, residuals="independent").fit(sequences, theta)
    rng = np.random.default_rng(3)
    for _ in range(8):
        sequence = wave(rng.uniform(0.05, 0.95, 2), rng)
        found = model.estimate(sequence)
        best = max(
            -minimize(
                lambda at, x=sequence: -model.log_likelihood(x, at),
                start,
                method="L-BFGS-B",
                bounds=[(-0.25, 1.25)] * 2,
            ).fun
            for start in ([0.5, 0.5], [0.25, 0.75], found.theta)
        )
        assert found.log_likelihood >= best - 0.01


@pytest.mark.parametrize("seed", [0, 1])
def test_redirect_movements_from_nine_demonstrations_do_not_wobble(seed: int) -> None:
    rng = np.random.default_rng(seed)
    demonstrated = redirect_demonstrations(nine_pairs(), rng, n_samples=80)
    model = QuadraticPHMM(32, 2, 3, resampled_frames=80).fit(demonstrated.sequences, demonstrated.theta)
    made = [jerk(model.synthesize(pair, 80)) for pair in rng.uniform(0.0, 1.0, (10, 4))]
    assert np.mean(made) <= 1.2 * np.mean([jerk(one) for one in demonstrated.sequences])
