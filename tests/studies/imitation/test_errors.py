"""The errors of thesis 5.2.7 on cases that can be done by hand."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.motion.reaching_movement import ArmPoses
from studies.imitation.errors import Movement, RobotArm, errors_of, largest, pairs, ranges

N = 80
LINE = np.stack([np.linspace(0.0, 0.2, N), np.zeros(N), np.zeros(N)], axis=1)


def shifted(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    """A straight path beside `LINE`, mm."""
    return LINE + 1e-3 * np.array([x, y, z])


def movement(q: np.ndarray, r: np.ndarray, q_set: np.ndarray, *, limited: slice = slice(0, 0)) -> Movement:
    outside = np.zeros((N, 5))
    outside[limited, 3] = 0.1
    within = RobotArm(q_set + np.array([0.0, 0.0, 0.002]), r + np.array([0.0, 0.003, 0.0]), np.zeros(N))
    return Movement(ArmPoses(q, r, LINE), RobotArm(q_set, r, np.zeros(N)), within, outside)


SYNTHESISED = movement(shifted(y=25), shifted(y=8), shifted(y=16), limited=slice(20, 22))
REFERENCE = movement(shifted(), shifted(), shifted(y=10), limited=slice(58, 59))


def test_each_error_is_the_distance_that_the_thesis_defines() -> None:
    found = errors_of(SYNTHESISED, REFERENCE, aligned=False)
    np.testing.assert_array_equal(found.state, np.arange(1, 81))
    for values, expected in (
        (found.gripper, 8.0),
        (found.elbow, 25.0),
        (found.effective, 6.0),
        (found.min_imitation, 10.0),
        (found.imitation, 16.0),
    ):
        np.testing.assert_allclose(values, expected, rtol=0, atol=1e-9)


def test_states_are_limited_where_either_movement_is() -> None:
    found = errors_of(SYNTHESISED, REFERENCE, aligned=False)
    np.testing.assert_array_equal(np.flatnonzero(found.limited) + 1, [21, 22, 59])
    assert found.significant.sum() == 41
    assert found.state[found.significant][[0, -1]].tolist() == [20, 60]


def test_executed_errors_are_those_of_the_arm_within_its_limits() -> None:
    found = errors_of(SYNTHESISED, REFERENCE, aligned=False, executed=True)
    np.testing.assert_allclose(found.gripper, 11.0, rtol=0, atol=1e-9)  # the gripper moved by 3 mm more
    np.testing.assert_allclose(found.effective, 6.0, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.imitation, np.hypot(16.0, 2.0), rtol=0, atol=1e-9)


def test_time_warping_removes_a_difference_of_progress() -> None:
    progress = np.linspace(0.0, 1.0, N)
    ahead = np.stack([0.2 * progress**1.2, np.zeros(N), np.zeros(N)], axis=1)
    late = movement(ahead, ahead, ahead)
    plain = errors_of(late, movement(LINE, LINE, LINE), aligned=False)
    warped = errors_of(late, movement(LINE, LINE, LINE), aligned=True)
    assert plain.gripper.max() > 10.0
    assert warped.gripper.max() < 0.3 * plain.gripper.max()
    i, j = pairs(ahead, LINE, True)
    assert (i[0], j[0], i[-1], j[-1]) == (0, 0, N - 1, N - 1)
    assert set(np.diff(i)) | set(np.diff(j)) <= {1, 2}  # (B.8)


@pytest.mark.parametrize(
    ("states", "words"), [([], "none"), ([37], "37"), ([20, 21, 22, 59, 57, 60], "20-22, 57, 59-60"), ([5, 5], "5")]
)
def test_states_in_words(states: list[int], words: str) -> None:
    assert ranges(np.array(states, dtype=np.int64)) == words


def test_the_largest_of_nothing_is_none() -> None:
    assert largest(np.array([1.0, 5.0]), np.array([False, False])) is None
    assert largest(np.array([1.0, 5.0]), np.array([True, False])) == 1.0
