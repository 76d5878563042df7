"""A robot as simple bodies: their shapes, once, and their poses for given joint angles."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from paramove.documents import Floats

VISUAL_GROUP = 2
_TYPES = {
    mujoco.mjtGeom.mjGEOM_SPHERE: "sphere",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoid",
    mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
    mujoco.mjtGeom.mjGEOM_BOX: "box",
}


class RobotShape:
    """Visual geoms of an MJCF file and forward kinematics by MuJoCo. World frame: that of the file, m.

    Args:
        model_path: The MJCF file. Geoms of other types than sphere, capsule, ellipsoid, cylinder, box are left out.
        base_pose: Joint name -> angle, rad, of the pose until joint angles are received.
    """

    def __init__(self, model_path: Path, base_pose: Mapping[str, float]) -> None:
        self._model = mujoco.MjModel.from_xml_path(str(model_path))
        self._data = mujoco.MjData(self._model)
        self._geoms = [
            geom
            for geom in range(self._model.ngeom)
            if self._model.geom_group[geom] == VISUAL_GROUP and int(self._model.geom_type[geom]) in _TYPES
        ]
        bodies = sorted({int(self._model.geom_bodyid[geom]) for geom in self._geoms})
        self._bodies = np.array(bodies, dtype=np.intp)
        self._index_of_body = {body: index for index, body in enumerate(bodies)}
        self.move(base_pose)

    def move(self, angles: Mapping[str, float]) -> None:
        """Takes the joint angles, rad; unknown joints and values that are not finite are ignored."""
        for name, angle in angles.items():
            joint = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_JOINT, name)
            if joint >= 0 and np.isfinite(angle):
                self._data.qpos[self._model.jnt_qposadr[joint]] = angle
        mujoco.mj_kinematics(self._model, self._data)

    def site(self, name: str) -> Floats:
        """Position of a site [3], m; raises KeyError if the model has none of that name."""
        return np.array(self._data.site(name).xpos, dtype=np.float64)

    def parts(self) -> list[dict[str, Any]]:
        """Each geom: the index of its body in `poses`, type, size as in MJCF, pose in the body, colour."""
        model = self._model
        parts = []
        for geom in self._geoms:
            material = int(model.geom_matid[geom])
            colour = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
            parts.append(
                {
                    "body": self._index_of_body[int(model.geom_bodyid[geom])],
                    "type": _TYPES[int(model.geom_type[geom])],
                    "size": rounded(model.geom_size[geom]),
                    "place": rounded(model.geom_pos[geom]),
                    "turn": rounded(model.geom_quat[geom]),
                    "colour": rounded(colour[:3]),
                }
            )
        return parts

    def poses(self) -> list[list[float]]:
        """Position x, y, z and quaternion w, x, y, z of each body with parts."""
        poses = np.concatenate([self._data.xpos[self._bodies], self._data.xquat[self._bodies]], axis=1)
        return [rounded(pose) for pose in poses]


def rounded(values: Floats) -> list[float]:
    """As the page gets them."""
    return [round(float(value), 5) for value in values]
