"""How far a servo arm stays above its table, and whether it touches itself, by its own collision shapes."""

from __future__ import annotations

import mujoco
import numpy as np

from paramove.documents import Floats
from paramove.robots import Chain, RobotDescription


class TableClearance:
    """Judges joint angles [K, arm joints and gripper], rad.

    Args:
        robot: The robot's description.
        chain: Its arm.
        table_z: Height of the table in the frame of the base, m.
    """

    def __init__(self, robot: RobotDescription, chain: Chain, table_z: float = 0.0) -> None:
        self._model = model = mujoco.MjModel.from_xml_path(str(robot.model_path))
        self._data = mujoco.MjData(model)
        self._qpos = [int(model.joint(name).qposadr[0]) for name in (*chain.joints, chain.gripper)]
        mujoco.mj_forward(model, self._data)
        self._table = table_z + float(self._data.site(chain.sites.base).xpos[2])
        self._moving = np.flatnonzero(model.body_weldid[model.geom_bodyid] != 0)

    def heights(self, angles: Floats) -> Floats:
        """Of the arm's lowest moving point above the table, [K], m."""
        heights = np.empty(len(angles))
        for number, row in enumerate(angles):
            self._place(row)
            heights[number] = self._lowest() - self._table
        return heights

    def touching(self, angles: Floats) -> tuple[str, str] | None:
        """Two bodies of the arm that touch in one of the poses, the fingers aside; None if none do."""
        for row in angles:
            self._place(row)
            mujoco.mj_fwdPosition(self._model, self._data)
            for contact in self._data.contact[: self._data.ncon]:
                bodies = [int(self._model.geom_bodyid[geom]) for geom in contact.geom]
                if len({int(self._model.body_parentid[body]) for body in bodies}) == 2:
                    first, second = (self._model.body(body).name for body in bodies)
                    return first, second
        return None

    def _place(self, row: Floats) -> None:
        """Put the joints there, and those that are coupled to them."""
        model, data = self._model, self._data
        data.qpos[self._qpos] = row
        for i in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT):
            follower, leader = (int(model.jnt_qposadr[joint[i]]) for joint in (model.eq_obj1id, model.eq_obj2id))
            data.qpos[follower] = np.polyval(model.eq_data[i, 4::-1], data.qpos[leader])
        mujoco.mj_kinematics(model, data)

    def _lowest(self) -> float:
        """Height of the lowest point of boxes and cylinders, of other shapes that of a ball around them."""
        geoms, model = self._moving, self._model
        upright = self._data.geom_xmat[geoms].reshape(-1, 3, 3)[:, 2]  # how far each own axis points up
        size, kind = model.geom_size[geoms], model.geom_type[geoms]
        box = (np.abs(upright) * size).sum(axis=1)
        below = np.where(kind == mujoco.mjtGeom.mjGEOM_BOX, box, model.geom_rbound[geoms])
        across = np.sqrt(np.maximum(0.0, 1.0 - upright[:, 2] ** 2))
        cylinder = size[:, 1] * np.abs(upright[:, 2]) + size[:, 0] * across
        below = np.where(kind == mujoco.mjtGeom.mjGEOM_CYLINDER, cylinder, below)
        return float((self._data.geom_xpos[geoms, 2] - below).min())
