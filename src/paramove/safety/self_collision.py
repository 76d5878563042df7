"""How near the parts of a robot come to each other and to what is fixed around it, by its MuJoCo model.

Each pair of colliding shapes on different, not neighbouring bodies is measured, except pairs that touch by design: in a
pose that is known to be free, or in each of many random poses.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, InputError

FAR_M = 0.05
TOUCHING_M = 0.005


class SelfCollision:
    """Distances for the safety gate.

    Args:
        model: Of the robot and what is fixed around it.
        joints: Names of the joints in the order of the pose, all hinges or slides of the model.
        free_pose: A pose without collision, [J], rad: what is closer than 5 mm there touches by design.
        lower, upper: Of the joints, [J], rad, for the random poses.
        n_samples, seed: Of the random poses.

    Attributes:
        pairs: The measured pairs of geoms, [P, 2].

    Raises:
        InputError: A joint that the model does not have, or that is no hinge or slide.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        joints: Sequence[str],
        free_pose: Floats,
        lower: Floats,
        upper: Floats,
        n_samples: int = 200,
        seed: int = 0,
    ) -> None:
        self._model = model
        self._data = mujoco.MjData(model)
        self._qpos = np.array([_qpos_index(model, joint) for joint in joints], dtype=np.intp)
        self.pairs = _movable_pairs(model)
        self._free_of(free_pose, lower, upper, n_samples, seed)

    def distances(self, q: Floats) -> tuple[float, str, str]:
        """The minimum distance in the pose `q` [J], rad: metres, negative for penetration, and the two bodies.

        Without anything nearer than 50 mm: 50 mm and two empty names.
        """
        self._pose(q)
        near = self._near()
        distances = [self._measure(one, other) for one, other in self.pairs[near]]
        if not distances or min(distances) >= FAR_M:
            return FAR_M, "", ""
        one, other = self.pairs[near][int(np.argmin(distances))]
        return min(distances), self._body(one), self._body(other)

    def _free_of(self, free_pose: Floats, lower: Floats, upper: Floats, n_samples: int, seed: int) -> None:
        """Leave out the pairs that touch by design."""
        generator = np.random.default_rng(seed)
        always = np.ones(len(self.pairs), dtype=bool)
        for q in generator.uniform(lower, upper, (n_samples, len(lower))):
            always &= self._touching(q)
        self.pairs = self.pairs[~(always | self._touching(free_pose))]

    def _touching(self, q: Floats) -> NDArray[np.bool_]:
        self._pose(q)
        near = self._near()
        touching = np.zeros(len(self.pairs), dtype=bool)
        touching[near] = [self._measure(one, other) < TOUCHING_M for one, other in self.pairs[near]]
        return touching

    def _pose(self, q: Floats) -> None:
        self._data.qpos[self._qpos] = q
        mujoco.mj_kinematics(self._model, self._data)

    def _near(self) -> NDArray[np.intp]:
        """Pairs whose bounding spheres are near; a plane's is without end."""
        one, other = self.pairs.T
        centre, radius = self._data.geom_xpos, self._model.geom_rbound
        gap = np.linalg.norm(centre[one] - centre[other], axis=1) - radius[one] - radius[other]
        endless = (radius[one] == 0.0) | (radius[other] == 0.0)
        return np.flatnonzero(endless | (gap < FAR_M))

    def _measure(self, one: int, other: int) -> float:
        return float(mujoco.mj_geomDistance(self._model, self._data, one, other, FAR_M, None))

    def _body(self, geom: int) -> str:
        return str(self._model.body(self._model.geom_bodyid[geom]).name)


def _qpos_index(model: mujoco.MjModel, joint: str) -> int:
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    if number < 0:
        names = ", ".join(model.joint(i).name for i in range(model.njnt))
        raise InputError(f"joint {joint!r} is not in the model for self-collision, which has: {names}")
    if int(model.jnt_type[number]) not in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)):
        raise InputError(f"joint {joint!r} of the model for self-collision has no single angle; allowed: hinge, slide")
    return int(model.jnt_qposadr[number])


def _movable_pairs(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Pairs of colliding geoms whose bodies are neither one nor neighbours, welded bodies taken as one, [P, 2]."""
    colliding = np.flatnonzero((model.geom_contype != 0) | (model.geom_conaffinity != 0))
    weld = model.body_weldid
    parent = weld[model.body_parentid]
    pairs = [
        (one, other)
        for i, one in enumerate(colliding)
        for other in colliding[i + 1 :]
        if _apart(int(weld[model.geom_bodyid[one]]), int(weld[model.geom_bodyid[other]]), parent)
        and _meant_to_collide(model, one, other)
    ]
    return np.array(pairs, dtype=np.intp).reshape(-1, 2)


def _apart(body: int, other: int, parent: NDArray[np.int32]) -> bool:
    return body not in (other, parent[other]) and parent[body] != other


def _meant_to_collide(model: mujoco.MjModel, one: np.intp, other: np.intp) -> bool:
    one_meets_other = model.geom_contype[one] & model.geom_conaffinity[other]
    return bool(one_meets_other | (model.geom_contype[other] & model.geom_conaffinity[one]))
