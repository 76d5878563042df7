"""Jumps of the believed progress are counted, its usual course is not."""

import numpy as np
import pytest

from paramove.action_space.tracker import ProgressJumps


def counted(progress, advance=0.04, spread=0.02, actions=None):
    rng = np.random.default_rng(0)
    jumps = ProgressJumps()
    for number, tau in enumerate(progress):
        action = "a" if actions is None else actions[number]
        particles = np.mod(tau + spread * rng.standard_normal(200), 1.0)
        jumps.update(action, particles, np.full(200, 1.0 / 200.0), advance)
    return jumps.count


def test_the_usual_course_and_a_new_performance_are_no_jumps():
    assert counted(np.mod(np.arange(0.0, 2.4, 0.04), 1.0)) == 0


def test_resting_is_no_jump():
    assert counted(np.full(50, 0.5)) == 0


@pytest.mark.parametrize("there", [0.8, 0.6])
def test_a_change_of_sides_is_one(there):
    assert counted([0.1, 0.15, 0.2, there, there + 0.04]) == 1


def test_there_and_back_are_two():
    assert counted([0.2, 0.24, 0.7, 0.28, 0.32]) == 2


def test_an_uncertain_progress_and_another_action_do_not_count():
    assert counted([0.2, 0.7, 0.2], spread=0.4) == 0
    assert counted([0.9, 0.2], actions=["a", "b"]) == 0
