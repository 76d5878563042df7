"""How far a servo arm stays from its table and from standing objects, and whether it touches itself.

By its own collision shapes.
"""

from __future__ import annotations

import mujoco
import numpy as np

from paramove.documents import Floats
from paramove.motion.clearance import GRASPED_ABOVE_MIDDLE, UprightCylinder
from paramove.robots import Chain, RobotDescription

MAX_STANDING = 8
_FAR = 0.05  # larger distances are not distinguished, m
_HIDDEN = 10.0


class TableClearance:
    """Judges joint angles [K, arm joints and gripper], rad.

    Args:
        robot: The robot's description.
        chain: Its arm.
        table_z: Height of the table in the frame of the base, m.
        cylinder: Shape of the objects that stand on it, one of which may be held.
    """

    def __init__(
        self,
        robot: RobotDescription,
        chain: Chain,
        table_z: float = 0.0,
        cylinder: UprightCylinder | None = None,
    ) -> None:
        self._cylinder = cylinder or UprightCylinder()
        spec = mujoco.MjSpec.from_file(str(robot.model_path))
        size = [self._cylinder.radius, self._cylinder.height / 2, 0.0]
        for name in ("held", *(f"standing_{k}" for k in range(MAX_STANDING))):
            body = spec.worldbody.add_body(name=name, mocap=True, pos=[_HIDDEN, _HIDDEN, 0.0])
            body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=size, contype=0, conaffinity=0)
        self._model = model = spec.compile()
        self._data = mujoco.MjData(model)
        self._upright = [model.geom(f"standing_{k}").id for k in range(MAX_STANDING)]
        self._held, self._held_body = model.geom("held").id, int(model.body("held").mocapid[0])
        self._qpos = [int(model.joint(name).qposadr[0]) for name in (*chain.joints, chain.gripper)]
        mujoco.mj_forward(model, self._data)
        self._base = np.array(self._data.site(chain.sites.base).xpos)
        self._table = table_z + float(self._base[2])
        self._end_effector = chain.sites.end_effector
        bodies = model.geom_bodyid
        self._moving = np.flatnonzero((model.body_weldid[bodies] != 0) & (model.body_mocapid[bodies] < 0))

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

    def to_standing(self, angles: Floats, standing: Floats, holding: bool) -> tuple[float, int, int]:
        """The closest approach to the objects that stand at `standing` [M, 2], frame of the base, m.

        Returns:
            The distance, at most 0.05 m; in which row; to which object. A held object is upright.
        """
        self._data.mocap_pos[:] = [_HIDDEN, _HIDDEN, 0.0]
        half = self._cylinder.height / 2
        for geom, (x, y) in zip(self._upright, standing, strict=False):
            body = self._model.body_mocapid[self._model.geom_bodyid[geom]]
            self._data.mocap_pos[body] = [self._base[0] + x, self._base[1] + y, self._table + half]
        geoms = [*self._moving.tolist(), self._held] if holding else self._moving.tolist()
        closest = (_FAR, 0, -1)
        for number, row in enumerate(angles):
            self._place(row)
            if holding:
                hanging = self._data.site(self._end_effector).xpos - [0.0, 0.0, GRASPED_ABOVE_MIDDLE]
                self._data.mocap_pos[self._held_body] = hanging
                mujoco.mj_kinematics(self._model, self._data)
            for k, other in enumerate(self._upright[: len(standing)]):
                away = np.linalg.norm(self._data.geom_xpos[geoms] - self._data.geom_xpos[other], axis=1)
                apart = away - self._model.geom_rbound[geoms] - self._model.geom_rbound[other]
                for geom in np.array(geoms)[apart < closest[0]]:
                    distance = mujoco.mj_geomDistance(self._model, self._data, int(geom), other, _FAR, None)
                    if distance < closest[0]:
                        closest = (distance, number, k)
        return closest

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
