"""Propagation of 6.4.4 as corrected, alike at any frame rate, and what is added to it."""

from dataclasses import replace

import numpy as np
import pytest

from paramove.action_space.grammar import Grammar
from paramove.action_space.propagation import Propagation, PropagationOptions, reflected
from paramove.action_space.vocabulary import Vocabulary
from paramove.documents.input_error import InputError
from tests.action_space.toy import toy_action

N = 20_000
THERE_AND_BACK = np.concatenate([np.linspace(0.0, 1.0, 11), np.linspace(1.0, 0.0, 11)])[:, None] * np.ones(9)


def propagation(options, **action):
    return Propagation(Vocabulary([toy_action(**action)]), Grammar.loop("toy"), options)


def particles_at(made, tau, theta=0.5, seed=0):
    rng = np.random.default_rng(seed)
    particles = made.at_base(N, rng)
    return replace(particles, tau=np.full(N, tau), theta=np.full_like(particles.theta, theta)), rng


def after(made, particles, rng, rate_hz, duration_s):
    for _ in range(round(rate_hz * duration_s)):
        particles = made.predicted(particles, 1.0 / rate_hz, rng)
    return particles


def test_progress_at_8_hz_is_that_of_the_thesis():
    made = propagation(PropagationOptions.thesis(), duration_s=2.5)
    particles, rng = particles_at(made, 0.4)
    tau = made.predicted(particles, 1.0 / 8.0, rng).tau
    step = 1.0 / (8.0 * 2.5)
    assert tau.mean() == pytest.approx(0.4 + step, abs=4 * 0.7 * step / np.sqrt(N))
    assert tau.std() == pytest.approx(0.7 * step, rel=0.03)


def test_diffusion_of_theta_at_8_hz_is_that_of_figure_6_9():
    made = propagation(PropagationOptions.thesis(), duration_s=1e9, bounds=(-50.0, 50.0))
    for tau in (0.0, 0.25, 0.5, 0.99):
        particles, rng = particles_at(made, tau)
        spread = made.predicted(particles, 1.0 / 8.0, rng).theta.std(axis=0)
        np.testing.assert_allclose(spread, 0.4 * np.exp(-2.0 * np.log(4.0) * tau), rtol=0.03)


@pytest.mark.parametrize("rate_hz", [8.0, 20.0, 50.0])
def test_a_second_is_the_same_at_any_frame_rate(rate_hz):
    still = {"deviation_renewed": 0.0, "mirrored": 0.0, "from_base": 0.0, "from_prior": 0.0}
    options = PropagationOptions(pace=0.7, theta_share=0.0, theta_min=0.0, **still)
    made = propagation(options, duration_s=4.0, bounds=(-50.0, 50.0))
    particles, rng = particles_at(made, 0.5)
    begun = particles.deviation
    particles = after(made, particles, rng, rate_hz, 1.0)
    assert particles.tau.mean() == pytest.approx(0.5 + 0.25, abs=0.005)
    assert particles.tau.std() == pytest.approx(options.pace / 4.0 / np.sqrt(8.0), rel=0.05)
    # sigma(tau) falls on the way, so the sum over a second depends a little on its steps.
    np.testing.assert_allclose(particles.theta.std(axis=0), 0.21, rtol=0.05)
    kept = np.mean(begun * particles.deviation)
    assert kept == pytest.approx(np.exp(-1.0 / options.deviation_memory_s), abs=0.02)
    assert particles.deviation.std() == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("rate_hz", [8.0, 50.0])
def test_progress_can_wait_at_the_beginning(rate_hz):
    made = propagation(PropagationOptions.thesis(), duration_s=3.0)
    particles, rng = particles_at(made, 0.0)
    moved = made.predicted(particles, 1.0 / rate_hz, rng)
    assert (moved.tau >= 0.0).all()
    assert (moved.tau == 0.0).mean() > 0.05


def test_a_fresh_deviation_in_every_frame_is_the_thesis():
    made = propagation(PropagationOptions.thesis())
    particles, rng = particles_at(made, 0.2)
    moved = made.predicted(particles, 1.0 / 50.0, rng)
    assert abs(np.mean(particles.deviation * moved.deviation)) < 0.02


def test_a_known_target_stays_known():
    """No diffusion larger than a share of what the posterior leaves open."""
    made = propagation(PropagationOptions(theta_floor=0.0, from_prior=0.0, mirrored=0.0, from_base=0.0), duration_s=1e9)
    rng = np.random.default_rng(0)
    theta = 0.5 + 0.03 * rng.standard_normal((N, 2))
    particles = replace(particles_at(made, 0.3)[0], theta=theta)
    spread = made.predicted(particles, 1.0 / 8.0, rng).theta.std(axis=0)
    np.testing.assert_allclose(spread, 0.03 * np.hypot(1.0, 0.5), rtol=0.03)


def test_a_narrow_posterior_still_diffuses_a_little():
    """It may be narrow at a wrong place."""
    options = PropagationOptions(theta_floor=0.2, theta_min=0.0, from_prior=0.0, mirrored=0.0, from_base=0.0)
    made = propagation(options, duration_s=1e9)
    particles, rng = particles_at(made, 0.3)
    spread = made.predicted(particles, 1.0 / 8.0, rng).theta.std(axis=0)
    np.testing.assert_allclose(spread, 0.2 * 0.4 * np.exp(-2.0 * np.log(4.0) * 0.3), rtol=0.03)


@pytest.mark.parametrize("rate_hz", [8.0, 50.0])
def test_some_deviations_are_drawn_anew(rate_hz):
    options = PropagationOptions(deviation_memory_s=1e6, deviation_renewed=0.1)
    made = propagation(options, duration_s=1e9)
    particles, rng = particles_at(made, 0.0)
    begun = particles.deviation
    now = after(made, particles, rng, rate_hz, 0.5).deviation
    kept = np.mean(np.abs(now - begun).max(axis=1) < 0.05)
    assert kept == pytest.approx(0.9**4, abs=0.02)


def test_theta_stays_within_its_bounds():
    made = propagation(PropagationOptions.thesis())
    particles, rng = particles_at(made, 0.0, theta=1.15)
    theta = made.predicted(particles, 1.0 / 8.0, rng).theta
    assert theta.min() >= -0.2
    assert theta.max() <= 1.2
    assert theta.std() > 0.2


def test_reflection_at_the_bounds():
    low, high = np.array([-0.2]), np.array([1.2])
    values = np.array([-0.3, 1.3, 0.5, 1.2 + 1.4 + 0.1])
    np.testing.assert_allclose(reflected(values, low, high), [-0.1, 1.1, 0.5, -0.1], atol=1e-12)


def test_way_out_and_way_back_are_kept_apart_by_mirrored_particles():
    options = PropagationOptions(pace=0.0, mirrored=0.05, from_base=0.0, from_prior=0.0)
    made = propagation(options, duration_s=1e9, path=THERE_AND_BACK)
    particles, rng = particles_at(made, 0.2)
    tau = made.predicted(particles, 1.0 / 8.0, rng).tau
    jumped = np.abs(tau - 0.2) > 0.01
    assert jumped.mean() == pytest.approx(0.05, abs=0.006)
    np.testing.assert_allclose(tau[jumped], 0.8, atol=0.05)


def test_shares_that_jump_in_a_second_do_not_depend_on_the_frame_rate():
    counts = []
    for rate_hz in (8.0, 50.0):
        options = PropagationOptions(pace=0.0, mirrored=0.0, from_base=0.03, from_prior=0.0)
        made = propagation(options, duration_s=1e9)
        particles, rng = particles_at(made, 0.5)
        counts.append((after(made, particles, rng, rate_hz, 1.0).tau < 0.1).mean())
    np.testing.assert_allclose(counts, 1.0 - 0.97**8, atol=0.012)


def test_an_unknown_theta_is_drawn_anew_and_a_known_one_is_not():
    options = PropagationOptions(theta=0.0, theta_min=0.0, mirrored=0.0, from_base=0.0, from_prior=0.2)
    made = propagation(options, duration_s=1e9)
    particles, rng = particles_at(made, 0.3)
    np.testing.assert_allclose(made.predicted(particles, 1.0 / 8.0, rng).theta, 0.5, rtol=1e-12)
    unknown = replace(particles, theta=rng.random(particles.theta.shape))
    changed = (np.abs(made.predicted(unknown, 1.0 / 8.0, rng).theta - unknown.theta) > 1e-9).all(axis=1)
    assert changed.mean() == pytest.approx(0.2, abs=0.02)


def test_the_same_seed_gives_the_same_particles():
    made = propagation(PropagationOptions())
    results = []
    for _ in range(2):
        particles, rng = particles_at(made, 0.1, seed=4)
        results.append(after(made, particles, rng, 8.0, 1.0))
    np.testing.assert_array_equal(results[0].poses, results[1].poses)


def test_options_are_checked():
    with pytest.raises(InputError, match="pace"):
        PropagationOptions(pace=-1.0)
    with pytest.raises(InputError, match=r"at most 0\.5"):
        PropagationOptions(mirrored=0.7)


def retargeting(tau, free=True, **others):
    """Theta after one frame at 8 Hz in which only retargeting moves it; the place matters in the second half alone."""
    still = PropagationOptions(
        theta=0.0, theta_min=0.0, deviation_renewed=0.0, mirrored=0.0, from_base=0.0, from_prior=0.0, **others
    )
    action = toy_action(duration_s=1e9, bounds=(-0.2, 1.2))
    action.__dict__["place_dependence"] = np.array([[0.0, 0.0, 0.0, 1.0, 1.0]])
    made = Propagation(Vocabulary([action]), Grammar.loop("toy"), still)
    made._free[:] = free
    particles, rng = particles_at(made, tau)
    moved = made.predicted(particles, 1.0 / 8.0, rng)
    np.testing.assert_allclose(moved.tau, tau, rtol=0.0, atol=1e-6)
    return moved.theta


def test_a_share_of_the_arms_at_their_target_goes_on_to_another():
    theta = retargeting(0.9, retargeted=0.2, retarget=0.15)
    moved = (np.abs(theta - 0.5) > 1e-9).all(axis=1)
    assert moved.mean() == pytest.approx(0.2, abs=4 * np.sqrt(0.16 / N))
    assert theta[moved].std(axis=0) == pytest.approx([0.15, 0.15], rel=0.05)


def test_no_arm_is_retargeted_on_its_way_or_by_default():
    np.testing.assert_allclose(retargeting(0.3, retargeted=0.2), 0.5, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(retargeting(0.9), 0.5, rtol=0.0, atol=1e-9)


def test_a_place_that_was_handed_over_is_not_retargeted():
    np.testing.assert_allclose(retargeting(0.9, free=False, retargeted=0.2), 0.5, rtol=0.0, atol=1e-9)


def test_retargeted_places_stay_within_bounds():
    theta = retargeting(0.9, retargeted=0.5, retarget=2.0)
    assert theta.min() >= -0.2
    assert theta.max() <= 1.2


def test_more_than_half_cannot_be_retargeted():
    with pytest.raises(InputError, match="retargeted"):
        PropagationOptions(retargeted=0.6)
