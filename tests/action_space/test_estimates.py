"""Equations (6.8) to (6.20) beside sums written out."""

import numpy as np
import pytest

from paramove.action_space.estimates import (
    action_probabilities,
    best_pose,
    mean_pose,
    pose_covariance,
    refined_pose,
    tau_histogram,
    theta_estimate,
)


@pytest.fixture
def particles():
    rng = np.random.default_rng(3)
    weights = rng.random(50)
    return {
        "action": rng.integers(0, 3, 50),
        "theta": rng.random((50, 2)),
        "tau": rng.random(50),
        "poses": 0.1 * rng.standard_normal((50, 9)),
        "weights": weights / weights.sum(),
    }


def test_probability_of_an_action(particles):
    found = action_probabilities(particles["action"], particles["weights"], 4)
    direct = [
        sum(w for a, w in zip(particles["action"], particles["weights"], strict=True) if a == k) for k in range(4)
    ]
    np.testing.assert_allclose(found, direct, rtol=1e-12)
    assert found[3] == 0.0


def test_mean_and_covariance_of_theta(particles):
    chosen = particles["action"] == 2
    theta, weights = particles["theta"][chosen], particles["weights"][chosen]
    found = theta_estimate(theta, weights)
    total = weights.sum()  # (6.12)
    mean = sum(w * t for w, t in zip(weights, theta, strict=True)) / total
    covariance = sum(w * np.outer(t - mean, t - mean) for w, t in zip(weights, theta, strict=True)) / total
    np.testing.assert_allclose(found.mean, mean, rtol=1e-12)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-10)
    np.testing.assert_allclose(found.deviations, [covariance[0, 0] ** 0.5, covariance[1, 1] ** 0.5], rtol=1e-10)
    assert found.deviation == pytest.approx(np.linalg.det(covariance) ** 0.25, rel=1e-10)


def test_deviation_of_a_biparametric_action_is_that_of_its_last_place():
    theta = np.random.default_rng(0).random((30, 4)) * [1.0, 1.0, 0.1, 0.1]
    found = theta_estimate(theta, np.ones(30))
    assert found.deviation == pytest.approx(np.linalg.det(np.cov(theta[:, 2:].T, bias=True)) ** 0.25, rel=1e-10)


def test_histogram_sums_to_one_and_has_each_particle_in_its_bin(particles):
    found = tau_histogram(particles["action"], particles["tau"], particles["weights"], 3, 5)
    assert found.shape == (3, 5)
    assert found.sum() == pytest.approx(1.0)
    second_bin = (particles["action"] == 1) & (particles["tau"] >= 0.2) & (particles["tau"] < 0.4)
    direct = particles["weights"][second_bin].sum()
    assert found[1, 1] == pytest.approx(direct)
    assert tau_histogram(np.array([0]), np.array([1.0]), np.array([1.0]), 1, 5)[0, 4] == 1.0


def test_best_and_mean_pose(particles):
    poses, weights = particles["poses"], particles["weights"]
    np.testing.assert_array_equal(best_pose(poses, weights), poses[np.argmax(weights)])
    np.testing.assert_allclose(mean_pose(poses, weights), sum(w * x for w, x in zip(weights, poses, strict=True)))


def test_refined_pose_is_a_kernel_regression_with_widths_in_metres(particles):
    poses, weights = particles["poses"], particles["weights"]
    pose = poses[np.argmax(weights)]
    for sigma in (0.15, 0.10, 0.05):
        kernels = [w * np.exp(-0.5 * (x - pose) @ (x - pose) / sigma**2) for w, x in zip(weights, poses, strict=True)]
        pose = sum(k * x for k, x in zip(kernels, poses, strict=True)) / sum(kernels)
    np.testing.assert_allclose(refined_pose(poses, weights, best_pose(poses, weights)), pose, rtol=1e-9)


def test_refined_pose_stays_at_its_mode():
    rng = np.random.default_rng(0)
    near, far = rng.normal(0.0, 0.01, (60, 9)), rng.normal(1.0, 0.01, (40, 9))
    found = refined_pose(np.concatenate([near, far]), np.full(100, 0.01), near[0])
    np.testing.assert_allclose(found, near.mean(axis=0), atol=1e-3)


def test_pose_covariance_is_weighted(particles):
    found = pose_covariance(particles["poses"], particles["weights"])
    direct = np.cov(particles["poses"].T, aweights=particles["weights"], bias=True)
    np.testing.assert_allclose(found, direct, rtol=1e-9)
