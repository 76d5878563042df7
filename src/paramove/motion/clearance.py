"""Clearance of planned arm paths from the table, the robot's own body and standing objects."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.robots import RobotDescription

_FAR = 0.05  # larger distances are not distinguished, m
_HIDDEN = 10.0
GRASPED_ABOVE_MIDDLE = 0.011


@dataclass(frozen=True)
class WorkSurface:
    """The box in front of the robot whose upper face is the working plane; shoulder frame, m."""

    x: tuple[float, float]
    y: tuple[float, float]
    z: float
    thickness: float = 0.1


@dataclass(frozen=True)
class UprightCylinder:
    """The objects that are handled: they stand on the working plane."""

    radius: float = 0.010
    height: float = 0.050


@dataclass(frozen=True)
class Clearance:
    """The closest approach of a path.

    Attributes:
        distance: m; at most 0.05.
        sample: Which sample of the path.
        pair: The two parts.
        standing: Which of the standing objects; None if it is something else.
    """

    distance: float
    sample: int
    pair: tuple[str, str]
    standing: int | None = None


class ClearanceChecker:
    """Distances between one arm of a robot and what surrounds it, by MuJoCo's own collision shapes.

    Args:
        robot: The robot's description.
        side: Which arm.
        surface: The working surface.
        cylinder: The standing objects' shape.
        n_standing: Maximum number of standing objects.
    """

    def __init__(
        self, robot: RobotDescription, side: str, surface: WorkSurface, cylinder: UprightCylinder, n_standing: int = 3
    ) -> None:
        self._robot, self._arm = robot, robot.arm(side)
        self._cylinder, self._n_standing, self._surface = cylinder, n_standing, surface
        self._model = self._compile(robot.model_path)
        self._data = mujoco.MjData(self._model)
        self._data.qpos[:] = 0.0
        self._qpos = [int(self._model.jnt_qposadr[self._model.joint(n).id]) for n in robot.joint_names]
        self._data.qpos[self._qpos] = robot.base_pose
        self._moving, self._fixed = self._geoms(side)
        self._held, self._surface_geom = self._model.geom("held").id, self._model.geom("surface").id
        self._hand_names = {f"{side}_hand", f"{side}_thumb"}

    def _compile(self, model_path: Path) -> mujoco.MjModel:
        spec = mujoco.MjSpec.from_file(str(model_path))
        shoulder = np.array(_site(spec, self._arm.sites.shoulder).pos)  # on the torso, axes parallel
        box, world = self._surface, spec.worldbody
        low = np.array([box.x[0], box.y[0], box.z - box.thickness])
        high = np.array([box.x[1], box.y[1], box.z])
        world.add_geom(
            name="surface", type=mujoco.mjtGeom.mjGEOM_BOX, pos=shoulder + (low + high) / 2, size=(high - low) / 2
        )
        size = [self._cylinder.radius, self._cylinder.height / 2, 0.0]
        for k in range(self._n_standing):
            body = world.add_body(name=f"standing_{k}", mocap=True, pos=[_HIDDEN, _HIDDEN, 0.0])
            body.add_geom(name=f"standing_{k}", type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=size)
        gripper = _site(spec, self._arm.sites.gripper)
        held = gripper.parent.add_geom(name="held", type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=gripper.pos, size=size)
        held.pos = np.array(gripper.pos) + np.array([0.0, 0.0, -GRASPED_ABOVE_MIDDLE])  # grasped above the middle
        self._shoulder = shoulder
        return spec.compile()

    def _geoms(self, side: str) -> tuple[list[int], list[int]]:
        model = self._model
        collides = [g for g in range(model.ngeom) if model.geom_contype[g] or model.geom_conaffinity[g]]
        chain = _bodies_below(model, f"{side}_upper_arm")
        moving = [g for g in collides if int(model.geom_bodyid[g]) in chain and model.geom(g).name != "held"]
        own_shoulder = {f"{side}_shoulder_bracket"}
        fixed = [
            g
            for g in collides
            if int(model.geom_bodyid[g]) not in chain
            and not model.geom(g).name.startswith(("standing", "surface"))
            and model.body(int(model.geom_bodyid[g])).name not in own_shoulder
        ]
        return moving, fixed

    @property
    def surface_z(self) -> float:
        """Height of the working plane, m, shoulder frame."""
        return self._surface.z

    @property
    def grasp_height(self) -> float:
        """Height at which a standing object is grasped, m, shoulder frame."""
        return self._surface.z + self._cylinder.height / 2 + GRASPED_ABOVE_MIDDLE

    @property
    def n_standing(self) -> int:
        """Maximum number of standing objects to keep clear of."""
        return self._n_standing

    @property
    def cylinder(self) -> UprightCylinder:
        """Shape of the standing objects."""
        return self._cylinder

    def smallest(self, angles: ArrayLike, standing: ArrayLike, holding: ArrayLike, every: int = 2) -> Clearance:
        """The closest approach along a path.

        Args:
            angles: Arm joints and fingers, [K, 6], rad.
            standing: Middles of standing objects to keep clear of, [M, 3], shoulder frame.
            holding: Whether an object is held, [K]; it is kept clear of the standing ones.
            every: Check every so many samples.
        """
        q = np.asarray(angles, dtype=np.float64)
        held = np.asarray(holding, dtype=bool)
        upright = self._place(np.asarray(standing, dtype=np.float64).reshape(-1, 3))
        always = self._pairs(upright)
        holding_too = np.concatenate([always, [[self._held, other] for other in upright]]) if upright else always
        columns = [self._qpos[i] for i in (*self._arm.indices, self._arm.fingers_index)]
        worst = Clearance(_FAR, 0, ("", ""))
        for k in range(0, len(q), every):
            self._data.qpos[columns] = q[k]
            mujoco.mj_kinematics(self._model, self._data)
            for one, two in self._near(holding_too if held[k] else always, worst.distance):
                distance = mujoco.mj_geomDistance(self._model, self._data, one, two, _FAR, None)
                if distance < worst.distance:
                    number = upright.index(two) if two in upright else None
                    worst = Clearance(distance, k, (self._name(one), self._name(two)), number)
        return worst

    def _pairs(self, upright: list[int]) -> Ints:
        """Shapes whose distance counts, [P, 2], without a held object."""
        pairs = [(g, other) for g in self._moving for other in (self._surface_geom, *upright)]
        pairs += [(g, other) for g in self._hand_geoms for other in self._fixed]
        return np.array(pairs, dtype=np.int64)

    def _near(self, pairs: Ints, distance: float) -> list[tuple[int, int]]:
        """The pairs that may be closer than `distance`, by the spheres around them; the surface is a box, exactly."""
        one, two = pairs.T
        away, radius = self._data.geom_xpos[one] - self._data.geom_xpos[two], self._model.geom_rbound
        apart = np.linalg.norm(away, axis=1) - radius[two]
        over = two == self._surface_geom
        beyond = np.maximum(np.abs(away[over]) - self._model.geom_size[self._surface_geom], 0.0)
        apart[over] = np.linalg.norm(beyond, axis=1)
        return [(int(a), int(b)) for a, b in pairs[apart - radius[one] < distance]]

    @property
    def _hand_geoms(self) -> list[int]:
        return [g for g in self._moving if self._model.body(int(self._model.geom_bodyid[g])).name in self._hand_names]

    def _place(self, standing: Floats) -> list[int]:
        if len(standing) > self._n_standing:
            raise ValueError(f"{len(standing)} standing objects; this checker was made for {self._n_standing}")
        self._data.mocap_pos[:] = [_HIDDEN, _HIDDEN, 0.0]
        for k, middle in enumerate(standing):
            body = self._model.body(f"standing_{k}").mocapid[0]
            self._data.mocap_pos[body] = self._shoulder + middle
        return [self._model.geom(f"standing_{k}").id for k in range(len(standing))]

    def _name(self, geom: int) -> str:
        return str(self._model.geom(geom).name or self._model.body(int(self._model.geom_bodyid[geom])).name)


def _site(spec: mujoco.MjSpec, name: str) -> Any:
    site = spec.site(name)
    if site is None:
        raise ValueError(f"the model has no site {name!r}; it has {', '.join(one.name for one in spec.sites)}")
    return site


def _bodies_below(model: mujoco.MjModel, name: str) -> set[int]:
    root = model.body(name).id
    below = {root}
    for body in range(root + 1, model.nbody):
        if int(model.body_parentid[body]) in below:
            below.add(body)
    return below
