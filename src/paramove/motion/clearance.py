"""Clearance of planned arm motions from the working surface, standing objects and the robot's own body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.motion.gripper_arm import GripperArm
from paramove.motion.lowest_point import LowestPoint
from paramove.motion.model_check import check_model, qpos_addresses
from paramove.motion.plans import MAX_STANDING, check_number
from paramove.robots import RobotDescription, WorkingSurface

FAR_M = 0.05
"""Larger distances are not distinguished."""
GRASPED_ABOVE_MIDDLE = 0.011
_HIDDEN = 10.0
_THICKNESS_M = 0.1  # of the box
_ADDED = ("surface", "held", *(f"standing_{k}" for k in range(MAX_STANDING)))


@dataclass(frozen=True)
class Clearance:
    """The closest approach of a motion.

    Attributes:
        distance: m; at most 0.05.
        sample: Which sample of the motion.
        pair: The two parts.
        standing: Which of the standing objects; None if it is something else.
    """

    distance: float
    sample: int
    pair: tuple[str, str]
    standing: int | None = None


class ClearanceChecker:
    """Distances between one arm of a robot and what surrounds it, by MuJoCo's own collision shapes.

    Angles are those of the arm, [K, J + 1], rad; positions are in the frame of the arm's base, m.

    Args:
        robot: The robot's description; joints of other parts are in the base pose.
        arm: Which arm.
        surface: The working surface and the standing objects, one of which may be held; then it is upright.

    Raises DescriptionError if the robot's model does not fit its description.
    """

    def __init__(self, robot: RobotDescription, arm: GripperArm, surface: WorkingSurface) -> None:
        check_model(robot)
        self.surface = surface
        self._model = model = _compiled(robot, surface)
        self._data = data = mujoco.MjData(model)
        data.qpos[qpos_addresses(model, robot.joint_names)] = robot.base_pose
        self._qpos = qpos_addresses(model, arm.joints)
        self._tip = model.site(arm.tip_site).id
        mujoco.mj_kinematics(model, data)
        self._base = np.array(data.site(arm.base_site).xpos)
        self._surface, self._held = (model.geom(name).id for name in ("surface", "held"))
        middle = [sum(surface.x) / 2, sum(surface.y) / 2, surface.z - _THICKNESS_M / 2]
        self._surface_middle = self._base + np.array(middle)
        self._upright = [model.geom(f"standing_{k}").id for k in range(MAX_STANDING)]
        collides = [
            geom
            for geom in np.flatnonzero((model.geom_contype != 0) | (model.geom_conaffinity != 0)).tolist()
            if model.geom(geom).name not in _ADDED
        ]
        chain = self._bodies_below(model.joint(arm.joints[0]))
        hand = self._bodies_below(model.joint(arm.joints[-2]))
        self._moving = [geom for geom in collides if int(model.geom_bodyid[geom]) in chain]
        self._hand = [geom for geom in self._moving if int(model.geom_bodyid[geom]) in hand]
        self._fixed = [geom for geom in collides if geom not in self._moving]
        self._lowest = LowestPoint(model, self._moving)

    @property
    def grasp_height(self) -> float:
        """Height at which a standing object is grasped, m."""
        return self.surface.z + self.surface.object_height / 2 + GRASPED_ABOVE_MIDDLE

    def smallest(self, angles: ArrayLike, standing: ArrayLike, holding: ArrayLike, every: int = 2) -> Clearance:
        """The closest approach of the arm to surface and objects, of its hand to the body, and of what it holds.

        Args:
            angles: The motion.
            standing: Standing objects to keep clear of, [M, 2].
            holding: Whether an object is held, [K]; it is kept clear of the standing ones.
            every: Check every so many samples.
        """
        upright = self._stand(standing)
        pairs = [(one, other) for one in self._moving for other in (self._surface, *upright)]
        pairs += [(one, other) for one in self._hand for other in self._fixed]
        return self._closest(angles, np.array(pairs), upright, holding, every)

    def to_standing(self, angles: ArrayLike, standing: ArrayLike, holding: ArrayLike) -> Clearance:
        """As `smallest`, from standing objects alone, in every sample."""
        upright = self._stand(standing)
        pairs = [(one, other) for one in self._moving for other in upright]
        return self._closest(angles, np.array(pairs), upright, holding, 1)

    def heights(self, angles: Floats) -> Floats:
        """Of the arm's lowest point above the plane of the surface, [K], m."""
        heights = np.empty(len(angles))
        for number, row in enumerate(angles):
            self._place(row)
            heights[number] = self._lowest.height(self._data) - self._base[2] - self.surface.z
        return heights

    def touching(self, angles: Floats) -> tuple[str, str] | None:
        """Two bodies of the robot that touch in one of the poses, the fingers aside; None if none do."""
        for row in angles:
            self._place(row)
            mujoco.mj_fwdPosition(self._model, self._data)
            for contact in self._data.contact[: self._data.ncon]:
                bodies = [int(self._model.geom_bodyid[geom]) for geom in contact.geom]
                if len({int(self._model.body_parentid[body]) for body in bodies}) == 2:
                    first, second = (self._model.body(body).name for body in bodies)
                    return first, second
        return None

    def _closest(self, angles: ArrayLike, pairs: Ints, upright: list[int], holding: ArrayLike, every: int) -> Clearance:
        q, pairs = np.asarray(angles, dtype=np.float64), np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
        held = np.broadcast_to(np.asarray(holding, dtype=bool), len(q))
        held_too = np.concatenate([pairs, [[self._held, other] for other in upright]]) if upright else pairs
        worst = Clearance(FAR_M, 0, ("", ""))
        for k in range(0, len(q), every):
            self._place(q[k], bool(held[k]) and bool(upright))
            for one, other in self._near(held_too if held[k] else pairs, worst.distance):
                distance = mujoco.mj_geomDistance(self._model, self._data, one, other, FAR_M, None)
                if distance < worst.distance:
                    number = upright.index(other) if other in upright else None
                    worst = Clearance(distance, k, (self._name(one), self._name(other)), number)
        return worst

    def _near(self, pairs: Ints, distance: float) -> list[tuple[int, int]]:
        """The pairs that may be closer than `distance`, by the spheres around them; the surface is a box, exactly."""
        one, other = pairs.T
        away, radius = self._data.geom_xpos[one] - self._data.geom_xpos[other], self._model.geom_rbound
        apart = np.linalg.norm(away, axis=1) - radius[other]
        over = other == self._surface
        beyond = np.maximum(np.abs(away[over]) - self._model.geom_size[self._surface], 0.0)
        apart[over] = np.linalg.norm(beyond, axis=1)
        apart[radius[other] == 0.0] = -FAR_M  # a plane, which has no end
        return [(int(a), int(b)) for a, b in pairs[apart - radius[one] < distance]]

    def _stand(self, standing: ArrayLike) -> list[int]:
        """Puts up the standing objects; their shapes."""
        places = np.asarray(standing, dtype=np.float64).reshape(-1, 2)
        check_number(places)
        self._data.mocap_pos[:] = _HIDDEN
        self._data.mocap_pos[self._mocap(self._surface)] = self._surface_middle
        z = self.surface.z + self.surface.object_height / 2
        for geom, (x, y) in zip(self._upright, places, strict=False):
            self._data.mocap_pos[self._mocap(geom)] = self._base + np.array([x, y, z])
        return self._upright[: len(places)]

    def _place(self, row: Floats, holding: bool = False) -> None:
        """Puts the joints there, those that are coupled to them, and what is held."""
        model, data = self._model, self._data
        data.qpos[self._qpos] = row
        for i in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT):
            follower, leader = (int(model.jnt_qposadr[joint[i]]) for joint in (model.eq_obj1id, model.eq_obj2id))
            data.qpos[follower] = np.polyval(model.eq_data[i, 4::-1], data.qpos[leader])
        mujoco.mj_kinematics(model, data)
        if holding:
            data.mocap_pos[self._mocap(self._held)] = data.site_xpos[self._tip] - [0.0, 0.0, GRASPED_ABOVE_MIDDLE]
            mujoco.mj_kinematics(model, data)

    def _mocap(self, geom: int) -> int:
        return int(self._model.body_mocapid[self._model.geom_bodyid[geom]])

    def _bodies_below(self, joint: Any) -> set[int]:
        below = {int(joint.bodyid[0])}
        for body in range(min(below) + 1, self._model.nbody):
            if int(self._model.body_parentid[body]) in below:
                below.add(body)
        return below

    def _name(self, geom: int) -> str:
        return str(self._model.geom(geom).name or self._model.body(int(self._model.geom_bodyid[geom])).name)


def _compiled(robot: RobotDescription, surface: WorkingSurface) -> mujoco.MjModel:
    """The robot's model with the surface and hidden cylinders, which collide with nothing by themselves."""
    spec = mujoco.MjSpec.from_file(str(robot.model_path))
    alone = {"contype": 0, "conaffinity": 0}
    half = [(surface.x[1] - surface.x[0]) / 2, (surface.y[1] - surface.y[0]) / 2, _THICKNESS_M / 2]
    size = [surface.object_radius, surface.object_height / 2, 0.0]
    for name in _ADDED:
        body = spec.worldbody.add_body(name=name, mocap=True, pos=[_HIDDEN, _HIDDEN, _HIDDEN])
        if name == "surface":
            body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, size=half, **alone)
        else:
            body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=size, **alone)
    return spec.compile()
