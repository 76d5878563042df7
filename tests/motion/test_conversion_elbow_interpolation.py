"""Elbows between demonstrated ones: an arm stays an arm."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from paramove.motion.conversion import carried_over, interpolated_elbow

UPPER_ARM, FOREARM = 0.093, 0.145


def arm(direction: np.ndarray, distance: float, swivel: float) -> tuple[np.ndarray, np.ndarray]:
    """Elbow and gripper of an arm with the shoulder in the origin."""
    line = direction / np.linalg.norm(direction)
    along = (UPPER_ARM**2 - FOREARM**2 + distance**2) / (2 * distance)
    down = np.array([-1.0, 0.0, -1.0])
    side = down - (down @ line) * line
    side /= np.linalg.norm(side)
    turned = np.cos(swivel) * side + np.sin(swivel) * np.cross(side, line)
    return along * line + np.sqrt(UPPER_ARM**2 - along**2) * turned, distance * line


TWO_ARMS = [arm(np.array([0.5, 0.7, -0.6]), 0.17, 0.4), arm(np.array([0.8, -0.6, -0.5]), 0.20, 0.9)]
ELBOWS, GRIPPERS = (np.stack(part)[None] for part in zip(*TWO_ARMS, strict=True))


def test_a_demonstrated_pose_stays_as_it_is() -> None:
    for number in range(2):
        weights = np.eye(2)[number][None]
        found = interpolated_elbow(weights, ELBOWS, GRIPPERS)
        np.testing.assert_allclose(found[0], ELBOWS[0, number], rtol=0, atol=1e-12)


@settings(deadline=None, max_examples=50, derandomize=True)
@given(st.floats(0.0, 1.0))
def test_lengths_of_the_arm_stay_where_all_arms_have_the_same(share: float) -> None:
    """The linear mean of the elbows does not keep them."""
    weights = np.array([[1.0 - share, share]])
    elbow = interpolated_elbow(weights, ELBOWS, GRIPPERS)[0]
    gripper = weights[0] @ GRIPPERS[0]
    np.testing.assert_allclose(np.linalg.norm(elbow), UPPER_ARM, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(gripper - elbow), FOREARM, rtol=0, atol=1e-12)
    if 0.2 < share < 0.8:
        assert np.linalg.norm(weights[0] @ ELBOWS[0]) < UPPER_ARM - 0.003


@settings(deadline=None, max_examples=30, derandomize=True)
@given(st.integers(0, 1000))
def test_the_result_turns_with_the_arms(seed: int) -> None:
    """No direction in space is special, unlike with angles from a fixed direction."""
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    weights = np.array([[0.3, 0.7], [1.2, -0.2]])
    elbows, grippers = (np.repeat(part, 2, axis=0) for part in (ELBOWS, GRIPPERS))
    expected = interpolated_elbow(weights, elbows, grippers) @ turn.T
    found = interpolated_elbow(weights, elbows @ turn.T, grippers @ turn.T)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_a_straight_arm_has_its_elbow_on_the_line() -> None:
    gripper = np.array([[[0.0, 0.0, -0.238], [0.02, 0.0, -0.237]]])
    elbow = gripper * UPPER_ARM / (UPPER_ARM + FOREARM)
    found = interpolated_elbow(np.array([[0.5, 0.5]]), elbow, gripper)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[0], elbow[0].mean(axis=0), rtol=0, atol=0.005)


def test_carrying_over_is_the_smallest_rotation() -> None:
    start, end = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    np.testing.assert_allclose(carried_over(start, start, end), end, rtol=0, atol=1e-15)
    across = np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(carried_over(across, start, end), across, rtol=0, atol=1e-15)
    np.testing.assert_allclose(carried_over(end, start, end), -start, rtol=0, atol=1e-15)
