"""Distances of planned paths from what stands around, compared with geometry that is known otherwise."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from paramove.motion.clearance import ClearanceChecker, UprightCylinder, WorkSurface
from tests.motion.reaching import ARM, HOAP3, JOINTS, SURFACE, at, checker, planner, solver

MIDDLE_Z = SURFACE.z + SURFACE.object_height / 2


def over_the_surface(height: float) -> np.ndarray:
    """Arm joints and half-open fingers with a level hand, the gripper `height` above the working plane, [1, 6]."""
    gripper = np.array([[0.165, -0.05, SURFACE.z + height]])
    found = solver().solve([[0.03, -0.05, -0.09]], gripper, [[0.0, 1.0, 0.0]], level=1.0, slope=0.25)
    return np.column_stack([found.angles, [0.0]])


def lowest_point_of_the_hand(angles: np.ndarray) -> float:
    """Height of the lowest point of hand and thumb, m, shoulder frame, from the boxes and cylinders of the model."""
    model = mujoco.MjModel.from_xml_path(str(HOAP3.model_path))
    data = mujoco.MjData(model)
    for name, value in zip(HOAP3.joint_names, HOAP3.base_pose, strict=True):
        data.qpos[model.joint(name).qposadr[0]] = value
    for place, value in zip(JOINTS, angles[0], strict=True):
        data.qpos[model.joint(HOAP3.joint_names[place]).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    lowest = []
    for geom in range(model.ngeom):
        if not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            continue
        if model.body(model.geom_bodyid[geom]).name not in ("right_hand", "right_thumb"):
            continue
        down, size = np.abs(data.geom_xmat[geom].reshape(3, 3)[2]), model.geom_size[geom]
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
            extent = down @ size
        else:
            assert model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER
            extent = down[2] * size[1] + np.sqrt(1 - down[2] ** 2) * size[0]
        lowest.append(data.geom_xpos[geom, 2] - extent)
    return float(min(lowest) - data.site_xpos[model.site(ARM.sites.shoulder).id, 2])


@pytest.mark.parametrize("height", [0.030, 0.040, 0.060])
def test_distance_from_the_table_is_that_of_the_lowest_point(height: float) -> None:
    angles = over_the_surface(height)
    found = checker().smallest(angles, [], [False])
    np.testing.assert_allclose(found.distance, lowest_point_of_the_hand(angles) - SURFACE.z, rtol=0, atol=1e-4)
    assert found.pair[1] == "surface"
    assert found.pair[0].startswith("right_")


def test_a_hand_in_the_table_has_a_negative_distance() -> None:
    angles = over_the_surface(0.010)
    found = checker().smallest(angles, [], [False])
    np.testing.assert_allclose(found.distance, lowest_point_of_the_hand(angles) - SURFACE.z, rtol=0, atol=2e-3)
    assert found.distance < -0.004


def test_far_away_nothing_is_told_apart() -> None:
    base = HOAP3.base_pose[JOINTS][None]
    found = checker().smallest(base, [], [False])
    assert 0.005 < found.distance <= 0.05


@pytest.mark.parametrize("gap", [0.004, 0.010, 0.018])
def test_a_held_cylinder_keeps_its_distance_from_a_standing_one(gap: float) -> None:
    """Two upright cylinders: the distance is that of their axes less twice the radius."""
    angles = over_the_surface(0.09)
    level = ARM.kinematics.forward(angles[0, :5]).shoulder_from_hand
    held = ARM.kinematics.forward(angles[0, :5]).gripper + level @ [0.0, 0.0, -0.011]
    # A standing object right below the held one; its upper face is as far below the held one's lowest edge as `gap`.
    tilt = np.arccos(level[2, 2])
    lowest = held[2] - 0.025 * np.cos(tilt) - 0.010 * np.sin(tilt)
    below = np.array([[held[0] - 0.025 * level[0, 2], held[1] - 0.025 * level[1, 2], lowest - gap - 0.025]])
    holding = checker().smallest(angles, below, [True])
    np.testing.assert_allclose(holding.distance, gap, rtol=0, atol=5e-4)
    assert set(holding.pair) == {"held", "standing_0"}
    empty = checker().smallest(angles, below, [False])
    assert empty.distance > holding.distance


def test_the_nearest_of_several_objects_and_the_sample_are_named() -> None:
    path = np.concatenate([over_the_surface(h) for h in np.linspace(0.12, 0.06, 9)])
    place = ARM.kinematics.forward(path[-1, :5]).gripper
    standing = [[0.20, 0.10, MIDDLE_Z], [place[0], place[1], MIDDLE_Z], [0.12, -0.15, MIDDLE_Z]]
    found = checker().smallest(path, standing, np.zeros(9, bool))
    assert found.pair[1] == "standing_1"
    assert found.sample == 8
    coarse = checker().smallest(path, standing, np.zeros(9, bool), every=3)
    assert coarse.sample == 6
    assert coarse.distance > found.distance


def test_an_object_that_has_been_taken_away_is_forgotten() -> None:
    angles = over_the_surface(0.09)
    free = checker().smallest(angles, [], [False]).distance
    place = ARM.kinematics.forward(angles[0, :5]).gripper
    assert checker().smallest(angles, [[*place[:2], MIDDLE_Z]], [False]).distance < free
    assert checker().smallest(angles, [], [False]).distance == free


def test_a_hand_at_the_body_is_seen() -> None:
    """Poses all over the range, the table out of the way: some put the hand into the body, and it is named."""
    table_away = ClearanceChecker(HOAP3, "right", WorkSurface(SURFACE.x, SURFACE.y, -1.0), UprightCylinder())
    draw = np.random.default_rng(0)
    limits = HOAP3.soft_lower[JOINTS], HOAP3.soft_upper[JOINTS]
    poses = draw.uniform(*limits, (400, 6))
    found = table_away.smallest(poses, [], np.zeros(400, bool), every=1)
    assert found.distance < -0.01
    assert found.pair[0].startswith("right_")
    assert not found.pair[1].startswith(("right_upper", "right_elbow", "right_fore", "surface"))
    away = np.linalg.norm(ARM.kinematics.forward(poses[found.sample, :5]).gripper - [-0.02, 0.08, -0.05])
    assert away < 0.2, "the gripper is near the torso"


def test_a_lower_table_is_further_away() -> None:
    lower = WorkSurface(SURFACE.x, SURFACE.y, SURFACE.z - 0.007)
    other = ClearanceChecker(HOAP3, "right", lower, UprightCylinder())
    angles = over_the_surface(0.035)
    gained = other.smallest(angles, [], [False]).distance - checker().smallest(angles, [], [False]).distance
    np.testing.assert_allclose(gained, 0.007, rtol=0, atol=1e-5)


def test_more_objects_than_it_was_made_for_are_refused() -> None:
    with pytest.raises(ValueError, match="4 standing objects; this checker was made for 3"):
        checker().smallest(over_the_surface(0.09), np.zeros((4, 3)), [False])


def test_a_fetch_closes_the_hand_around_its_object_without_being_pushed_away_from_the_others() -> None:
    """With the fetched object among those to keep clear of, no path to it would be clear."""
    motion = planner().fetch(at((0.177, -0.02)))
    own = [[0.177, -0.02, MIDDLE_Z]]
    assert checker().smallest(motion.angles, own, motion.holding, every=6).distance < 0.0
    far = [[0.177, 0.065, MIDDLE_Z]]
    assert checker().smallest(motion.angles, far, motion.holding, every=6).distance > 0.005
