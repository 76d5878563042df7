"""Postures drawn from a density become postures of the arm."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from paramove.demonstrations import ArmLengths
from paramove.documents.input_error import InputError
from paramove.observation import ArmSizes, fitted_poses

SIZES = ArmSizes()
COORDINATES = st.lists(st.floats(-0.6, 0.6), min_size=9, max_size=9)


def lengths(poses):
    points = poses[:, :9].reshape(-1, 3, 3)
    return np.linalg.norm(np.diff(points, axis=1), axis=2)


def test_the_default_is_the_demonstrators_arm():
    arm = ArmLengths()
    assert (SIZES.upper_arm, SIZES.forearm, SIZES.hand) == (arm.upper_arm, arm.forearm, arm.fingertip)


@given(COORDINATES)
@settings(max_examples=200, deadline=None)
def test_lengths_hold_for_every_pose(coordinates):
    pose = np.array([coordinates])
    fitted = fitted_poses(pose, SIZES)
    assert_allclose(lengths(fitted)[0], [SIZES.upper_arm, SIZES.lower_arm], rtol=0.0, atol=1e-9)
    assert_allclose(fitted[:, :3], pose[:, :3], rtol=0.0, atol=0.0)


def test_shoulder_and_hand_stay_and_the_elbow_stays_in_its_plane_and_on_its_side():
    rng = np.random.default_rng(0)
    elbow = rng.normal(size=(200, 3))
    elbow *= 0.3 / np.linalg.norm(elbow, axis=1, keepdims=True)
    hand = rng.normal(size=(200, 3))
    hand *= rng.uniform(0.25, 0.65, (200, 1)) / np.linalg.norm(hand, axis=1, keepdims=True)
    poses = np.concatenate([np.zeros((200, 3)), elbow, hand], axis=1)
    fitted = fitted_poses(poses, SIZES)
    assert_allclose(fitted[:, 6:], hand, rtol=0.0, atol=0.0)
    normal = np.cross(elbow, hand)
    assert_allclose((fitted[:, 3:6] * normal).sum(axis=1), 0.0, rtol=0.0, atol=1e-12)
    assert (np.cross(fitted[:, 3:6], hand) * normal).sum(axis=1).min() > 0.0


def test_no_elbow_of_the_same_plane_is_nearer():
    pose = np.array([[0.0, 0.0, 0.0, 0.10, -0.20, -0.18, 0.40, 0.05, -0.10]])
    fitted = fitted_poses(pose, SIZES)[0]
    axis = pose[0, 6:] / np.linalg.norm(pose[0, 6:])
    along = (fitted[3:6] @ axis) * axis
    other_side = 2.0 * along - fitted[3:6]
    assert np.linalg.norm(fitted[3:6] - pose[0, 3:6]) < np.linalg.norm(other_side - pose[0, 3:6])


def test_a_hand_out_of_reach_leaves_the_arm_stretched_towards_it():
    fitted = fitted_poses(np.array([[0.0, 0, 0, 0.3, 0.1, 0, 2.0, 0, 0]]), SIZES)
    assert_allclose(fitted, [[0, 0, 0, SIZES.upper_arm, 0, 0, SIZES.length, 0, 0]], rtol=0.0, atol=1e-9)


def test_valid_poses_stay_as_they_are_and_fitting_twice_changes_nothing():
    rng = np.random.default_rng(1)
    once = fitted_poses(rng.uniform(-0.5, 0.5, (100, 9)), SIZES)
    assert_allclose(fitted_poses(once, SIZES), once, rtol=0.0, atol=1e-6)


def test_a_wrist_keeps_its_angle_and_its_side():
    rng = np.random.default_rng(2)
    poses = rng.uniform(-0.5, 0.5, (200, 12))
    fitted = fitted_poses(poses, SIZES)
    elbow, hand, wrist = fitted[:, 3:6], fitted[:, 6:9], fitted[:, 9:12]
    assert_allclose(lengths(fitted)[:, 0], SIZES.upper_arm, rtol=0.0, atol=1e-9)
    assert_allclose(np.linalg.norm(wrist - elbow, axis=1), SIZES.forearm, rtol=0.0, atol=1e-9)
    assert_allclose(np.linalg.norm(hand - wrist, axis=1), SIZES.hand, rtol=0.0, atol=1e-9)
    assert_allclose(bends_of(fitted), bends_of(poses), rtol=0.0, atol=1e-6)
    drawn = poses[:, 9:12] - poses[:, 3:6]
    assert ((wrist - elbow) * side_of(drawn, hand - elbow)).sum(axis=1).min() >= 0.0
    assert_allclose(fitted_poses(fitted, SIZES), fitted, rtol=0.0, atol=1e-6)


def test_a_straight_wrist_changes_nothing():
    poses = np.random.default_rng(3).uniform(-0.5, 0.5, (50, 9))
    middle = 0.6 * poses[:, 3:6] + 0.4 * poses[:, 6:9]
    fitted = fitted_poses(np.concatenate([poses, middle], axis=1), SIZES)
    assert_allclose(fitted[:, :9], fitted_poses(poses, SIZES), rtol=0.0, atol=1e-7)


def bends_of(poses):
    """Angle at the wrist, rad."""
    along, on = poses[:, 9:12] - poses[:, 3:6], poses[:, 6:9] - poses[:, 9:12]
    cosine = (along * on).sum(axis=1) / np.linalg.norm(along, axis=1) / np.linalg.norm(on, axis=1)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def side_of(off, line):
    """What of `off` is across `line`."""
    return off - (off * line).sum(axis=1, keepdims=True) / (line * line).sum(axis=1, keepdims=True) * line


def test_a_line_bends_back_and_down_and_nan_stays():
    straight = fitted_poses(np.array([[0.0, 0, 0, 0.2, 0, 0, 0.5, 0, 0]]), SIZES)
    assert straight[0, 5] < -0.05
    broken = fitted_poses(np.array([[0.0, 0, 0, 0.2, 0, 0, np.nan, 0, 0], [0, 0, 0, 0.2, 0, -0.1, 0.4, 0, 0]]), SIZES)
    assert np.isnan(broken[0]).all()
    assert np.isfinite(broken[1]).all()


def test_what_is_no_arm_is_refused():
    with pytest.raises(InputError, match="upper_arm"):
        ArmSizes(upper_arm=0.0)
    with pytest.raises(InputError, match=r"expected poses \(M, 9\)"):
        fitted_poses(np.zeros((3, 8)), SIZES)
