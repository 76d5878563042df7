"""Networks of states: gradients, generalised EM, choice of units, and what they are good for."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from paramove.hmm import TrainingOptions
from paramove.hmm.training import LikelihoodDecreaseWarning
from paramove.phmm import MovementClassifier, NeuralPHMM, QuadraticPHMM
from paramove.phmm.network.choice import Choice, _better, _left_out_errors
from paramove.phmm.network.networks import StateNetworks, StateTargets, drawn_inner
from tests.phmm.movements import numerical_gradient, shown, wave
from tests.phmm.network.edge import strongly_nonlinear_movement
from tests.phmm.table import RASTER_CM, table_movements

PROPERTY = settings(max_examples=15, deadline=None, derandomize=True)


def drawn_targets(rng: np.random.Generator, dimension: int, n_hidden: int, alike: bool) -> StateTargets:
    """Targets of 3 states in 2 dimensions with a linear skip."""
    places = rng.uniform(-1.0, 1.0, (12, dimension))
    features = np.column_stack([np.ones(12), places])
    precision = np.full((3, 2), 0.7) if alike else rng.uniform(0.2, 3.0, (3, 2))
    ridge = np.concatenate([[0.0], rng.uniform(0.01, 0.5, dimension + n_hidden)])
    rotation = rng.standard_normal((3, 2, 2)) + 2.0 * np.eye(2)
    return StateTargets(
        places, features, rng.uniform(1.0, 5.0, (12, 3)), rng.standard_normal((12, 3, 2)), rotation, precision, ridge
    )


@PROPERTY
@given(st.integers(0, 2**31), st.integers(1, 3), st.integers(1, 3), st.booleans())
def test_gradient_of_q_equals_finite_differences(seed: int, dimension: int, n_hidden: int, alike: bool) -> None:
    rng = np.random.default_rng(seed)
    targets = drawn_targets(rng, dimension, n_hidden, alike)
    inner = rng.standard_normal((3, n_hidden, dimension + 1))
    gradient = targets.loss_and_gradient(inner)[1]
    expected = numerical_gradient(lambda at: targets.loss_and_gradient(at)[0], inner)
    assert_allclose(gradient, expected, rtol=1e-5, atol=1e-6)


@PROPERTY
@given(st.integers(0, 2**31), st.integers(1, 2), st.booleans())
def test_no_other_outer_weights_make_q_greater(seed: int, dimension: int, alike: bool) -> None:
    """The loss is the quadratic form written out, at its minimum."""
    rng = np.random.default_rng(seed)
    targets = drawn_targets(rng, dimension, 2, alike)
    inner = drawn_inner(3, 2, dimension, rng)
    networks = targets.networks(inner)

    def loss(networks: StateNetworks) -> float:
        missed = targets.rotated - np.einsum(
            "nde,kne->knd", targets.rotation, networks.means(targets.positions, targets.features)
        )
        columns = targets.rotation @ np.concatenate([networks.skip, networks.outer], axis=2)
        total = (targets.weights[:, :, None] * targets.precision * missed**2).sum() + (targets.ridge * columns**2).sum()
        return 0.5 * float(total) + 0.5 * float((inner**2).sum()) / 9.0

    assert_allclose(loss(networks), targets.loss_and_gradient(inner)[0], rtol=1e-6, atol=1e-8)
    for _ in range(3):
        other = StateNetworks(networks.skip, networks.outer + 0.1 * rng.standard_normal(networks.outer.shape), inner)
        assert loss(other) > loss(networks)


def test_the_likelihood_of_an_estimate_is_that_of_the_hmm_there() -> None:
    rng = np.random.default_rng(1)
    sequences, theta = shown(2)
    model = NeuralPHMM(8, 4, 6, n_hidden=2, options=TrainingOptions(max_iterations=5)).fit(sequences, theta)
    sequence = wave(np.array([0.2, 0.6]), rng)
    found = model.estimate(sequence)
    assert_allclose(found.log_likelihood, model.log_likelihood(sequence, found.theta), rtol=1e-10, atol=1e-8)


@settings(max_examples=5, deadline=None, derandomize=True)
@given(st.integers(0, 2**31), st.integers(1, 3), st.integers(1, 2))
def test_generalised_em_never_lowers_the_objective(seed: int, n_hidden: int, skip_degree: int) -> None:
    rng = np.random.default_rng(seed)
    theta = rng.uniform(0.0, 1.0, (20, 2))
    sequences = [wave(one, rng) + 0.03 * rng.standard_normal((40, 3)) for one in theta]
    options = TrainingOptions(max_iterations=8, tolerance=0.0)
    model = NeuralPHMM(8, 4, 6, n_hidden=n_hidden, skip_degree=skip_degree, options=options, n_restarts=1)
    with warnings.catch_warnings():
        warnings.simplefilter("error", LikelihoodDecreaseWarning)
        model.fit(sequences, theta)
    objectives = np.array(model.training_.objectives)
    assert len(objectives) > 1
    assert (np.diff(objectives) >= -1e-7 * np.abs(objectives[:-1])).all()


def test_strongly_nonlinear_movements_are_learned_better_than_by_a_quadratic() -> None:
    found = np.array([learned_nonlinear_movements(seed) for seed in range(3)])
    errors, scores, misses = found.mean(axis=0)
    assert (found[:, 0, 0] < 0.6 * found[:, 0, 1]).all()
    assert errors[0] < 0.5 * errors[1]
    assert scores[0] > scores[1]
    assert misses[0] < 1.1 * misses[1]


def learned_nonlinear_movements(seed: int) -> list[list[float]]:
    """Errors of synthesis, log-likelihoods of unseen movements, misses of theta; each neural, then quadratic."""
    rng = np.random.default_rng(seed)
    demonstrated = np.repeat(np.linspace(-0.3, 0.3, 13), 4)
    movements = [strongly_nonlinear_movement(height, rng) for height in demonstrated]
    heights = rng.uniform(-0.28, 0.28, 12)
    unseen = [strongly_nonlinear_movement(height, rng) for height in heights]
    truth = np.stack([strongly_nonlinear_movement(height) for height in heights])
    errors, scores, misses = [], [], []
    for kind in (NeuralPHMM, QuadraticPHMM):
        model = kind(20, 4, 6, resampled_frames=100).fit(movements, demonstrated[:, None])
        if isinstance(model, NeuralPHMM):
            assert model.n_hidden_ > 0
        made = np.stack([model.synthesize([height], 100) for height in heights])
        estimates = np.array([model.estimate(one).theta[0] for one in unseen])
        errors.append(float(np.sqrt(((made - truth) ** 2).sum(axis=2).mean())))
        scores.append(model.score(unseen, heights[:, None]))
        misses.append(float(np.abs(estimates - heights).mean()))
    return [errors, scores, misses]


def test_over_the_table_it_is_no_worse_than_the_quadratic_one() -> None:
    """There a quadratic says nearly all, and cross validation takes no hidden units for noise."""
    sequences, theta = table_movements(3, 3, 5, seed=0)
    unseen, labels = table_movements(4, 3, 2, seed=100)
    errors = []
    for kind in (NeuralPHMM, QuadraticPHMM):
        model = kind(20, 4, 6).fit(sequences, theta)
        if isinstance(model, NeuralPHMM):
            assert model.n_hidden_ == 0
        found = np.stack([model.estimate(one).theta for one in unseen])
        errors.append(float(np.linalg.norm((found - labels) * RASTER_CM, axis=1).mean()))
    assert errors[0] <= 1.1 * errors[1]


@pytest.mark.parametrize(
    ("gains", "better"),
    [
        ((0.3, 0.2, 0.4, 0.3, 0.1), True),
        ((0.4, 0.3, -0.3, 0.3, -0.2), False),  # by chance: as much worse in some folds as better in others
        ((0.04, 0.04, 0.04, 0.04, 0.04), False),  # not worth it
    ],
)
def test_more_units_must_be_better_in_nearly_all_folds(gains: tuple[float, ...], better: bool) -> None:
    known = np.zeros(len(gains) + 1)
    errors = -np.array([*gains, np.mean(gains)])
    assert _better(errors, known, more=True) == better
    assert _better(errors, known, more=False)


def test_a_classifier_of_networks_rejects_a_movement_that_stops() -> None:
    model = NeuralPHMM(8, 4, 6, options=TrainingOptions(max_iterations=8)).fit(*shown(2))
    classifier = MovementClassifier.from_models({"wave": model})
    x = wave(np.array([0.4, 0.6]), np.random.default_rng(3))
    assert 0.01 < classifier.classify(x).p_value < 1.0
    stopped = np.concatenate([x[:20], np.repeat(x[20:21], 20, axis=0)])
    assert classifier.classify(stopped).p_value < 0.01


def test_restarts_are_drawn_from_the_seed() -> None:
    sequences, theta = shown(2)

    def inner(seed: int) -> np.ndarray:
        options = TrainingOptions(max_iterations=3)
        return NeuralPHMM(8, 4, 6, n_hidden=2, seed=seed, options=options).fit(sequences, theta).networks_.inner

    assert np.array_equal(inner(1), inner(1))
    assert not np.array_equal(inner(1), inner(2))


@pytest.mark.parametrize("parameters", [{"n_hidden": -1}, {"skip_degree": 0}, {"gradient_steps": 0}])
def test_impossible_parameters_are_refused(parameters: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="skip_degree and gradient_steps are at least 1, n_hidden is not negative"):
        NeuralPHMM(8, 4, 6, **parameters).fit(*shown(0))


def test_which_way_targets_are_turned_does_not_matter_to_the_choice() -> None:
    """Covariances that are alike leave the turn open, and rounding would decide."""
    rng = np.random.default_rng(3)
    targets = drawn_targets(rng, 1, 0, alike=True)
    turn, _ = np.linalg.qr(rng.standard_normal((2, 2)))
    turned = replace(targets, rotated=targets.rotated @ turn.T, rotation=turn @ targets.rotation)
    choice = Choice(0, 0.0, np.zeros((3, 0, 2)))
    groups = np.arange(12)
    assert_allclose(
        _left_out_errors(turned, groups, choice), _left_out_errors(targets, groups, choice), rtol=0, atol=1e-9
    )
