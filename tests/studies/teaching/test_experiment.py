"""One simulated person, and what is measured of the model."""

import numpy as np

from studies.teaching.experiment import along, cameras, run
from studies.teaching.simulated_person import RATE_HZ, key_points, mean_path, performance

TARGET = np.array([0.2, 0.0, 0.0])


def test_two_cameras_reach_new_positions():
    found = run(2, 0)
    assert found["movements"] >= 8
    assert found["end"] < 2.0
    assert found["path"] < 6.0


def test_a_path_is_compared_by_where_it_leads():
    path = mean_path(TARGET, 60)
    slow_at_the_end = np.concatenate([path, np.repeat(path[-1:], 40, axis=0)])
    np.testing.assert_allclose(along(slow_at_the_end), along(path), rtol=0.0, atol=1e-9)


def test_key_points_have_the_measured_noise():
    poses = performance(TARGET, np.random.default_rng(0))
    still = np.repeat(poses[:1], 3000, axis=0)
    found = key_points(still, cameras(1)[0], np.random.default_rng(1))
    hands = np.array([one.positions[0, 3] for one in found])
    near = np.linalg.norm(hands - np.median(hands, axis=0), axis=1) < 20.0
    assert 0.03 < 1.0 - near.mean() < 0.2, "outliers and exchanged sides"
    np.testing.assert_allclose(hands[near].std(axis=0), found[0].deviations[0, 3], rtol=0.15)
    assert RATE_HZ == 15.0
