"""A MuJoCo model that a chain of servos moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from dynamixel_emulator.errors import EmulatorError, suggestion
from dynamixel_emulator.loops import STEP_S
from dynamixel_emulator.mechanics import DrivenJoint
from dynamixel_emulator.motor import RAD_PER_PULSE, Effort

BLOCKED_DAMPING = 1e6
"""Damping of a blocked joint, N m s/rad: its remaining motion is too slow to measure."""


class MujocoMechanics:
    """A simulated world whose joints the servos drive; gravity, contacts and damping are as in the model.

    Args:
        world: MJCF file, or a model with its state. Its time step is set to 1 ms; its actuators are disabled, the
            servos replace them. RK4 is replaced by the implicit integrator: it takes the servos' damping at the
            velocity before the step, with which a light link becomes unstable.
        joints: Driven joints in the order of the chain. Two servos may drive one joint.
        posture: Initial joint positions by name, rad; others as they are in the world.
        advance: Advances the world by a step, with whatever else moves in it; by default `mujoco.mj_step`.

    Attributes:
        model, data: MuJoCo model and state, to inspect or change the world.
    """

    def __init__(
        self,
        world: Path | tuple[mujoco.MjModel, mujoco.MjData],
        joints: Sequence[DrivenJoint],
        posture: Mapping[str, float] | None = None,
        advance: Callable[[], None] | None = None,
    ) -> None:
        self.model, self.data = world if isinstance(world, tuple) else _loaded(world)
        self._advance = advance or (lambda: mujoco.mj_step(self.model, self.data))
        self.model.opt.timestep = STEP_S
        if self.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
            self.model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
        numbers = [self._joint(joint.name) for joint in joints]
        self._qpos = np.array([self.model.jnt_qposadr[one] for one in numbers], dtype=np.intp)
        self._dof = np.array([self.model.jnt_dofadr[one] for one in numbers], dtype=np.intp)
        self._counts = np.array([joint.counts_per_rad for joint in joints], dtype=np.float64)
        self._zero = np.array([joint.zero_counts for joint in joints], dtype=np.float64)
        self._gear = self._counts * RAD_PER_PULSE  # radians of the shaft per radian of the joint
        self._model_damping: NDArray[np.float64] = self.model.dof_damping.copy()
        for name, angle in (posture or {}).items():
            self.data.qpos[self.model.jnt_qposadr[self._joint(name)]] = angle
        self._set_coupled_joints()
        mujoco.mj_forward(self.model, self.data)

    def shafts(self) -> list[tuple[float, float]]:
        """Position, pulses, and velocity, pulses per second, of each shaft."""
        positions = self._zero + self._counts * self.data.qpos[self._qpos]
        return list(zip(positions.tolist(), (self._counts * self.data.qvel[self._dof]).tolist(), strict=True))

    def step(self, efforts: Sequence[Effort], blocked: Sequence[bool]) -> None:
        """Advances one millisecond with these efforts; blocked shafts do not move.

        Raises:
            RuntimeError: The simulation became unstable; the message names MuJoCo's warning.
        """
        self.data.qfrc_applied[self._dof] = 0.0
        self.model.dof_damping[self._dof] = self._model_damping[self._dof]  # others may be those of other servos
        for dof, gear, effort, is_blocked in zip(self._dof, self._gear, efforts, blocked, strict=True):
            self.data.qfrc_applied[dof] += gear * effort.torque
            self.model.dof_damping[dof] += gear * gear * effort.damping + (BLOCKED_DAMPING if is_blocked else 0.0)
        self._advance()
        if self.data.warning.number.any():
            kinds = [mujoco.mjtWarning(number).name for number in np.flatnonzero(self.data.warning.number)]
            raise RuntimeError(
                f"the emulated servos' world broke at {self.data.time:.3f} s: {', '.join(kinds)}; "
                "check masses, inertias and damping of its joints"
            )

    def angles(self, names: Sequence[str]) -> list[float]:
        """Positions of these joints, rad or m."""
        return [float(self.data.qpos[self.model.jnt_qposadr[self._joint(name)]]) for name in names]

    def _set_coupled_joints(self) -> None:
        """Sets the initial position of joints that are coupled to others, such as the fingers of a gripper."""
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
            raise EmulatorError(f"the world has no hinge or slide {name!r} for a servo; {suggestion(name, known)}")
        return number


def _loaded(path: Path) -> tuple[mujoco.MjModel, mujoco.MjData]:
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        missing = not Path(path).is_file()
        raise EmulatorError(f"{path} is not a model that MuJoCo can load: {error}", missing=missing) from error
    return model, mujoco.MjData(model)
