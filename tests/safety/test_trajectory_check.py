"""Whole trajectories: what is refused and where, and what an accepted one becomes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.safety_steps import limits_at
from paramove.safety.trajectory_check import (
    MAX_POINTS,
    CheckedPath,
    TrajectoryRejectedError,
    check_in_slices,
    check_trajectory,
)
from tests.robots.hoap3.movements import HOAP3

LIMITS = HOAP3.motion_limits
JOINTS = ("right_shoulder_pitch", "right_elbow")
PLACES = HOAP3.indices(JOINTS)
START = HOAP3.base_pose[PLACES]


def check(times: list[float], offsets_deg: list[list[float]], joints: tuple[str, ...] = JOINTS) -> CheckedPath:
    """Points as offsets from the base pose, deg."""
    base = HOAP3.base_pose[HOAP3.indices([joint for joint in joints if joint in HOAP3.joint_names])]
    points = [[*(np.deg2rad(point) + base[: len(point)])] for point in offsets_deg]
    return check_trajectory(joints, times, points, HOAP3.base_pose, LIMITS, np.deg2rad(2.0))


def rise(gap_s: float, duration_s: float, degrees: float) -> tuple[list[float], list[list[float]]]:
    times = np.linspace(0, duration_s, round(duration_s / gap_s) + 1)
    u = times / duration_s
    return list(times), [[degrees * float(f), 0.0] for f in 10 * u**3 - 15 * u**4 + 6 * u**5]


@pytest.mark.parametrize("gap_s", [0.001, 0.002, 0.01, 0.05, 1.0])
def test_accepted_whatever_the_spacing_and_ends_exactly_at_the_last_point(gap_s: float) -> None:
    path = check(*rise(gap_s, 1.0, -60.0))
    assert path.rows.shape == (1001, 28)
    assert path.duration_s == 1.0
    np.testing.assert_array_equal(path.rows[0], HOAP3.base_pose)
    np.testing.assert_allclose(path.rows[-1, PLACES], START + np.deg2rad([-60, 0]), rtol=0, atol=1e-12)
    still = np.setdiff1d(np.arange(28), PLACES)
    assert (path.rows[:, still] == HOAP3.base_pose[still]).all()
    np.testing.assert_allclose(path.rows[500, PLACES[0]], START[0] - np.deg2rad(30), rtol=0, atol=1e-3)


def test_via_points_far_apart_are_joined_by_straight_lines_with_rests() -> None:
    path = check([0, 1, 2], [[0, 0], [-30, 10], [-60, 0]])
    moved = np.rad2deg(path.rows[:1001, PLACES] - START)
    np.testing.assert_allclose(moved[:, 1] * 30, -moved[:, 0] * 10, rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        path.rows[999:1002, PLACES], path.rows[1000, PLACES] * np.ones((3, 1)), rtol=0, atol=1e-7
    )


def test_a_start_within_two_degrees_is_faded_in_from_the_commanded_pose() -> None:
    path = check([0, 1], [[1.9, 0], [20, 0]])
    np.testing.assert_array_equal(path.rows[0], HOAP3.base_pose)
    np.testing.assert_allclose(path.rows[-1, PLACES[0]], START[0] + np.deg2rad(20), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("times", "offsets", "joints", "code", "index", "joint"),
    [
        ([0, 1], [[0, 0]] * 2, ("right_shoulder_pitch", "tail"), "joints", -1, "tail"),
        ([0, 1], [[0, 0]] * 2, ("right_elbow", "right_elbow"), "joints", -1, "right_elbow"),
        ([0, 1], [[], []], (), "joints", -1, ""),
        ([0], [[0, 0]], JOINTS, "times", -1, ""),
        ([], [], JOINTS, "times", -1, ""),
        ([0, 1], [[0, 0], [0]], JOINTS, "joints", 1, ""),
        ([0, 1, 1], [[0, 0]] * 3, JOINTS, "times", 2, ""),
        ([0, 2, 1], [[0, 0]] * 3, JOINTS, "times", 2, ""),
        ([0, 1], [[0, 0]] * 3, JOINTS, "times", -1, ""),
        ([0.5, 1], [[0, 0]] * 2, JOINTS, "times", 0, ""),
        ([0, 1, float("nan")], [[0, 0]] * 3, JOINTS, "not_finite", 2, ""),
        ([0, 500], [[0, 0]] * 2, JOINTS, "times", 1, ""),
        ([0, 1], [[0, 0], [0, float("nan")]], JOINTS, "not_finite", 1, "right_elbow"),
        ([0, 1], [[0, 0], [float("inf"), 0]], JOINTS, "not_finite", 1, "right_shoulder_pitch"),
        ([0, 1, 2], [[0, 0], [0, -5], [0, 0]], JOINTS, "joint_limit", 1, "right_elbow"),
        ([0, 1], [[0, 2.5], [0, 0]], JOINTS, "start", 0, "right_elbow"),
        ([0, 0.5], [[0, 0], [-60, 0]], JOINTS, "velocity", 1, "right_shoulder_pitch"),
        ([0, 0.3], [[0, 0], [-25, 0]], JOINTS, "acceleration", 1, "right_shoulder_pitch"),
        ([0, 0.06], [[0, 0], [-25, 0]], JOINTS, "jump", 1, "right_shoulder_pitch"),
        ([0, 0.05, 0.1, 0.15], [[0, 0], [0, 0], [-30, 0], [-30, 0]], JOINTS, "detour", 0, "right_shoulder_pitch"),
    ],
)
def test_refused_with_the_point_and_the_joint(
    times: list[float], offsets: list[list[float]], joints: tuple[str, ...], code: str, index: int, joint: str
) -> None:
    with pytest.raises(TrajectoryRejectedError) as rejection:
        check(times, offsets, joints)
    assert (rejection.value.code, rejection.value.joint) == (code, joint)
    assert rejection.value.index == index
    assert rejection.value.requested
    assert rejection.value.allowed


@pytest.mark.parametrize(
    ("times", "offsets", "joints", "requested", "allowed"),
    [
        ([0, 1], [[], []], (), "no joints", "at least one"),
        (
            [0, 1],
            [[0, 0]] * 2,
            ("right_shoulder_pitch", "tail"),
            "an unknown joint",
            ", ".join(HOAP3.joint_names),
        ),
        ([0, 1], [[0, 0]] * 2, ("right_elbow", "right_elbow"), "the joint twice", "once"),
        ([0], [[0, 0]], JOINTS, "1 points", "at least 2"),
        ([0, 1], [[0, 0], [0]], JOINTS, "1 angles", "2"),
        ([0, 1], [[0, 0], [0, float("nan")]], JOINTS, "nan", "finite angles"),
        ([0, 1], [[0, 0]] * 3, JOINTS, "2 times", "3, one a point"),
        ([0, 1, float("nan")], [[0, 0]] * 3, JOINTS, "time nan s", "finite times"),
        ([0.5, 1], [[0, 0]] * 2, JOINTS, "0.5 s", "0 s at the first point"),
        ([0, 2, 1], [[0, 0]] * 3, JOINTS, "1 s after 2 s", "times that increase strictly"),
        ([0, 60, 500], [[0, 0]] * 3, JOINTS, "500 s", "up to 120 s"),
    ],
)
def test_what_was_asked_and_what_is_allowed_is_said(
    times: list[float], offsets: list[list[float]], joints: tuple[str, ...], requested: str, allowed: str
) -> None:
    with pytest.raises(TrajectoryRejectedError) as rejection:
        check(times, offsets, joints)
    assert (rejection.value.requested, rejection.value.allowed) == (requested, allowed)


SMALL = limits_at(0.02)  # three joints, each from -1.5 to 1.5 rad


def check_small(
    times: np.ndarray | list[float],
    positions: np.ndarray | list[list[float]],
    tolerance: float | list[float] = 0.0,
    joints: tuple[str, ...] = ("shoulder", "elbow"),
) -> CheckedPath:
    """From rest at zero."""
    return check_trajectory(joints, times, positions, np.zeros(3), SMALL, tolerance)  # type: ignore[arg-type]


@pytest.mark.parametrize(("side", "requested"), [(1, "86.23 deg"), (-1, "-86.23 deg")])
def test_a_point_at_its_limit_passes_and_one_beyond_is_told_as_it_was_given(side: int, requested: str) -> None:
    path = check_small([0, 3], [[0, 0], [0, 1.5 * side]])
    np.testing.assert_allclose(path.rows[-1], [0, 1.5 * side, 0], rtol=0, atol=1e-12)
    with pytest.raises(TrajectoryRejectedError) as rejection:
        check_small([0, 3, 6], [[0, 0], [0, 0], [0, 1.505 * side]])
    assert (rejection.value.code, rejection.value.index, rejection.value.joint) == ("joint_limit", 2, "elbow")
    assert (rejection.value.requested, rejection.value.allowed) == (requested, "-85.94 to 85.94 deg")


def test_what_lies_exactly_at_the_tolerance_may_begin() -> None:
    assert check_small([0, 3], [[0, 0], [1, 0]]).duration_s == pytest.approx(3.0, abs=1e-9)
    assert check_small([0, 3], [[0.5, 0], [1, 0]], 0.5).rows[0].tolist() == [0, 0, 0]
    with pytest.raises(TrajectoryRejectedError) as rejection:
        check_small([0, 3], [[0.5, 0.25], [1, 1]], [0.5, 0.125, 0.0])
    assert (rejection.value.code, rejection.value.index, rejection.value.joint) == ("start", 0, "elbow")
    assert (rejection.value.requested, rejection.value.allowed) == (
        "14.32 deg",
        "within 7.16 deg of the commanded 0 deg",
    )


def test_two_minutes_pass_and_not_a_moment_more() -> None:
    assert check_small([0, 120], [[0, 0], [1, 0]]).duration_s == pytest.approx(120.0, abs=1e-9)
    with pytest.raises(TrajectoryRejectedError) as rejection:
        check_small([0, 120.001], [[0, 0], [1, 0]])
    assert (rejection.value.requested, rejection.value.allowed) == ("120.001 s", "up to 120 s")


def test_numbers_of_single_precision_become_the_same_movement_as_their_doubles() -> None:
    times = np.array([0, 0.3, 1.7, 3.2], dtype=np.float32)
    positions = np.array([[0, 0], [0.013, -0.017], [0.9, 0.771], [-0.1237, 0.6]], dtype=np.float32)
    single = check_small(times, positions)
    double = check_small(times.astype(np.float64), positions.astype(np.float64))
    np.testing.assert_array_equal(single.rows, double.rows)


def test_a_joint_that_is_held_outside_its_range_may_begin_there_and_come_in_slowly() -> None:
    held = HOAP3.base_pose.copy()
    held[PLACES[1]] = LIMITS.upper[PLACES[1]] + np.deg2rad(0.8)
    start = held[PLACES]

    def to(times: list[float], elbow_deg: float) -> CheckedPath:
        points = [list(start), [start[0], start[1] + np.deg2rad(elbow_deg)]]
        return check_trajectory(JOINTS, times, points, held, LIMITS, np.deg2rad(2.0))

    rows = to([0, 2], -10.0).rows
    np.testing.assert_array_equal(rows[0], held)
    with pytest.raises(TrajectoryRejectedError, match="velocity"):
        to([0, 0.42], -36.0)
    with pytest.raises(TrajectoryRejectedError, match="joint_limit"):
        to([0, 2], 0.1)


def test_a_trajectory_that_ends_in_motion_is_refused() -> None:
    times = [0.001 * i for i in range(201)]
    ramp = [[-0.5 * 900 * t**2, 0.0] for t in times]
    with pytest.raises(TrajectoryRejectedError, match="acceleration"):
        check(times, ramp)


def test_a_tremble_within_velocity_and_acceleration_breaks_the_jerk() -> None:
    times = 0.002 * np.arange(301)
    size = np.sin(np.pi * times / times[-1]) ** 4
    tremble = [[float(angle), 0.0] for angle in size * np.sin(100.0 * times)]
    assert check(list(times), [[0.1 * a, 0.0] for a, _ in tremble]).duration_s == times[-1]
    with pytest.raises(TrajectoryRejectedError) as rejection:
        check(list(times), [[0.14 * a, 0.0] for a, _ in tremble])
    assert (rejection.value.code, rejection.value.joint) == ("jerk", "right_shoulder_pitch")
    assert rejection.value.requested.endswith("deg/s³")


def test_a_refusal_says_code_place_joint_asked_and_allowed() -> None:
    rejection = TrajectoryRejectedError("start", 3, "right_elbow", "7 deg", "2 deg")
    assert str(rejection).endswith("(start) at point 3, joint right_elbow: requested 7 deg, allowed 2 deg")
    assert (rejection.code, rejection.index, rejection.joint) == ("start", 3, "right_elbow")
    assert (rejection.requested, rejection.allowed) == ("7 deg", "2 deg")
    assert str(TrajectoryRejectedError("id", -1, "", "none", "one")).endswith("(id): requested none, allowed one")
    assert " at point 0" in str(TrajectoryRejectedError("start", 0, "", "", ""))


@pytest.mark.parametrize(("offsets", "index"), [([-60, 0, 0, 0], 1), ([0, 0, -60, 0], 3), ([0, 0, 0, -60], 4)])
def test_the_point_is_that_to_which_the_movement_is_too_fast(offsets: list[float], index: int) -> None:
    points = [[0.0, 0.0]] + [[float(sum(offsets[: k + 1])), 0.0] for k in range(4)]
    with pytest.raises(TrajectoryRejectedError) as rejection:
        check([0.0, 0.5, 1.0, 1.5, 2.0], points)
    assert (rejection.value.code, rejection.value.index) == ("velocity", index)


@pytest.mark.parametrize(("duration_s", "faded_s"), [(1.0, 0.5), (0.3, 0.3)])
def test_the_difference_at_the_start_is_faded_out_within_half_a_second(duration_s: float, faded_s: float) -> None:
    path = check([0, duration_s], [[1.0, 0], [1.0, 0]])
    left = (START[0] + np.deg2rad(1.0) - path.rows[:, PLACES[0]]) / np.deg2rad(1.0)
    end = round(faded_s * 1000)
    u = np.arange(end + 1) / end
    np.testing.assert_allclose(left[: end + 1], 1 - (10 * u**3 - 15 * u**4 + 6 * u**5), rtol=0, atol=1e-9)
    np.testing.assert_allclose(left[end:], 0.0, rtol=0, atol=1e-12)


@settings(deadline=None, max_examples=60, derandomize=True)
@given(
    gaps=st.lists(st.floats(min_value=0.002, max_value=0.4), min_size=1, max_size=12),
    moves=st.lists(st.floats(min_value=-25, max_value=25), min_size=12, max_size=12),
)
def test_whatever_passes_keeps_every_limit(gaps: list[float], moves: list[float]) -> None:
    times = [0.0, *np.cumsum(gaps)]
    offsets = [[0.0, 0.0], *([move, 0.0] for move in moves[: len(gaps)])]
    try:
        rows = check(times, offsets).rows
    except TrajectoryRejectedError:
        return
    rows = np.concatenate([rows[:1]] * 4 + [rows] + [rows[-1:]] * 4)
    assert (rows >= LIMITS.lower).all()
    assert (rows <= LIMITS.upper).all()
    assert (np.abs(np.diff(rows, axis=0)) <= LIMITS.velocity * 1e-3 * 1.01).all()
    assert (np.abs(rows[8:] - 2 * rows[4:-4] + rows[:-8]) <= LIMITS.acceleration * 16e-6 * 1.01).all()


def test_a_long_movement_is_checked_in_many_slices() -> None:
    times, offsets = rise(0.005, 100.0, -60.0)
    points = START + np.deg2rad(offsets)
    checking = check_in_slices(JOINTS, times, points.tolist(), HOAP3.base_pose, LIMITS, 0.1)
    slices = 0
    while True:
        try:
            next(checking)
        except StopIteration as end:
            path = end.value
            break
        slices += 1
    assert 300 < slices < 400  # 100 001 rows, 1000 at once, in three passes
    whole = check_trajectory(JOINTS, times, points.tolist(), HOAP3.base_pose, LIMITS, 0.1)
    np.testing.assert_array_equal(path.rows, whole.rows)


@pytest.mark.parametrize("jump_first", [False, True])
def test_of_several_violations_the_first_rule_is_named_wherever_it_is_broken(jump_first: bool) -> None:
    """A jump comes before a velocity in the gate's order, in whichever slice of the rows each is."""
    times = np.arange(0.0, 6.0, 0.001)
    offsets = np.zeros((len(times), 2))
    jump, fast = (1000, 4500) if jump_first else (4500, 1000)
    offsets[jump:, 0] -= np.deg2rad(40.0)
    speed = 1.2 * LIMITS.velocity[PLACES[1]]
    offsets[:, 1] += np.clip((times - times[fast]) * speed, 0.0, 0.1)
    with pytest.raises(TrajectoryRejectedError) as raised:
        check_trajectory(JOINTS, times, (START + offsets).tolist(), HOAP3.base_pose, LIMITS, 0.1)
    assert (raised.value.code, raised.value.joint) == ("jump", JOINTS[0])
    assert abs(raised.value.index - jump) <= 1


def test_more_points_than_a_movement_can_need_are_rejected_by_their_number() -> None:
    def rejection_of(n_points: int) -> TrajectoryRejectedError:
        with pytest.raises(TrajectoryRejectedError) as raised:
            check_trajectory(JOINTS, range(n_points), [[np.nan, 0.0]] * n_points, START, LIMITS, 0.1)
        return raised.value

    assert rejection_of(MAX_POINTS).code == "not_finite"
    rejection = rejection_of(MAX_POINTS + 1)
    assert (rejection.code, rejection.index, rejection.joint) == ("points", -1, "")
    assert rejection.requested == f"{MAX_POINTS + 1} points"
    assert rejection.allowed.startswith(f"up to {MAX_POINTS};")


def test_a_late_point_with_too_few_angles_is_named() -> None:
    times, offsets = rise(0.001, 2.0, -60.0)
    offsets[1500] = [0.0]
    with pytest.raises(TrajectoryRejectedError) as raised:
        check(times, offsets)
    assert (raised.value.code, raised.value.index) == ("joints", 1500)


def test_of_several_detours_the_largest_is_named_wherever_it_is() -> None:
    """Two dense runs with a rest between them; in each a point is aside, in the first one further."""
    times = [0.04 * i for i in range(11)] + [1.4 + 0.04 * i for i in range(11)]
    for first, second, at in ((30.0, 20.0, 5), (20.0, 30.0, 16)):
        offsets = [[0.0, 0.0] for _ in times]
        offsets[5] = [0.0, first]
        offsets[16] = [0.0, second]
        with pytest.raises(TrajectoryRejectedError) as raised:
            check(times, offsets)
        assert (raised.value.code, raised.value.joint) == ("detour", JOINTS[1])
        assert abs(raised.value.index - at) <= 1
