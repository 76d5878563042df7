"""Select, predict, measure: their properties, and the exact posterior where there is one."""

import numpy as np
import pytest

from paramove.action_space.grammar import Grammar
from paramove.action_space.particle_filter import (
    FilterOptions,
    ParticleFilter,
    effective_number,
    systematic_resampling,
    tempering,
)
from paramove.action_space.propagation import Propagation
from paramove.action_space.vocabulary import Vocabulary
from paramove.documents.input_error import InputError
from tests.action_space.toy_kalman import KalmanToy


@pytest.mark.parametrize("seed", range(5))
def test_systematic_resampling_takes_each_about_as_often_as_it_weighs(seed):
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.full(40, 0.3))
    counts = np.bincount(systematic_resampling(weights, rng), minlength=40)
    assert counts.sum() == 40
    assert (counts >= np.floor(40 * weights - 1e-9)).all()
    assert (counts <= np.ceil(40 * weights + 1e-9)).all()


def test_systematic_resampling_is_unbiased():
    weights = np.array([0.05, 0.6, 0.0, 0.35])
    rng = np.random.default_rng(0)
    counts = sum(np.bincount(systematic_resampling(weights, rng), minlength=4) for _ in range(4000)) / 16000.0
    np.testing.assert_allclose(counts, weights, atol=0.01)
    assert counts[2] == 0.0


def test_equal_weights_keep_every_particle():
    rows = systematic_resampling(np.full(7, 1.0 / 7.0), np.random.default_rng(1))
    np.testing.assert_array_equal(rows, np.arange(7))


def test_effective_number():
    assert effective_number(np.full(8, 0.125)) == pytest.approx(8.0)
    assert effective_number(np.array([1.0, 0.0, 0.0])) == pytest.approx(1.0)


def test_tempering_keeps_as_many_effective_particles_as_wanted():
    rng = np.random.default_rng(0)
    weights, log_likelihoods = np.full(400, 1.0 / 400.0), -200.0 * rng.random(400) ** 2
    exponent = tempering(weights, log_likelihoods, 40.0)
    assert 0.0 < exponent < 1.0
    joint = np.exp(exponent * log_likelihoods)
    assert effective_number(joint) == pytest.approx(40.0, rel=0.01)
    assert tempering(weights, 0.01 * log_likelihoods, 40.0) == 1.0


def test_tempering_takes_impossible_particles():
    log_likelihoods = np.array([-np.inf, -1.0, -2.0, -np.inf])
    assert tempering(np.full(4, 0.25), log_likelihoods, 1.5) == 1.0


@pytest.mark.parametrize("resample_below", [0.5, 1.0])
def test_filter_equals_the_exact_posterior(resample_below):
    """Theta and the carried deviation are linear and Gaussian here: the Kalman filter is exact."""
    toy = KalmanToy(seed=2)
    filter_ = toy.particle_filter(FilterOptions(30_000, resample_below, min_effective=0.0), seed=5)
    for elapsed_s, seen in toy.frames(12):
        filter_.resample()
        filter_.predict(elapsed_s)
        filter_.measure(toy.log_likelihoods(filter_.particles.poses, seen))
        toy.kalman(elapsed_s, seen)
        joint = np.concatenate([filter_.particles.theta, filter_.particles.deviation], axis=1)
        weights = filter_.particles.weights
        deviations = np.sqrt(np.diagonal(toy.covariance))
        mean = weights @ joint
        np.testing.assert_allclose((mean - toy.mean) / deviations, 0.0, atol=0.08)
        covariance = np.cov(joint.T, aweights=weights, bias=True) / np.outer(deviations, deviations)
        np.testing.assert_allclose(covariance, toy.covariance / np.outer(deviations, deviations), atol=0.12)
    assert deviations[0] < 0.5 * toy.prior_deviation, "the measurements must have said something"


def test_a_wrong_diffusion_is_noticed():
    """The comparison with the Kalman filter can fail: half the diffusion of theta is far outside its tolerance."""
    toy = KalmanToy(seed=2)
    filter_ = toy.particle_filter(FilterOptions(30_000, 0.5, min_effective=0.0), seed=5, diffusion_factor=0.5)
    worst = 0.0
    for elapsed_s, seen in toy.frames(12):
        filter_.resample()
        filter_.predict(elapsed_s)
        filter_.measure(toy.log_likelihoods(filter_.particles.poses, seen))
        toy.kalman(elapsed_s, seen)
        joint = np.concatenate([filter_.particles.theta, filter_.particles.deviation], axis=1)
        mean = filter_.particles.weights @ joint
        worst = max(worst, float(np.abs((mean - toy.mean) / np.sqrt(np.diagonal(toy.covariance))).max()))
    assert worst > 0.3


def test_frames_that_follow_fast_are_not_independent():
    options = FilterOptions(evidence_rate_hz=20.0)
    assert options.independence(1.0 / 50.0) == pytest.approx(0.4)
    assert options.independence(1.0 / 8.0) == 1.0
    assert options.independence(0.0) == 1.0, "the first frame"
    assert FilterOptions.thesis().independence(0.001) == 1.0


def test_evidence_of_dependent_frames_counts_less(pointing):
    found = []
    for independence in (1.0, 0.5):
        filter_ = ParticleFilter(Propagation(Vocabulary([pointing]), Grammar.loop("pointing")), seed=0)
        values = np.linspace(-4.0, 0.0, 400)
        filter_.measure(values, independence)
        found.append(np.log(filter_.particles.weights[-1] / filter_.particles.weights[0]))
    np.testing.assert_allclose(found, [4.0, 2.0], rtol=1e-9)


def test_beginning_again_keeps_the_fraction_that_stays(pointing):
    vocabulary = Vocabulary([pointing])
    filter_ = ParticleFilter(Propagation(vocabulary, Grammar.loop("pointing")), FilterOptions(100), seed=0)
    filter_.particles.tau[:] = 0.7
    filter_.begin_again(fraction=0.3)
    assert len(filter_.particles) == 100
    assert (filter_.particles.tau == 0.7).sum() == 70
    assert (filter_.particles.tau == 0.0).sum() == 30


def test_options_are_checked():
    with pytest.raises(InputError, match="at least 2"):
        FilterOptions(n_particles=1)
    with pytest.raises(InputError, match="evidence_rate_hz"):
        FilterOptions(evidence_rate_hz=0.0)
    with pytest.raises(InputError, match="min_effective"):
        FilterOptions(min_effective=1.0)


def test_exploring_moves_a_fraction_anywhere_and_keeps_all_weights(pointing):
    """Particles in the base pose, so that those that were moved are told by their progress."""
    propagation = Propagation(Vocabulary([pointing]), Grammar.loop("pointing"))
    made = ParticleFilter(propagation, FilterOptions(n_particles=2000), seed=3)
    made.measure(np.random.default_rng(0).standard_normal(2000))
    before = made.particles
    made.explore(0.1)
    moved = made.particles.tau > 0.0
    assert 0.07 < moved.mean() < 0.13
    np.testing.assert_array_equal(made.particles.weights, before.weights)
    np.testing.assert_array_equal(made.particles.poses[~moved], before.poses[~moved])
    assert np.ptp(made.particles.tau[moved]) > 0.8
    made.explore(0.0)
    np.testing.assert_array_equal(made.particles.tau > 0.0, moved)
