"""Inverse kinematics of the arm: exact at the gripper, nearest at the elbow, inside the limits, or refused."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from paramove.motion.arm_pose import ArmPoseSolver, UnreachablePoseError
from paramove.motion.reaching_movement import ArmPoses
from tests.motion.reaching import ARM, HOAP3, solver

LOWER, UPPER = HOAP3.soft_lower[ARM.indices], HOAP3.soft_upper[ARM.indices]
EASY = settings(deadline=None, max_examples=25, derandomize=True)
# The solver keeps this much inside the limits, as paths are curves through its poses.
MARGIN = np.deg2rad(0.3)

Pose = tuple[np.ndarray, np.ndarray, np.ndarray]
seeds = st.integers(min_value=0, max_value=2**32 - 1)


def random_angles(seed: int) -> np.ndarray:
    """Inside the limits and away from the poses in which two of the shoulder's axes are parallel, [5], rad."""
    lower, upper = LOWER.copy(), UPPER.copy()
    lower[1], upper[3] = np.deg2rad([-85.0, -5.0])
    margin = np.deg2rad(2.0)
    return np.random.default_rng(seed).uniform(lower + margin, upper - margin)


def arm_poses(elbow: ArrayLike, gripper: ArrayLike, fingers: ArrayLike) -> ArmPoses:
    """Of K poses, or of one."""
    return ArmPoses(*(np.atleast_2d(np.asarray(part, dtype=np.float64)) for part in (elbow, gripper, fingers)))


def random_pose(seed: int) -> Pose:
    """A gripper and fingers that the arm can have, and a person's elbow that is anywhere about the line to them."""
    points = ARM.kinematics.forward(random_angles(seed))
    draw = np.random.default_rng([seed, 1])
    elbow = turned(points.elbow, points.gripper, draw.normal(0.0, 1.2, 1))[0]
    return elbow * draw.uniform(0.8, 1.2), points.gripper, points.shoulder_from_hand[:, 1]


def turned(point: np.ndarray, axis: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """The point turned about an axis through the shoulder by each of the angles [K], [K, 3] (Rodrigues)."""
    unit = axis / np.linalg.norm(axis)
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return cosine * point + sine * np.cross(unit, point) + (1 - cosine) * (unit @ point) * unit


@cache
def unlimited() -> ArmPoseSolver:
    """A solver for an arm whose joints turn as far as they like: it never has to turn the elbow."""
    lower, upper = np.full_like(HOAP3.soft_lower, -10.0), np.full_like(HOAP3.soft_upper, 10.0)
    lower[ARM.indices[3]] = -3.1
    return ArmPoseSolver(replace(HOAP3, soft_lower=lower, soft_upper=upper), ARM)


def keeps_limits(pose: Pose, turns: np.ndarray) -> np.ndarray:
    """Whether the arm breaks no limit if the elbow is turned by each of the angles, [K]."""
    elbow, gripper, fingers = pose
    many = (np.tile(gripper, (len(turns), 1)), np.tile(fingers, (len(turns), 1)))
    angles = unlimited().solve(arm_poses(turned(elbow, gripper, turns), *many)).angles
    return np.asarray(((angles >= LOWER + MARGIN) & (angles <= UPPER - MARGIN)).all(axis=1))


@EASY
@given(seeds)
def test_is_the_inverse_of_forward_kinematics(seed: int) -> None:
    angles = random_angles(seed)
    points = ARM.kinematics.forward(angles)
    assume(np.linalg.norm(points.gripper) > solver().reach[0])
    found = solver().solve(arm_poses(points.elbow, points.gripper, points.shoulder_from_hand[:, 1]))
    np.testing.assert_allclose(found.angles[0], angles, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.elbow[0], points.elbow, rtol=0, atol=1e-9)
    assert found.elbow_turn[0] == 0.0


@EASY
@given(seeds)
def test_gripper_is_exact_and_every_joint_keeps_its_limits(seed: int) -> None:
    """The gripper site lies 6 mm beside the forearm's axis; nothing of that is lost."""
    elbow, gripper, fingers = random_pose(seed)
    found = solver().solve(arm_poses(elbow, gripper, fingers))
    points = ARM.kinematics.forward(found.angles[0])
    np.testing.assert_allclose(points.gripper, gripper, rtol=0, atol=1e-9)
    np.testing.assert_allclose(points.elbow, found.elbow[0], rtol=0, atol=1e-9)
    assert (found.angles[0] >= LOWER).all()
    assert (found.angles[0] <= UPPER).all()


@EASY
@given(seeds)
def test_without_a_broken_limit_the_elbow_is_that_of_the_thesis(seed: int) -> None:
    """q' lies in the plane of shoulder, person's elbow and gripper, on the elbow's side (5.10): no other is nearer."""
    elbow, gripper, fingers = random_pose(seed)
    found = solver().solve(arm_poses(elbow, gripper, fingers))
    assume(found.elbow_turn[0] == 0.0)
    normal = np.cross(elbow, gripper)
    assume(np.linalg.norm(normal) > 1e-4)
    robot_elbow = found.elbow[0]
    assert abs(robot_elbow @ normal) / np.linalg.norm(normal) < 1e-12
    around = turned(robot_elbow, gripper, np.deg2rad(np.arange(1.0, 360.0)))
    assert np.linalg.norm(robot_elbow - elbow) <= np.linalg.norm(around - elbow, axis=1).min()


@EASY
@given(seeds)
def test_where_a_limit_is_broken_the_smallest_turn_is_used(seed: int) -> None:
    pose = random_pose(seed)
    turn = abs(float(solver().solve(arm_poses(*pose)).elbow_turn[0]))
    step = np.deg2rad(0.1)
    grid = np.arange(-np.pi, np.pi, step)
    smallest = np.abs(grid[keeps_limits(pose, grid)]).min()
    assert smallest - step <= turn <= smallest + np.deg2rad(0.01)


def refusal_of(pose: Pose) -> str:
    try:
        solver().solve(arm_poses(*pose))
    except UnreachablePoseError as error:
        return str(error)
    return ""


def test_refuses_only_what_no_turn_makes_possible() -> None:
    grid = np.deg2rad(np.arange(-180.0, 180.0, 0.5))
    draw = np.random.default_rng(3)
    rejected = 0
    for _ in range(40):
        gripper = draw.uniform([0.06, -0.15, -0.18], [0.22, 0.18, 0.10])
        pose = (draw.uniform([-0.03, -0.10, -0.12], [0.10, 0.02, 0.02]), gripper, draw.normal(size=3))
        reason = refusal_of(pose)
        if "limit" in reason:
            assert not keeps_limits(pose, grid).any()
        rejected += bool(reason)
    assert 5 < rejected < 35


def test_a_sequence_is_turned_to_one_side() -> None:
    """Poses of a sequence whose nearest turns lie on both sides are not given an elbow that jumps."""
    steps = np.linspace(0.0, 1.0, 60)
    gripper = np.array([0.16, -0.06, -0.07]) + steps[:, None] * np.array([0.0, 0.12, 0.0])
    elbow = np.column_stack([0.02 + 0.0 * steps, 0.10 - 0.02 * steps, -0.02 + 0.0 * steps])
    found = solver().solve(arm_poses(elbow, gripper, np.tile([0.0, 1.0, 0.0], (60, 1))))
    assert found.elbow_turn.any(), "the case shall need turns"
    assert np.abs(np.diff(found.elbow_turn)).max() < np.deg2rad(20)
    points = ARM.kinematics.forward(found.angles)
    np.testing.assert_allclose(points.gripper, gripper, rtol=0, atol=1e-9)


def test_a_smoothed_turn_keeps_gripper_limits_and_ends() -> None:
    steps = np.linspace(0.0, 1.0, 200)
    gripper = np.array([0.17, -0.10, -0.06]) + steps[:, None] * np.array([0.0, 0.17, -0.03])
    elbow = np.column_stack([0.0 * steps + 0.03, -0.05 + 0.08 * np.sin(np.pi * steps) ** 2, 0.0 * steps - 0.10])
    fingers = np.tile([0.0, 1.0, 0.0], (200, 1))
    sharp = solver().solve(arm_poses(elbow, gripper, fingers), 1.0)
    smooth = solver().solve(arm_poses(elbow, gripper, fingers), 1.0, smoothing=15)
    assert sharp.elbow_turn.any()
    assert not sharp.elbow_turn.all()
    assert np.abs(np.diff(smooth.elbow_turn, 2)).max() < np.abs(np.diff(sharp.elbow_turn, 2)).max()
    assert (smooth.angles >= LOWER).all()
    assert (smooth.angles <= UPPER).all()
    np.testing.assert_allclose(ARM.kinematics.forward(smooth.angles).gripper, gripper, rtol=0, atol=1e-9)
    np.testing.assert_allclose(smooth.angles[[0, -1]], sharp.angles[[0, -1]], rtol=0, atol=1e-12)


@pytest.mark.parametrize("slope_deg", [5.0, 14.0, 25.0])
def test_the_forearm_slopes_as_asked_and_the_hand_is_level(slope_deg: float) -> None:
    places = np.array([[0.14, -0.09, -0.09], [0.15, -0.03, -0.09], [0.18, -0.06, -0.08], [0.17, -0.08, -0.05]])
    elbow = np.tile([0.03, -0.05, -0.09], (len(places), 1))
    fingers = np.tile([0.3, 0.8, -0.4], (len(places), 1))
    found = solver().solve(arm_poses(elbow, places, fingers), level=1.0, slope=np.deg2rad(slope_deg))
    free = found.elbow_turn == 0.0
    assert free.sum() >= 2, "some of the places shall need no further turn"
    points = ARM.kinematics.forward(found.angles)
    down = (points.elbow - points.gripper)[:, 2] / np.linalg.norm(points.elbow - points.gripper, axis=1)
    np.testing.assert_allclose(np.rad2deg(np.arcsin(down[free])), slope_deg, rtol=0, atol=1e-6)
    sideward = points.shoulder_from_hand[:, :, 1]
    assert (np.abs(np.rad2deg(np.arcsin(sideward[:, 2]))) < 3.0).all()  # the offset of the gripper tilts it a little
    assert (sideward[:, 1] > 0).all()  # thumb on the left


def test_the_share_of_the_level_goes_from_the_persons_hand_to_the_level_one() -> None:
    gripper = np.tile([0.16, -0.06, -0.07], (3, 1))
    elbow, fingers = np.tile([0.03, -0.05, -0.09], (3, 1)), np.tile([0.2, 0.8, -0.5], (3, 1))
    found = solver().solve(arm_poses(elbow, gripper, fingers), level=[0.0, 0.5, 1.0], slope=0.25)
    tilt = np.abs(ARM.kinematics.forward(found.angles).shoulder_from_hand[:, 2, 1])
    assert tilt[0] > tilt[1] > tilt[2]
    person = solver().solve(arm_poses(elbow[0], gripper[0], fingers[0]))
    np.testing.assert_allclose(found.angles[0], person.angles[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("fingers", [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
@pytest.mark.parametrize("elbow", [(0.0, 0.0, 0.0), (0.08, -0.03, -0.035)])
def test_a_person_whose_arm_gives_no_plane_still_gives_an_exact_gripper(
    elbow: tuple[float, ...], fingers: tuple[float, ...]
) -> None:
    """Elbow on the line to the gripper, or no direction of the fingers: the elbow hangs and the hand is level."""
    gripper = np.array([0.16, -0.06, -0.07])
    found = solver().solve(arm_poses(elbow, gripper, fingers))
    np.testing.assert_allclose(ARM.kinematics.forward(found.angles[0]).gripper, gripper, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("gripper", "words"),
    [
        ((0.25, -0.05, -0.05), r"pose 1: gripper at .* is 26\.0 cm from the shoulder; the arm reaches 13\.\d to 24\.3"),
        ((0.08, -0.02, -0.05), r"pose 1: gripper at .* is 9\.6 cm from the shoulder"),
        (
            (-0.05, 0.17, -0.05),
            r"pose 1: gripper at .* breaks the limit of right_\w+ \(-?[\d.]+ deg, allowed -[\d.]+ to [\d.]+\)",
        ),
        ((np.nan, 0.0, 0.0), r"pose 1: gripper at .* is nan cm"),
    ],
)
def test_what_cannot_be_reached_is_refused_with_the_reason(gripper: tuple[float, ...], words: str) -> None:
    elbow, fingers = np.tile([0.02, -0.03, -0.10], (2, 1)), np.tile([0.0, 1.0, 0.0], (2, 1))
    with pytest.raises(UnreachablePoseError, match=words):
        solver().solve(arm_poses(elbow, [(0.16, -0.06, -0.07), gripper], fingers))


def test_reach_is_that_of_the_arm_with_its_elbow_at_the_limits() -> None:
    minimum, maximum = solver().reach
    q = np.tile(np.deg2rad([90.0, -30.0, 0.0, 0.0, 0.0]), (2, 1))
    q[:, 3] = [LOWER[3], 0.0]
    distance = np.linalg.norm(ARM.kinematics.forward(q).gripper, axis=1)
    np.testing.assert_allclose([minimum, maximum], distance, rtol=0, atol=2e-3)  # 0.3 deg of margin, offset aside
    np.testing.assert_allclose(solver().length, 0.243, rtol=0, atol=1e-12)


def test_a_gripper_outside_the_plane_of_the_hand_needs_another_solver() -> None:
    kinematics = replace(ARM.kinematics, gripper_from_elbow=(0.133, 0.006, 0.002))
    with pytest.raises(ValueError, match=r"0\.002 m above the hand's plane"):
        ArmPoseSolver(HOAP3, replace(ARM, kinematics=kinematics))


@EASY
@given(seeds)
def test_the_closed_form_says_by_how_much_it_breaks_limits(seed: int) -> None:
    """It is what `solve` gives where no limit is broken, and outside the limits exactly where `solve` turns."""
    elbow, gripper, fingers = random_pose(seed)
    plain = solver().without_limits(arm_poses(elbow, gripper, fingers))
    outside = solver().outside_limits(plain.angles)[0]
    np.testing.assert_allclose(ARM.kinematics.forward(plain.angles[0]).gripper, gripper, rtol=0, atol=1e-9)
    try:
        kept = solver().solve(arm_poses(elbow, gripper, fingers))
    except UnreachablePoseError:
        assert outside.max() > 0.0
        return
    assert (outside.max() > 0.0) == (kept.elbow_turn[0] != 0.0)
    np.testing.assert_array_equal(solver().outside_limits(kept.angles), np.zeros((1, 5)))


def test_points_too_near_are_moved_straight_outward_and_others_stay() -> None:
    minimum, margin, width = solver().reach[0], 0.002, 0.012
    line = np.array([0.6, -0.48, -0.64])
    distances = np.linspace(0.08, 0.24, 60)
    moved = solver().moved_outward(distances[:, None] * line, margin, width)
    found = np.linalg.norm(moved, axis=1)
    np.testing.assert_allclose(moved, found[:, None] * line, rtol=0, atol=1e-12)
    assert found.min() >= minimum + margin - 1e-12
    assert (np.diff(found) >= -1e-12).all()
    far = distances >= minimum + margin + width
    np.testing.assert_allclose(found[far], distances[far], rtol=0, atol=1e-12)


def test_what_overshoots_a_limit_is_pressed_into_the_margin_and_the_rest_is_left() -> None:
    middle, half = 0.5 * (LOWER + UPPER), 0.5 * (UPPER - LOWER)
    along = np.linspace(-1.0, 1.0, 2001)[:, None]
    over = np.deg2rad([0.0, 0.3, 0.0, -0.1, 1.0])  # beyond the limits of the safety gate
    curve = middle + along * (half + over - np.deg2rad([5.0, 0.0, 5.0, 0.0, 0.0]))
    pressed = solver().pressed_inside(curve)
    assert (pressed > LOWER).all()
    assert (pressed < UPPER).all()
    np.testing.assert_array_equal(pressed[:, [0, 2]], curve[:, [0, 2]])
    near = np.abs(curve - middle) < half - np.deg2rad(0.7)
    np.testing.assert_array_equal(pressed[near], curve[near])
    assert (np.diff(pressed, axis=0) > 0).all()
