"""The relocation action: phases, exactness where it matters, and motions that the robot's gate accepts."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from paramove.motion.arm_pose import UnreachablePoseError
from paramove.motion.plans import PlannedMotion
from paramove.safety.trajectory_check import check_trajectory
from sim.places import STRIP_X, STRIP_Y
from tests.motion.reaching import ARM, CORNERS, GRASP_Z, HOAP3, JOINTS, OPENINGS, at, movement, planner, solver

LIMITS = HOAP3.motion_limits
BASE = HOAP3.base_pose[JOINTS]
STRIP = [(x, y) for x in STRIP_X for y in (STRIP_Y[0], np.mean(STRIP_Y), STRIP_Y[1])]
OFFERED = at((0.155, -0.02), -0.05)
NAMES = (*ARM.joints, ARM.fingers)


def commanded(motion: PlannedMotion) -> np.ndarray:
    """Where the commanded joint angles bring the gripper, [K, 3], m."""
    return ARM.kinematics.forward(motion.angles[:, :5]).gripper


def end_of(motion: PlannedMotion, phase: str) -> int:
    """Last sample of a phase."""
    starts = [start for name, start in motion.phases if name == phase]
    later = [start for name, start in motion.phases if start > starts[-1]]
    return len(motion.times) - 1 if not later else int(np.searchsorted(motion.times, later[0] - 1e-6, side="right")) - 1


def opening(motion: PlannedMotion) -> np.ndarray:
    return (motion.angles[:, 5] - ARM.fingers_closed) / (ARM.fingers_open - ARM.fingers_closed)


def accept(motion: PlannedMotion, start: np.ndarray) -> None:
    """The gate's own check, from the pose in which the robot waits, and the operating limits."""
    pose = HOAP3.base_pose.copy()
    pose[JOINTS] = start
    checked = check_trajectory(
        NAMES, motion.times, motion.angles.tolist(), pose, LIMITS, np.deg2rad(HOAP3.stream.start_tolerance_deg)
    )
    np.testing.assert_allclose(checked.rows[-1, JOINTS], motion.angles[-1], rtol=0, atol=1e-12)
    speed = np.diff(motion.angles, axis=0) / 0.005
    assert (np.abs(speed) <= HOAP3.operating_velocity[JOINTS]).all()
    assert (np.abs(np.diff(speed, axis=0)) / 0.005 <= HOAP3.operating_acceleration[JOINTS]).all()
    np.testing.assert_allclose(commanded(motion), motion.gripper, rtol=0, atol=1e-6)
    assert (np.diff(motion.times) > 0).all()
    assert motion.phases[0][1] == 0.0
    assert all(one[1] < two[1] for one, two in itertools.pairwise(motion.phases))


def names(motion: PlannedMotion) -> list[str]:
    return [name for name, _ in motion.phases]


@pytest.mark.parametrize("from_above", [False, True])
@pytest.mark.parametrize("place", [*STRIP, *CORNERS])
def test_fetch(place: tuple[float, float], from_above: bool) -> None:
    target = at(place)
    motion = planner().fetch(target, from_above=from_above)
    assert names(motion) == ["approach", "lower", "reach", "grasp", "lift"]
    accept(motion, BASE)
    assert np.abs(motion.angles[0] - BASE).max() < np.deg2rad(2.0)
    options, points = planner().options, commanded(motion)
    grasp = end_of(motion, "grasp")
    assert abs(points[grasp, 2] - GRASP_Z) < 0.0005
    assert abs(np.linalg.norm(points[grasp] - target) - options.grasp_aside) < 0.0005
    assert points[grasp, 1] < target[1]  # beside it to the right, on the side of the fingers
    np.testing.assert_allclose(points[end_of(motion, "lift")], points[grasp] + [0, 0, options.lift], rtol=0, atol=5e-4)
    before = points[end_of(motion, "lower")] - target
    assert np.linalg.norm(before) < options.before + 0.011
    assert from_above == bool(np.linalg.norm(before) < 0.011)
    assert opening(motion)[end_of(motion, "reach")] > 0.7
    assert opening(motion)[grasp] < 0.05
    assert not motion.holding[: end_of(motion, "reach")].any()
    assert motion.holding[grasp + 2 :].all()


@pytest.mark.parametrize("upward", [False, True])
@pytest.mark.parametrize("place", [*OPENINGS, *CORNERS])
def test_deliver(place: tuple[float, float], upward: bool) -> None:
    fetch = planner().fetch(at((0.177, -0.02)))
    target = at(place)
    motion = planner().deliver(fetch.gripper[-1], target, upward=upward)
    assert names(motion) == ["carry", "place", "release", "withdraw", "retreat"]
    accept(motion, fetch.angles[-1])
    np.testing.assert_allclose(motion.angles[-1], BASE, rtol=0, atol=np.deg2rad(2.0))
    options, points = planner().options, commanded(motion)
    placed = end_of(motion, "place")
    np.testing.assert_allclose(points[placed], np.add(target, [0, 0, options.release_height]), rtol=0, atol=5e-4)
    released = end_of(motion, "release")
    np.testing.assert_allclose(points[released], points[placed], rtol=0, atol=5e-4)
    assert opening(motion)[placed] < 0.05
    assert opening(motion)[released] > 0.7
    assert motion.holding[: placed - 2].all()
    assert not motion.holding[released:].any()
    carried = points[: end_of(motion, "carry") + 1, 2]
    assert carried.min() > GRASP_Z + options.lift - 0.0005


def test_the_carried_object_goes_over_the_points_between() -> None:
    fetch = planner().fetch(at((0.177, -0.02)))
    over = np.array([0.15, -0.06, -0.04])
    motion = planner().deliver(fetch.gripper[-1], at(OPENINGS[0]), [over])
    accept(motion, fetch.angles[-1])
    assert np.linalg.norm(commanded(motion) - over, axis=1).min() < 0.0005


def test_what_is_held_keeps_its_tilt() -> None:
    """The forearm's slope is the same wherever an object is grasped, carried and put."""
    tilts = []
    for place, opening_place in itertools.product(STRIP[::2], OPENINGS):
        fetch = planner().fetch(at(place))
        for motion in (fetch, planner().deliver(fetch.gripper[-1], at(opening_place))):
            forearm = ARM.kinematics.forward(motion.angles[motion.holding, :5])
            tilts.append(np.rad2deg(np.arcsin(forearm.shoulder_from_hand[:, 2, 0])))
    tilt = np.concatenate(tilts)
    assert tilt.max() - tilt.min() < 12.0
    np.testing.assert_allclose(np.median(tilt), -np.rad2deg(planner().options.work_slope), rtol=0, atol=3.0)


def test_leave_opens_the_hand_and_goes_home() -> None:
    fetch = planner().fetch(at((0.177, -0.02)))
    motion = planner().leave(fetch.gripper[-1], 0.02)
    assert names(motion) == ["release", "withdraw", "retreat"]
    accept(motion, fetch.angles[-1])
    np.testing.assert_allclose(motion.angles[-1], BASE, rtol=0, atol=np.deg2rad(2.0))
    assert opening(motion)[end_of(motion, "release")] > 0.7


def test_offer_wait_take_and_put() -> None:
    offer = planner().offer(OFFERED)
    accept(offer, BASE)
    assert names(offer) == ["approach"]
    np.testing.assert_allclose(commanded(offer)[-1], OFFERED, rtol=0, atol=5e-4)
    closing = planner().fingers(offer.gripper[-1], float(opening(offer)[-1]), 0.02)
    accept(closing, offer.angles[-1])
    assert names(closing) == ["fingers"]
    np.testing.assert_allclose(
        closing.angles[:, :5], np.tile(offer.angles[-1, :5], (len(closing.times), 1)), atol=1e-6, rtol=0
    )
    np.testing.assert_allclose(opening(closing)[-1], 0.02, rtol=0, atol=1e-9)
    motion = planner().deliver(closing.gripper[-1], at(CORNERS[0]))
    accept(motion, closing.angles[-1])


def test_a_movement_is_made_of_the_learned_one() -> None:
    """Between the base pose and the object the gripper follows the synthesised states."""
    target = at((0.177, -0.02), GRASP_Z + 0.05)
    motion = planner().offer(target)
    learned = movement().poses(movement().parameter_for(movement().reach_state, target)[0])
    late = learned.gripper[round(0.6 * movement().reach_state) : movement().reach_state + 1]
    late = late[np.linalg.norm(late, axis=1) > solver().reach[0] + 0.026]
    assert len(late) >= 5
    away = np.linalg.norm(commanded(motion)[:, None] - late[None], axis=2).min(axis=0)
    assert away.max() < 0.001


@pytest.mark.parametrize("place", [(0.30, 0.0), (0.10, 0.20)])
def test_a_place_out_of_reach_is_refused(place: tuple[float, float]) -> None:
    with pytest.raises(UnreachablePoseError, match="gripper at"):
        planner().fetch(at(place))
