"""A person's reaching as progress along an arm's own path, deviation from it and opening of the hand."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.motion.learned_path import AHEAD, LearnedPath, PlacedPerson
from tests.motion.reaching import movement

AXIS = (0.012, 0.0)
MIDDLE = np.array([0.2, 0.0, 0.0])


def person() -> PlacedPerson:
    return PlacedPerson(movement(), MIDDLE, AXIS, 40)


def way() -> LearnedPath:
    return person().approach(MIDDLE)


def test_goes_from_the_beginning_to_the_end_beside_a_straight_line() -> None:
    learned = way()
    np.testing.assert_allclose(learned.progress[[0, -1]], [0.0, 1.0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(learned.deviation[[0, -1]], 0.0, rtol=0, atol=1e-9)
    assert np.linalg.norm(learned.deviation, axis=1).max() > 0.02
    assert learned.opening.min() >= 0.0
    assert learned.opening.max() <= 1.0


def test_of_a_reach_that_was_not_moved_it_is_the_movement_itself() -> None:
    """About an axis far away an arc is straight, so all that is left is the smoothing of the states."""
    states, opening = movement().approach(movement().centre)
    learned = LearnedPath.of(states, opening, len(states))
    back = learned.between(states.gripper[0], states.gripper[-1], (-1e5, 0.0))
    gaps = np.linalg.norm(back[:, None] - states.gripper[None], axis=-1)
    assert gaps.min(axis=0).mean() < 0.008
    assert gaps.min(axis=0).max() < 0.025  # the synthetic demonstrator's sharp turn at the top is rounded


def test_between_two_points_it_turns_about_the_axis() -> None:
    start, end = np.array([0.2, -0.15, 0.1]), np.array([0.1, 0.2, 0.02])
    path = way().milder(0.0).between(start, end, AXIS)
    np.testing.assert_allclose(path[[0, -1]], [start, end], rtol=0, atol=1e-12)
    radius = np.linalg.norm(path[:, :2] - AXIS, axis=1)
    ends = np.sort(radius[[0, -1]])
    assert radius.min() >= ends[0] - 1e-9
    assert radius.max() <= ends[1] + 1e-9


def test_a_shorter_way_deviates_less_in_proportion() -> None:
    learned = way()
    far = np.array([0.2, 0.0, 0.0]) + np.array([0.0, 0.0, 1.0]) * learned.length
    for fraction in (1.0, 0.5):
        end = np.array([0.2, 0.0, 0.0]) + fraction * (far - [0.2, 0.0, 0.0])
        deviation = learned.between(np.array([0.2, 0.0, 0.0]), end, AXIS) - learned.milder(0.0).between(
            np.array([0.2, 0.0, 0.0]), end, AXIS
        )
        np.testing.assert_allclose(deviation[:, :2], fraction * learned.deviation[:, :2], rtol=0, atol=1e-9)


def test_raised_is_higher_in_the_middle_only() -> None:
    lifted = way().raised(0.05).deviation - way().deviation
    np.testing.assert_allclose(lifted[[0, -1]], 0.0, rtol=0, atol=1e-12)
    assert lifted[:, 2].max() == pytest.approx(0.05, rel=0.02)


def test_the_person_turns_towards_what_lies_far_aside() -> None:
    """Targets on a circle beyond straight ahead ± 45 degrees are the same to a person who has turned."""
    ways = []
    for azimuth in (AHEAD, AHEAD + 0.4, AHEAD + 0.9):
        target = np.array([AXIS[0] + 0.2 * np.cos(azimuth), 0.2 * np.sin(azimuth), 0.05])
        ways.append(person().approach(target))
    for other, turn in zip(ways[1:], (0.4, 0.9), strict=True):
        np.testing.assert_allclose(other.progress, ways[0].progress, rtol=0, atol=1e-9)
        cosine, sine = np.cos(turn), np.sin(turn)
        rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        np.testing.assert_allclose(other.deviation, ways[0].deviation @ rotation.T, rtol=0, atol=1e-9)


def test_the_middle_of_the_training_lies_where_it_was_placed() -> None:
    assert person().within_training(MIDDLE)
    assert not person().within_training(np.array([0.7, 0.0, 0.0]))


def test_the_retreat_goes_back() -> None:
    back = person().retreat(MIDDLE)
    np.testing.assert_allclose(back.progress[[0, -1]], [0.0, 1.0], rtol=0, atol=1e-9)
