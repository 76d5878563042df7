"""Movements from the knee to a direction, and the model that learns them."""

import numpy as np
import pytest

from paramove.demonstrations.synthetic import RESTING_SHOULDER
from studies.real_images import pointing_model, seated_person
from tests.studies.real_images.synthetic_recording import write_lens


@pytest.fixture(scope="module")
def person(tmp_path_factory):
    camera = write_lens(tmp_path_factory.mktemp("lens"))
    placement = seated_person.by_hand(camera).placement
    rest = seated_person.resting_pose(camera)
    return placement, rest, seated_person.SIZES.scaled(1.0 / placement.scale)


def test_theta_runs_from_across_the_body_to_the_right_and_upwards():
    across, right, up = pointing_model.direction_place([[0.0, 0.4], [1.0, 0.4], [0.4, 1.0]]) - RESTING_SHOULDER
    assert across[1] > 1.0
    assert right[1] < -1.5
    assert up[2] > 1.5


def test_a_movement_goes_from_the_knee_to_the_direction_and_back(person):
    placement, rest, arm = person
    poses = pointing_model.movement(np.array([0.7, 0.5]), arm, placement.in_model(rest), np.random.default_rng(0))
    upper = np.linalg.norm(poses[:, 3:6] - poses[:, :3], axis=1)
    np.testing.assert_allclose(upper, arm.upper_arm, rtol=0.0, atol=0.01)
    np.testing.assert_allclose(poses[[0, -1], 6:], np.tile(placement.in_model(rest)[6:], (2, 1)), rtol=0.0, atol=0.1)
    held = poses[len(poses) // 2]
    line = (held[6:] - held[:3]) / np.linalg.norm(held[6:] - held[:3])
    meant = pointing_model.direction_place([0.7, 0.5]) - RESTING_SHOULDER
    assert line @ meant / np.linalg.norm(meant) > np.cos(0.12)


def test_the_model_points_where_theta_says(person, tmp_path):
    placement, rest, _ = person
    action = pointing_model.pointing_action(seated_person.SIZES, rest, placement, tmp_path)
    theta = np.array([[u, v] for u in (0.1, 0.5, 0.9) for v in (0.1, 0.5, 0.9)])
    poses = action.poses(theta, np.full(len(theta), 0.5))
    lines = poses[:, 6:] - poses[:, :3]
    meant = action.target(theta) - RESTING_SHOULDER
    cosines = (lines * meant).sum(axis=1) / np.linalg.norm(lines, axis=1) / np.linalg.norm(meant, axis=1)
    assert np.degrees(np.arccos(cosines)).max() < 9.0
    knee = placement.in_world(action.poses([[0.5, 0.5]], [0.0])[0])
    np.testing.assert_allclose(knee, rest, rtol=0.0, atol=0.03)
