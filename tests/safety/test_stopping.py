"""The controlled stop: along the path, within its limits, at rest at the end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.safety.stopping import longest_path_s, stop_ramp, straight_move
from tests.robots.hoap3.movements import HOAP3, swing

LIMITS = HOAP3.motion_limits
PATH = swing(HOAP3, duration_s=1.1)


@settings(deadline=None, max_examples=60, derandomize=True)
@given(at=st.integers(min_value=8, max_value=1000))
def test_every_stop_of_a_fast_swing_is_within_the_limits_and_on_the_path(at: int) -> None:
    ramp = stop_ramp(PATH[at], PATH[at + 1 :], LIMITS)
    rows = np.concatenate(
        [PATH[at - 8 : at + 1], ramp, np.repeat((ramp if len(ramp) else PATH[at : at + 1])[-1:], 8, axis=0)]
    )
    acceleration = np.abs(rows[8:] - 2 * rows[4:-4] + rows[:-8]) / 16e-6
    assert (acceleration <= LIMITS.stop_acceleration * 1.001).all()
    assert (np.abs(np.diff(rows, axis=0)) <= LIMITS.velocity * 1e-3 * 1.001).all()
    assert len(ramp) <= 400
    # Each row of the ramp lies on the path: its place by one joint gives the others.
    joint = HOAP3.index("right_elbow")
    for row in ramp[:: max(1, len(ramp) // 20)]:
        place = np.interp(row[joint], PATH[:, joint], np.arange(len(PATH)))
        on_path = PATH[int(place)] + (place % 1) * (PATH[min(int(place) + 1, len(PATH) - 1)] - PATH[int(place)])
        np.testing.assert_allclose(row, on_path, rtol=0, atol=1e-6)


def test_at_rest_nothing_is_needed() -> None:
    assert len(stop_ramp(PATH[0], np.repeat(PATH[:1], 5, axis=0), LIMITS)) == 0


def test_where_the_path_is_cut_the_ramp_goes_straight_on_and_stays_in_range() -> None:
    ramp = stop_ramp(PATH[500], PATH[501:504], LIMITS)
    assert (ramp <= LIMITS.upper).all()
    rows = np.concatenate([PATH[490:501], ramp])
    acceleration = np.abs(rows[8:] - 2 * rows[4:-4] + rows[:-8]) / 16e-6
    assert (acceleration <= LIMITS.stop_acceleration * 1.001).all()
    np.testing.assert_allclose(ramp[-1], ramp[-2], rtol=0, atol=1e-5)


def test_a_path_that_is_cut_is_continued_at_its_last_speed() -> None:
    """While it still accelerates, so that going on otherwise would end elsewhere."""
    rows = PATH[101:104]
    onward = rows[-1] + np.outer(np.arange(1, 1000), np.ones(28)) * (rows[-1] - rows[-2])
    ramp = stop_ramp(PATH[100], rows, LIMITS)
    np.testing.assert_allclose(ramp, stop_ramp(PATH[100], np.concatenate([rows, onward]), LIMITS), rtol=0, atol=1e-9)


@pytest.mark.parametrize(("kind", "order"), [("velocity", 1), ("acceleration", 2), ("jerk", 3)])
def test_a_straight_move_is_as_fast_as_its_tightest_limit_allows(kind: str, order: int) -> None:
    wide = {name: np.full(28, 1e9) for name in ("velocity", "acceleration", "jerk")}
    limits = replace(LIMITS, **{**wide, kind: np.full(28, 0.5)})
    goal = PATH[0] + np.linspace(-1.0, 0.8, 28)
    rows = np.concatenate([np.repeat(PATH[:1], 3, axis=0), straight_move(PATH[0], goal, limits)])
    # The jerk of this profile is largest at its two ends, where it jumps: difference quotients inside see it from 0.
    peak = np.abs(np.diff(rows[3:], n=order, axis=0)).max() / limits.dt_s**order
    assert 0.496 < peak <= 0.5 * 1.001
    np.testing.assert_allclose(rows[-1], goal, rtol=0, atol=1e-12)
    assert (rows[3] != rows[2]).any(), "the first row is one step on"


def test_a_straight_move_to_where_it_is_is_one_row() -> None:
    np.testing.assert_array_equal(straight_move(PATH[0], PATH[0], LIMITS), PATH[:1])


def test_the_longest_path_is_what_a_stop_from_the_operating_velocity_runs_over() -> None:
    cruise = PATH[:1] + np.outer(np.arange(1, 600), LIMITS.velocity * LIMITS.dt_s)
    ramp = stop_ramp(PATH[0], cruise, LIMITS)
    run_over = (ramp[-1] - PATH[0]) / LIMITS.velocity
    np.testing.assert_allclose(run_over, run_over[0], rtol=0, atol=1e-9)
    assert run_over[0] < longest_path_s(LIMITS) <= run_over[0] + 2.1 * LIMITS.dt_s


def test_a_stop_keeps_what_is_left_of_acceleration_and_jerk_and_takes_no_longer_than_that() -> None:
    """At constant speed all of it is the stop's own: 1.5 v/T, or 6 v/T² and 3 a/T."""
    for spare, jerk, bound in ((1e6, 0.7, "jerk"), (0.5, 1e4, "acceleration")):
        one = np.full(28, 1.0)
        limits = replace(
            LIMITS, velocity=one, acceleration=0.1 * one, stop_acceleration=(0.1 + spare) * one, jerk=jerk * one
        )
        speed = 0.2003
        cruise = PATH[:1] + np.outer(np.arange(1, 9000), speed * limits.dt_s * one)
        ramp = stop_ramp(PATH[0], cruise, limits)
        if bound == "acceleration":
            expected = 1.5 * speed / spare
        else:
            expected = (3 * 0.1 + np.sqrt(9 * 0.01 + 24 * jerk * speed)) / (2 * jerk)
        assert len(ramp) == np.ceil(expected / limits.dt_s)
        np.testing.assert_allclose(ramp[-1] - PATH[0], speed * limits.dt_s * len(ramp) / 2, rtol=0, atol=1e-9)


def test_joints_that_do_not_move_make_no_stop_longer() -> None:
    slow = replace(LIMITS, jerk=np.where(np.arange(28) == 0, 0.1, 1.0) * LIMITS.jerk)
    still = PATH.copy()
    still[:, 0] = still[0, 0]
    np.testing.assert_array_equal(stop_ramp(still[500], still[501:], slow), stop_ramp(still[500], still[501:], LIMITS))
