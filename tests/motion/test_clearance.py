"""Distances of planned paths from what stands around, compared with geometry that is known otherwise."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from paramove.motion.clearance import (
    FAR_M,
    GRASPED_ABOVE_MIDDLE,
    ClearanceChecker,
)
from paramove.motion.gripper_arm import GripperArm
from paramove.motion.plans import MAX_STANDING
from paramove.motion.reaching_movement import ArmPoses
from paramove.robots import RobotDescription, SurfaceParameters, WorkingSurface
from tests.motion.reaching import ARM, HOAP3, JOINTS, RIGHT, SURFACE, at, checker, planner, solver
from tests.robots.servo_arms import ARMS, ArmModel

each_servo_arm = pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.name)


def over_the_surface(height: float) -> np.ndarray:
    """Arm joints and half-open fingers with a level hand, the gripper `height` above the working plane, [1, 6]."""
    gripper = np.array([[0.165, -0.05, SURFACE.z + height]])
    pose = ArmPoses(np.array([[0.03, -0.05, -0.09]]), gripper, np.array([[0.0, 1.0, 0.0]]))
    found = solver().solve(pose, level=1.0, slope=0.25)
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
    """One upright cylinder right above the other."""
    angles = over_the_surface(SURFACE.object_height + gap + SURFACE.object_height / 2 + GRASPED_ABOVE_MIDDLE)
    below = ARM.kinematics.forward(angles[0, :5]).gripper[None, :2]
    for found in (checker().smallest(angles, below, [True]), checker().to_standing(angles, below, [True])):
        np.testing.assert_allclose(found.distance, gap, rtol=0, atol=5e-4)
        assert set(found.pair) == {"held", "standing_0"}
        assert found.standing == 0
    empty = checker().smallest(angles, below, [False])
    assert empty.distance > gap


def test_the_nearest_of_several_objects_and_the_sample_are_named() -> None:
    path = np.concatenate([over_the_surface(h) for h in np.linspace(0.12, 0.06, 9)])
    place = ARM.kinematics.forward(path[-1, :5]).gripper
    standing = [[0.20, 0.10], place[:2], [0.12, -0.15]]
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
    assert checker().smallest(angles, [place[:2]], [False]).distance < free
    assert checker().smallest(angles, [], [False]).distance == free


def test_a_hand_at_the_body_is_seen() -> None:
    """Poses all over the range, the table out of the way: some put the hand into the body, and it is named."""
    table_away = ClearanceChecker(HOAP3, RIGHT, SurfaceParameters(z=-1.0).of(HOAP3, "right"))
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
    other = ClearanceChecker(HOAP3, RIGHT, SurfaceParameters(z=SURFACE.z - 0.007).of(HOAP3, "right"))
    angles = over_the_surface(0.035)
    gained = other.smallest(angles, [], [False]).distance - checker().smallest(angles, [], [False]).distance
    np.testing.assert_allclose(gained, 0.007, rtol=0, atol=1e-5)


def test_where_nothing_stands_nothing_is_near() -> None:
    found = checker().to_standing(over_the_surface(0.09), [], [True])
    assert (found.distance, found.standing) == (FAR_M, None)


def test_more_objects_than_it_was_made_for_are_refused() -> None:
    with pytest.raises(ValueError, match=r"9 objects.* 8"):
        checker().smallest(over_the_surface(0.09), np.zeros((MAX_STANDING + 1, 2)), [False])


def test_a_fetch_closes_the_hand_around_its_object_without_being_pushed_away_from_the_others() -> None:
    """With the fetched object among those to keep clear of, no path to it would be clear."""
    motion = planner().fetch(at((0.177, -0.02)))
    own = [[0.177, -0.02]]
    assert checker().smallest(motion.angles, own, motion.holding, every=6).distance < 0.0
    far = [[0.177, 0.065]]
    assert checker().smallest(motion.angles, far, motion.holding, every=6).distance > 0.005


def of_servo_arm(robot: RobotDescription, table_z: float = 0.0) -> ClearanceChecker:
    table = WorkingSurface(x=(-1.0, 1.0), y=(-1.0, 1.0), z=table_z)
    return ClearanceChecker(robot, GripperArm.of(robot, ""), table)


def poses(robot: RobotDescription, count: int) -> np.ndarray:
    indices = [*robot.chain.indices, robot.chain.gripper_index]
    return np.random.default_rng(3).uniform(robot.lower[indices], robot.upper[indices], size=(count, len(indices)))


@each_servo_arm
def test_heights_are_those_of_the_lowest_part_above_the_table(robot: RobotDescription) -> None:
    """As in the arm's scene, whose table is another shape."""
    scene = ArmModel(robot, "scene.xml")
    model, data = scene.model, scene.data
    table = model.geom("table").id
    model.geom_size[table, :2], model.geom_rbound[table] = 2.0, 3.0  # under all of the arm
    arm = model.body_rootid[model.joint(robot.chain.joints[0]).bodyid[0]]
    bodies = model.geom_bodyid
    moving = np.flatnonzero((model.body_weldid[bodies] != 0) & (model.body_rootid[bodies] == arm)).tolist()
    rows, above = poses(robot, 60), 0
    for row, height in zip(rows, of_servo_arm(robot).heights(rows), strict=True):
        angles = robot.base_pose.copy()
        angles[[*robot.chain.indices, robot.chain.gripper_index]] = row
        scene.place(angles)
        nearest = min(mujoco.mj_geomDistance(model, data, table, geom, 1.0, None) for geom in moving)
        if height > 1e-3:
            above += 1
            assert nearest == pytest.approx(height, rel=0, abs=1e-4)
        else:
            assert nearest < 1.1e-3
    assert above > 15


@each_servo_arm
def test_the_table_may_stand_lower_or_higher(robot: RobotDescription) -> None:
    rows = poses(robot, 5)
    at_base, lower = (of_servo_arm(robot, z).heights(rows) for z in (0.0, -0.1))
    np.testing.assert_allclose(lower - at_base, 0.1, rtol=0, atol=1e-12)


@each_servo_arm
def test_the_arm_that_folds_into_its_base_is_told_with_what_touches(robot: RobotDescription) -> None:
    clearance = of_servo_arm(robot)
    indices = [*robot.chain.indices, robot.chain.gripper_index]
    assert clearance.touching(robot.base_pose[indices][None]) is None
    touching = [clearance.touching(row[None]) for row in poses(robot, 200)]
    assert any(pair is not None for pair in touching)
    assert all(len(set(pair)) == 2 for pair in touching if pair is not None)
    assert clearance.touching(np.stack([robot.base_pose[indices]] * 2)) is None
