"""The left-right HMM against its expanded form, and what must hold for any data."""

import itertools
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.stats import multivariate_normal

from paramove.hmm import LeftRightHMM, Parameters, SequenceLengthError, TrainingOptions, resample
from paramove.hmm.estimation import Statistics
from tests.hmm.expanded import expanded_forward_backward

PROPERTY = settings(max_examples=25, deadline=None, derandomize=True)


def random_parameters(rng: np.random.Generator, n_states: int, dim: int, d_min: int, d_max: int) -> Parameters:
    factors = rng.standard_normal((n_states, dim, dim))
    covariances = factors @ np.swapaxes(factors, 1, 2) + 0.2 * np.eye(dim)
    durations = np.zeros((n_states, d_max))
    durations[:, d_min - 1 :] = rng.dirichlet(np.ones(d_max - d_min + 1), n_states)
    return Parameters(rng.standard_normal((n_states, dim)), covariances, durations, d_min)


def curve(rng: np.random.Generator, n_frames: int, noise: float = 0.02) -> np.ndarray:
    """A noisy arc with a random progression rate."""
    progress = np.linspace(0.0, 1.0, n_frames) ** rng.uniform(0.85, 1.15)
    points = np.column_stack([np.cos(3.0 * progress), np.sin(3.0 * progress), progress])
    return points + noise * rng.standard_normal(points.shape)


@st.composite
def models(draw: st.DrawFn) -> tuple[Parameters, np.ndarray]:
    rng = np.random.default_rng(draw(st.integers(0, 2**31)))
    n_states, dim = draw(st.integers(1, 6)), draw(st.integers(1, 4))
    d_min = draw(st.integers(1, 3))
    d_max = draw(st.integers(d_min, d_min + 3))
    n_frames = draw(st.integers(n_states * d_min, n_states * d_max))
    return random_parameters(rng, n_states, dim, d_min, d_max), rng.standard_normal((n_frames, dim)) * 2.0


@PROPERTY
@given(models())
def test_equals_the_expanded_states(case: tuple[Parameters, np.ndarray]) -> None:
    parameters, sequence = case
    hmm = LeftRightHMM.from_parameters(parameters)
    expected, gamma = expanded_forward_backward(
        sequence, parameters.means, parameters.covariances, parameters.durations
    )
    assert_allclose(hmm.log_likelihood(sequence), expected, rtol=1e-10, atol=1e-10)
    assert_allclose(hmm.responsibilities(sequence), gamma, rtol=0.0, atol=1e-10)


@PROPERTY
@given(models())
def test_probabilities_sum_to_one(case: tuple[Parameters, np.ndarray]) -> None:
    parameters, sequence = case
    hmm = LeftRightHMM.from_parameters(parameters)
    assert_allclose(hmm.responsibilities(sequence).sum(axis=1), 1.0, rtol=0.0, atol=1e-9)
    statistics = Statistics.gathered(parameters, [sequence])
    assert_allclose(statistics.durations.sum(axis=1), 1.0, rtol=0.0, atol=1e-9)
    assert_allclose(statistics.weight.sum(), len(sequence), rtol=1e-9, atol=0.0)


@PROPERTY
@given(models())
def test_best_segmentation_is_allowed_and_not_better_than_the_sum(case: tuple[Parameters, np.ndarray]) -> None:
    parameters, sequence = case
    hmm = LeftRightHMM.from_parameters(parameters)
    borders = hmm.segment_borders(sequence)
    lengths = np.diff(borders)
    assert borders[0] == 0
    assert borders[-1] == len(sequence)
    assert lengths.min() >= parameters.d_min
    assert lengths.max() <= hmm.d_max
    assert path_log_probability(parameters, sequence, lengths) <= hmm.log_likelihood(sequence) + 1e-9


def path_log_probability(parameters: Parameters, sequence: np.ndarray, lengths: np.ndarray) -> float:
    states = np.repeat(np.arange(len(lengths)), lengths)
    outputs = sum(
        multivariate_normal(parameters.means[i], parameters.covariances[i]).logpdf(x)
        for i, x in zip(states, sequence, strict=True)
    )
    with np.errstate(divide="ignore"):
        return float(outputs + np.log(parameters.durations[np.arange(len(lengths)), lengths - 1]).sum())


def test_best_segmentation_is_the_best_of_all() -> None:
    rng = np.random.default_rng(4)
    parameters, sequence = random_parameters(rng, 3, 2, 1, 3), rng.standard_normal((6, 2))
    allowed = [path for path in itertools.product((1, 2, 3), repeat=3) if sum(path) == 6]
    values = [path_log_probability(parameters, sequence, np.array(path)) for path in allowed]
    found = np.diff(LeftRightHMM.from_parameters(parameters).segment_borders(sequence))
    assert tuple(found) == allowed[int(np.argmax(values))]


@PROPERTY
@given(st.integers(0, 2**31), st.integers(3, 8))
def test_likelihood_never_falls_without_prior(seed: int, n_states: int) -> None:
    rng = np.random.default_rng(seed)
    sequences = [curve(rng, int(rng.integers(n_states * 5, n_states * 8))) for _ in range(4)]
    hmm = LeftRightHMM(n_states, 3, 10, options=TrainingOptions.maximum_likelihood(12)).fit(sequences)
    assert hmm.training_ is not None
    history = np.array(hmm.training_.log_likelihoods)
    assert np.all(np.diff(history) >= -1e-7 * np.abs(history[:-1]))
    assert_allclose(hmm.durations_.sum(axis=1), 1.0, rtol=0.0, atol=1e-12)


@PROPERTY
@given(st.integers(0, 2**31))
def test_objective_never_falls_with_shrinkage_and_floor(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sequences = [curve(rng, 60, noise=0.001) for _ in range(2)]
    options = TrainingOptions(max_iterations=25, tolerance=0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # the monitor warns where the objective falls
        hmm = LeftRightHMM(20, 2, 4, options=options).fit(sequences)
    assert hmm.training_ is not None
    assert hmm.training_.objectives[-1] >= hmm.training_.objectives[0]


def test_pooled_statistics_are_the_exact_weighted_moments() -> None:
    rng = np.random.default_rng(1)
    parameters = random_parameters(rng, 4, 3, 2, 4)
    sequences = [rng.standard_normal((n, 3)) + 50.0 for n in (9, 12, 15)]
    statistics = Statistics.gathered(parameters, sequences)
    hmm = LeftRightHMM.from_parameters(parameters)
    gamma = np.concatenate([hmm.responsibilities(s) for s in sequences])
    frames = np.concatenate(sequences)
    means = (gamma.T @ frames) / gamma.sum(axis=0)[:, None]
    assert_allclose(statistics.means(), means, rtol=1e-12, atol=0.0)
    scatter = statistics.scatter(means)
    for i in range(4):
        expected = (frames - means[i]).T @ ((frames - means[i]) * gamma[:, [i]])
        assert_allclose(scatter[i], expected, rtol=0.0, atol=1e-9)


def test_recovers_the_means_of_sampled_movements() -> None:
    rng = np.random.default_rng(3)
    durations = np.array([[0.0, 0.5, 0.5]] * 12)
    means = np.column_stack([np.linspace(0.0, 1.0, 12), np.sin(np.linspace(0.0, 6.0, 12))])
    truth = LeftRightHMM.from_parameters(Parameters(means, np.tile(np.eye(2) * 1e-4, (12, 1, 1)), durations, 2))
    trained = LeftRightHMM(12, 2, 3).fit([truth.sample(rng) for _ in range(60)])
    assert_allclose(trained.means_, means, rtol=0.0, atol=0.01)
    assert_allclose(trained.expected_durations(), 2.5, rtol=0.0, atol=0.25)


def test_survives_outputs_that_underflow() -> None:
    rng = np.random.default_rng(2)
    parameters = Parameters(
        rng.standard_normal((20, 21)), np.tile(np.eye(21) * 1e-6, (20, 1, 1)), np.eye(20, 6)[[4] * 20], 4
    )
    assert np.isfinite(LeftRightHMM.from_parameters(parameters).log_likelihood(rng.standard_normal((100, 21)) * 10))


def test_impossible_lengths_are_refused_with_the_allowed_range() -> None:
    hmm = LeftRightHMM(20, 4, 6)
    with pytest.raises(SequenceLengthError, match="allowed are 80 to 120 frames; resample it, best to about 100"):
        hmm.fit([np.zeros((79, 3))])


def test_bad_values_are_refused_with_their_place() -> None:
    sequence = np.zeros((100, 3))
    sequence[41, 1] = np.nan
    with pytest.raises(ValueError, match=r"sequence 1: 1 of 100 frames hold values that are not finite; .* frame 41"):
        LeftRightHMM(20, 4, 6).fit([np.zeros((100, 3)), sequence])


def test_resampling_keeps_the_ends_and_straight_lines() -> None:
    line = np.linspace([0.0, 1.0], [3.0, -1.0], 17)
    assert_allclose(resample(line, 100), np.linspace([0.0, 1.0], [3.0, -1.0], 100), rtol=0.0, atol=1e-12)


def test_synthesis_passes_the_means_in_order() -> None:
    rng = np.random.default_rng(5)
    parameters = random_parameters(rng, 5, 2, 1, 4)
    hmm = LeftRightHMM.from_parameters(parameters)
    assert_allclose(hmm.synthesize(9)[::2], hmm.means_, rtol=0.0, atol=1e-12)
    lengths = parameters.durations @ np.arange(1, 5)
    assert_allclose(hmm.expected_durations(), lengths, rtol=1e-12, atol=0.0)
    timed = hmm.synthesize(1001, timing="expected")
    centres = np.cumsum(lengths) - lengths / 2
    index = round(1000 * (centres[2] - centres[0]) / (centres[-1] - centres[0]))
    assert_allclose(timed[index], hmm.means_[2], rtol=0.0, atol=0.02)


def test_average_of_many_drawn_movements_is_near_the_prototype() -> None:
    rng = np.random.default_rng(6)
    hmm = LeftRightHMM(10, 2, 4).fit([curve(rng, 30) for _ in range(8)])
    average = resample(hmm.sample_average(rng, 400), 30)
    assert np.abs(average - resample(np.repeat(hmm.means_, 3, axis=0), 30)).max() < 0.25
    assert hmm.sample_spline(rng).shape[1] == 3
