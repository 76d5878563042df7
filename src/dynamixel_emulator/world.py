"""A MuJoCo world that the servos of a chain move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from dynamixel_emulator.errors import EmulatorError, nearest
from dynamixel_emulator.loops import STEP_S
from dynamixel_emulator.mechanics import DrivenJoint
from dynamixel_emulator.motor import RAD_PER_PULSE, Effort

BLOCKED_DAMPING = 1e6
"""N m s/rad of a joint that is held: what it still creeps nobody measures."""


class MujocoMechanics:
    """A world in which servos drive joints and everything else falls, collides and is damped as its model says.

    Args:
        model_path: MJCF. Its time step becomes 1 ms, and its actuators do nothing: the servos stand in for them.
        joints: In the order of the chain. Two servos may drive one joint.
        posture: Of joints at the start, rad; others are as the model says.

    Attributes:
        model, data: For those who look at the world or put things into it.
    """

    def __init__(
        self, model_path: Path, joints: Sequence[DrivenJoint], posture: Mapping[str, float] | None = None
    ) -> None:
        try:
            self.model = mujoco.MjModel.from_xml_path(str(model_path))
        except ValueError as error:
            missing = not Path(model_path).is_file()
            raise EmulatorError(f"{model_path} is no world that MuJoCo reads: {error}", missing=missing) from error
        self.model.opt.timestep = STEP_S
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
        self.data = mujoco.MjData(self.model)
        found = [self._joint(joint.name) for joint in joints]
        self._qpos = np.array([self.model.jnt_qposadr[one] for one in found], dtype=np.intp)
        self._dof = np.array([self.model.jnt_dofadr[one] for one in found], dtype=np.intp)
        self._counts = np.array([joint.counts_per_rad for joint in joints], dtype=np.float64)
        self._zero = np.array([joint.zero_counts for joint in joints], dtype=np.float64)
        self._gear = self._counts * RAD_PER_PULSE  # radians of the shaft for one of the joint
        self._own_damping: NDArray[np.float64] = self.model.dof_damping.copy()
        for name, angle in (posture or {}).items():
            self.data.qpos[self.model.jnt_qposadr[self._joint(name)]] = angle
        self._place_followers()
        mujoco.mj_forward(self.model, self.data)

    def shafts(self) -> list[tuple[float, float]]:
        """Where the servos are, pulses, and how fast they turn, pulses per second."""
        places = self._zero + self._counts * self.data.qpos[self._qpos]
        return list(zip(places.tolist(), (self._counts * self.data.qvel[self._dof]).tolist(), strict=True))

    def step(self, efforts: Sequence[Effort], blocked: Sequence[bool]) -> None:
        """One millisecond with these efforts; something holds the blocked ones.

        Raises:
            RuntimeError: The simulation has become unstable; MuJoCo's warning is named.
        """
        self.data.qfrc_applied[self._dof] = 0.0
        self.model.dof_damping[:] = self._own_damping
        for dof, gear, effort, held in zip(self._dof, self._gear, efforts, blocked, strict=True):
            self.data.qfrc_applied[dof] += gear * effort.torque
            self.model.dof_damping[dof] += gear * gear * effort.damping + (BLOCKED_DAMPING if held else 0.0)
        mujoco.mj_step(self.model, self.data)
        if self.data.warning.number.any():
            kinds = [mujoco.mjtWarning(number).name for number in np.flatnonzero(self.data.warning.number)]
            raise RuntimeError(f"the emulated servos' world broke at {self.data.time:.3f} s: {', '.join(kinds)}")

    def angles(self, names: Sequence[str]) -> list[float]:
        """Of these joints, rad or m."""
        return [float(self.data.qpos[self.model.jnt_qposadr[self._joint(name)]]) for name in names]

    def _place_followers(self) -> None:
        """Joints that others are coupled to, such as the fingers of a gripper, at the start."""
        model = self.model
        for one in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT):
            follower, leader = model.eq_obj1id[one], model.eq_obj2id[one]
            if leader >= 0:
                turned = self.data.qpos[model.jnt_qposadr[leader]] - model.qpos0[model.jnt_qposadr[leader]]
                at = model.jnt_qposadr[follower]
                self.data.qpos[at] = model.qpos0[at] + np.polyval(model.eq_data[one, 4::-1], turned)

    def _joint(self, name: str) -> int:
        number: int = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_JOINT, name)
        known = {self.model.joint(one).name: one for one in range(self.model.njnt) if self.model.jnt_type[one] >= 2}
        if name not in known:
            raise EmulatorError(f"the world has no hinge or slide {name!r} for a servo; {nearest(name, known)}")
        return number
