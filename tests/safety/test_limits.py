"""Rows against the limits: at the limit they pass, beyond it the first rule that is broken is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.safety_steps import NAMES, limits_at
from paramove.safety.limits import JERK_SPAN_S, SPAN_S, MotionLimits

LIMITS = limits_at(0.01)
REST = np.zeros((1, 3))


def rows_of(first_joint: list[float] | np.ndarray) -> np.ndarray:
    rows = np.zeros((len(first_joint), 3))
    rows[:, 0] = first_joint
    return rows


def code(rows: np.ndarray, before: np.ndarray = REST, limits: MotionLimits = LIMITS, **how: bool) -> str:
    found = limits.first_violation(rows, before, **how)
    return found.code if found else ""


def only(**limit: float) -> MotionLimits:
    """Limits of which one matters."""
    wide = {
        name: np.full(3, 1e9) for name in ("motor_velocity", "velocity", "acceleration", "stop_acceleration", "jerk")
    }
    return replace(LIMITS, **{**wide, **{name: np.full(3, value) for name, value in limit.items()}})


@pytest.mark.parametrize(
    ("dt_s", "span", "jerk_span"), [(0.001, 4, 12), (0.002, 2, 6), (0.004, 1, 3), (0.01, 1, 1), (0.02, 1, 1)]
)
def test_spans_are_times_and_at_least_one_row(dt_s: float, span: int, jerk_span: int) -> None:
    limits = limits_at(dt_s)
    assert (limits.span, limits.jerk_span, limits.history) == (span, jerk_span, 3 * jerk_span)
    assert (SPAN_S, JERK_SPAN_S) == (0.004, 0.012)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_told_first_and_where(value: float) -> None:
    rows = rows_of([0.0, 5.0, value])
    found = LIMITS.first_violation(rows, REST)
    assert found is not None
    assert (found.code, found.row, found.joint, found.allowed) == ("not_finite", 2, "shoulder", "a finite number")
    allowed = "deg, allowed a finite number"
    assert found.message == f"joint shoulder is not a finite number at row 2: requested {value} {allowed}"


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_rows_after_a_pose_that_is_not_known_do_not_pass(value: float) -> None:
    assert code(rows_of([0.0, 0.0]), np.full((1, 3), value)) != ""


@pytest.mark.parametrize("side", [1, -1])
def test_the_position_range_is_judged_exactly(side: int) -> None:
    limits = only()
    at_limit = rows_of([side * 1.5])
    assert code(at_limit, rows_of([side * 1.49]), limits) == ""
    found = limits.first_violation(at_limit + side * 1e-6 * np.array([1, 0, 0]), rows_of([side * 1.49]))
    assert found is not None
    assert (found.code, found.row, found.joint, found.unit) == ("joint_limit", 0, "shoulder", "deg")
    assert found.allowed == "-85.94 to 85.94 deg"
    np.testing.assert_allclose(found.requested, side * 85.94375, rtol=0, atol=1e-4)


def test_outside_its_range_a_joint_may_stay_or_come_back_slowly_but_not_go_on() -> None:
    outside = rows_of([1.6])
    limits = only(velocity=3.0, motor_velocity=4.0)
    assert code(rows_of([1.6, 1.6]), outside, limits) == ""
    assert code(rows_of([1.6 - 0.0059, 1.6 - 0.0118]), outside, limits) == ""
    assert code(rows_of([1.6 - 0.0061]), outside, limits) == "velocity"
    assert code(rows_of([1.6 + 1e-6]), outside, limits) == "joint_limit"
    assert code(rows_of([1.59, 1.595]), outside, only()) == "joint_limit"
    assert code(rows_of([1.49, 1.46]), rows_of([1.5]), limits) == ""
    back_inside = rows_of([1.505, 1.4995, 1.475, 1.45])
    assert code(back_inside, rows_of([1.51]), limits) == "", "as fast as usual once it is inside"


def test_a_billionth_of_a_radian_outside_is_still_inside() -> None:
    limits = replace(only(velocity=3.0), lower=np.full(3, -1.0), upper=np.zeros(3))
    assert code(rows_of([1e-9]), REST, limits) == ""
    assert code(rows_of([1.1e-9]), REST, limits) == "joint_limit"
    assert code(rows_of([-0.029]), rows_of([1e-9]), limits) == "", "so it need not come back slowly"


@pytest.mark.parametrize(
    ("kind", "order", "unit"),
    [("velocity", 1, "deg/s"), ("acceleration", 2, "deg/s²"), ("jerk", 3, "deg/s³")],
)
def test_each_limit_passes_what_is_at_it_and_refuses_a_thousandth_more(kind: str, order: int, unit: str) -> None:
    for dt_s in (0.01, 0.001):
        limits = replace(only(**{kind: 2.0}), dt_s=dt_s)
        t = dt_s * np.arange(1, 60)
        profile = 2.0 * t**order / [0, 1, 2, 6][order]
        history = np.zeros((limits.history, 3))
        assert code(rows_of(profile), history, limits) == ""
        found = limits.first_violation(rows_of(profile * (1.003 if order < 3 else 4.0)), history)
        assert found is not None
        assert (found.code, found.joint, found.unit) == (kind, "shoulder", unit)
        assert found.allowed.endswith(unit)
        assert found.requested > np.rad2deg(2.0)


@pytest.mark.parametrize(
    ("kind", "order", "allowed"),
    [("velocity", 1, "114.7 deg/s"), ("acceleration", 2, "114.7 deg/s²"), ("jerk", 3, "343.9 deg/s³")],
)
def test_what_was_found_and_the_limit_with_its_slack_are_told(kind: str, order: int, allowed: str) -> None:
    t = 0.01 * np.arange(1, 5)
    rows = rows_of(9.0 * t**order / [0, 1, 2, 6][order])
    found = only(**{kind: 2.0}).first_violation(rows, np.zeros((3, 3)))
    assert found is not None
    assert (found.code, found.allowed) == (kind, allowed)
    first = np.concatenate([rows[found.row :: -1, 0], np.zeros(3)])[:4]  # the rows before are zero
    value = [first @ [1, -1, 0, 0], first @ [1, -2, 1, 0], first @ [1, -3, 3, -1]][order - 1] / 0.01**order
    np.testing.assert_allclose(found.requested, np.rad2deg(value), rtol=1e-9)


def test_a_jerk_at_its_limit_passes_where_rounding_is_nothing_beside_it() -> None:
    t = LIMITS.dt_s * np.arange(1, 5)
    for share, expected in ((1.0, ""), (1.0009, ""), (1.0012, "jerk")):
        assert code(rows_of(share * 1e5 * t**3 / 6), np.zeros((3, 3)), only(jerk=1e5)) == expected


def test_the_jerk_allows_for_angles_rounded_to_six_decimals() -> None:
    for dt_s in (0.01, 0.001):
        limits = replace(only(jerk=1e-3), dt_s=dt_s)
        noise = 0.5e-6 * np.where(np.arange(400) // limits.jerk_span % 2, 1.0, -1.0)
        assert code(rows_of(noise), np.tile(rows_of(noise[:1]), (limits.history, 1)), limits) == ""
        assert code(rows_of(1.5 * noise), np.tile(rows_of(1.5 * noise[:1]), (limits.history, 1)), limits) == "jerk"


def test_a_jump_is_more_than_one_and_a_half_times_what_motors_can() -> None:
    limits = replace(only(motor_velocity=4.0), dt_s=0.125)
    assert code(rows_of([0.75]), REST, limits) == ""
    found = limits.first_violation(rows_of([0.0, 0.751]), REST)
    assert found is not None
    assert (found.code, found.row, found.allowed, found.unit) == ("jump", 1, "343.8 deg/s", "deg/s")
    facts = "joint shoulder jumps from 0 to 43.03 deg at row 1: requested 344.2 deg/s, allowed 343.8 deg/s"
    assert facts in found.message


def test_what_lies_before_a_short_history_is_rest() -> None:
    limits = only(acceleration=2.0)
    moving = rows_of(0.01 * np.arange(20))
    assert code(moving[10:], moving[:10], limits) == ""
    assert code(moving[10:], moving[9:10], limits) == "acceleration"


@pytest.mark.parametrize("known", [1, 2, 3, 4])
def test_rows_are_counted_from_the_first_that_is_judged(known: int) -> None:
    found = only().first_violation(rows_of([0.0, 1.6]), np.zeros((known, 3)))
    assert found is not None
    assert (found.code, found.row) == ("joint_limit", 1)


def test_rest_at_the_end_is_judged_where_it_is_asked_for() -> None:
    limits = only(acceleration=2.0)
    moving = rows_of(0.01 * np.arange(20))
    assert code(moving[10:], moving[:10], limits) == ""
    assert code(moving[10:], moving[:10], limits, rest_at_end=True) == "acceleration"
    found = limits.first_violation(moving[10:], moving[:10], rest_at_end=True)
    assert found is not None
    assert found.row == 10


def test_a_stop_may_use_more_acceleration_and_twice_the_jerk_and_must_end_at_rest() -> None:
    t = 0.01 * np.arange(1, 30)
    faster = rows_of(1.5 * t**2)
    limits = only(acceleration=2.0, stop_acceleration=4.0)
    still = np.zeros((3, 3))
    assert code(faster, still, limits) == "acceleration"
    # It would have to stop at once at its end.
    assert code(faster, still, limits, stopping=True) == "acceleration"
    limits = replace(limits, stop_acceleration=np.full(3, 1e9))
    assert code(faster, still, limits, stopping=True) == ""
    pattern = np.repeat([1.0, -1.0, -1.0, 1.0], 4) * 2000.0 * LIMITS.dt_s**3
    there_and_rest = np.cumsum(np.cumsum(np.cumsum(pattern)))
    for share, usual, stopping in ((0.9, "", ""), (1.9, "jerk", ""), (2.1, "jerk", "jerk")):
        rows = rows_of(share * there_and_rest)
        sharp = replace(only(jerk=2000.0), stop_acceleration=np.full(3, 1e9))
        assert code(rows, still, sharp, rest_at_end=True) == ("" if share < 1 else usual)
        assert code(rows, still, sharp, stopping=True) == stopping


def test_all_joints_are_judged() -> None:
    for joint, name in enumerate(NAMES):
        rows = np.zeros((4, 3))
        rows[2, joint] = 9.0
        found = LIMITS.first_violation(rows, REST)
        assert found is not None
        assert (found.joint, found.row) == (name, 2)
