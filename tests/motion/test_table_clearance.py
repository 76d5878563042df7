"""Heights above the table and touching parts, as MuJoCo's own distances and collisions tell them."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from paramove.motion.table_clearance import TableClearance
from tests.robots.servo_arms import ARMS, ArmModel

each_arm = pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.name)
FAR = 1.0


def poses(robot, count: int) -> np.ndarray:
    indices = [*robot.chain.indices, robot.chain.gripper_index]
    return np.random.default_rng(3).uniform(robot.lower[indices], robot.upper[indices], size=(count, len(indices)))


@each_arm
def test_heights_are_the_distances_from_the_table(robot) -> None:
    clearance, scene = TableClearance(robot, robot.chain), ArmModel(robot, "scene.xml")
    model, data = scene.model, scene.data
    table = model.geom("table").id
    model.geom_size[table, :2], model.geom_rbound[table] = 2.0, 3.0  # under all of the arm
    arm = model.body_rootid[model.joint(robot.chain.joints[0]).bodyid[0]]
    moving = [g for g in range(model.ngeom) if model.body_weldid[model.geom_bodyid[g]] and _of(model, g, arm)]
    rows = poses(robot, 60)
    found, above = clearance.heights(rows), 0
    for row, height in zip(rows, found, strict=True):
        angles = robot.base_pose.copy()
        angles[[*robot.chain.indices, robot.chain.gripper_index]] = row
        scene.place(angles)
        nearest = min(mujoco.mj_geomDistance(model, data, table, geom, FAR, None) for geom in moving)
        if height > 1e-3:
            above += 1
            assert nearest == pytest.approx(height, rel=0, abs=1e-4)
        else:
            assert nearest < 1.1e-3
    assert above > 15


@each_arm
def test_the_table_may_stand_lower_or_higher(robot) -> None:
    rows = poses(robot, 5)
    at_base, lower = (TableClearance(robot, robot.chain, z).heights(rows) for z in (0.0, -0.1))
    np.testing.assert_allclose(lower - at_base, 0.1, rtol=0, atol=1e-12)


@each_arm
def test_the_arm_that_folds_into_its_base_is_told_with_what_touches(robot) -> None:
    clearance = TableClearance(robot, robot.chain)
    indices = [*robot.chain.indices, robot.chain.gripper_index]
    assert clearance.touching(robot.base_pose[indices][None]) is None
    touching = [clearance.touching(row[None]) for row in poses(robot, 200)]
    assert any(pair is not None for pair in touching)
    assert all(len(set(pair)) == 2 for pair in touching if pair is not None)
    assert clearance.touching(np.stack([robot.base_pose[indices]] * 2)) is None


def _of(model: mujoco.MjModel, geom: int, root: int) -> bool:
    return bool(model.body_rootid[model.geom_bodyid[geom]] == root)
