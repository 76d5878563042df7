"""A servo arm of `robot_description/` in its scene, behind an emulated serial port for the arm's driver."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Self

import mujoco
import numpy as np

from dynamixel_emulator import (
    CURRENT_BASED_POSITION_MODE,
    ControlSocket,
    DrivenJoint,
    DynamixelEmulator,
    EmulatedServo,
    EmulatorError,
    FaultCommands,
    MujocoMechanics,
    WireFaults,
)
from paramove.documents import Floats, InputError
from paramove.msgs.truth_pb2 import TruthState
from paramove.robots import RobotDescription

NS_PER_STEP = 1_000_000


class EmulatedArm:
    """Context manager for an emulated arm.

    Args:
        robot: A robot with servos in its joints; the motor names are servo models.
        scene: World of the arm: MJCF, the name of a file next to the arm's own model, or a model with its state.
        link: Path of the port; missing folders are created.
        control: Path of the control socket for `FaultCommands`; None: no socket.
        posture_deg: Initial joint positions by name, degrees; other joints start in the base pose.
        seed: Seed of communication faults.
        held: Whether torque is on at the start, as left by an earlier program; otherwise the arm falls at once.
        servo_rules_only: Whether the checker reports only packets that the servos themselves reject.
        paced: Whether time stands still until the emulator's `run_to`.
        advance: Advances a given world by a step.
        prefix: Of the names of the arm's joints and sites in a given world. With one, the truth is in the frame of the
            arm's base, which stands somewhere in the world.
    """

    def __init__(
        self,
        robot: RobotDescription,
        scene: Path | tuple[mujoco.MjModel, mujoco.MjData] = Path("scene.xml"),
        link: Path | None = None,
        control: Path | None = None,
        posture_deg: Mapping[str, float] | None = None,
        seed: int = 0,
        held: bool = False,
        servo_rules_only: bool = False,
        *,
        paced: bool = False,
        advance: Callable[[], None] | None = None,
        prefix: str = "",
    ) -> None:
        self._paced, self._prefix = paced, prefix
        self._joint_names = [prefix + name for name in robot.joint_names]
        pose = dict(zip(self._joint_names, robot.base_pose.tolist(), strict=True))
        for name, degrees in (posture_deg or {}).items():
            pose[self._joint_names[robot.index(name)]] = float(np.deg2rad(degrees))
        units = robot.units
        joints = [
            DrivenJoint(name, counts, zero)
            for name, counts, zero in zip(
                self._joint_names, units.counts_per_rad.tolist(), units.zero_counts.tolist(), strict=True
            )
        ]
        self.robot = robot
        self._servos = emulated_servos(robot)
        with _as_input_errors():
            world = robot.model_path.parent / scene if isinstance(scene, Path) else scene
            self.mechanics = MujocoMechanics(world, joints, pose, advance)
        self._joints = dict(zip(robot.servo_ids, joints, strict=True))
        self._objects = _free_bodies(self.mechanics.model)
        self._link, self._control, self._seed, self._held = link, control, seed, held
        self._servo_rules_only = servo_rules_only
        self._open = contextlib.ExitStack()

    def __enter__(self) -> Self:
        with contextlib.ExitStack() as opened, _as_input_errors():
            if self._link is not None:
                self._link.parent.mkdir(parents=True, exist_ok=True)
            emulator = DynamixelEmulator(
                self._servos, self._link, self.mechanics, self._servo_rules_only, paced=self._paced
            )
            self.emulator = opened.enter_context(emulator)
            self.emulator.faults = WireFaults(seed=self._seed)
            with self.emulator.lock:
                for servo in self._servos if self._held else ():
                    servo.hold()
            if self._control is not None:
                names = dict(zip(self.robot.joint_names, self.robot.servo_ids, strict=True))
                opened.enter_context(ControlSocket(self._control, FaultCommands(self.emulator, names, self._joints).do))
            self._open = opened.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self._open.close()

    def run_to(self, steps: int) -> None:
        """Lets a paced world run on to `steps` since the start, where no driver did; raises RuntimeError."""
        self.emulator.check()
        with self.emulator.lock:
            self.emulator.run_to(steps * NS_PER_STEP)

    @property
    def detail(self) -> str:
        """One-line status: robot, port and the checker's counts."""
        port = self._link or self.emulator.port
        location = f"at {port}" if self.emulator.plugged_in else f"unplugged from {port}"
        checker = self.emulator.bus.checker
        findings = ", ".join(f"{count} {kind}" for kind, count in sorted(checker.counts.items())) or "no findings"
        return f"{self.robot.name} {location}; {checker.packets} packets, {findings}"

    def truth(self, now_ns: int) -> TruthState:
        """True state of the world: joints in the order of the description, the end effector, and free objects."""
        with self.emulator.lock:
            return self.truth_in_still_world(now_ns)

    def truth_in_still_world(self, now_ns: int) -> TruthState:
        """The same, for a caller that keeps the world still meanwhile."""
        data = self.mechanics.data
        message = TruthState(time_ns=now_ns, joint_positions=self.mechanics.angles(self._joint_names))
        origin, turn = self._frame()
        position, quaternion = np.empty(3), np.empty(4)
        if self.robot.chain is not None:
            end_effector = data.site(self._prefix + self.robot.chain.sites.end_effector)
            mujoco.mju_trnVecPose(position, origin, turn, end_effector.xpos)
            message.gripper.extend(position.tolist())
        for name in self._objects:
            body = data.body(name)
            mujoco.mju_trnVecPose(position, origin, turn, body.xpos)
            mujoco.mju_mulQuat(quaternion, turn, body.xquat)
            x, y, z = position.tolist()
            message.objects.add(name=name, x=x, y=y, z=z, quaternion_xyzw=quaternion[[1, 2, 3, 0]].tolist())
        return message

    def _frame(self) -> tuple[Floats, Floats]:
        """Origin [3], m, and quaternion [4] (w, x, y, z) of the world in the frame of the truth."""
        origin, turn = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        if self._prefix:
            assert self.robot.chain is not None
            base = self.mechanics.data.site(self._prefix + self.robot.chain.sites.base)
            base_turn = np.empty(4)
            mujoco.mju_mat2Quat(base_turn, base.xmat)
            mujoco.mju_negPose(origin, turn, base.xpos, base_turn)
        return origin, turn


@contextlib.contextmanager
def _as_input_errors() -> Iterator[None]:
    """Converts errors of the emulator, a separate package, to those of paramove."""
    try:
        yield
    except EmulatorError as error:
        raise InputError(str(error), missing=error.missing) from error


def emulated_servos(robot: RobotDescription) -> list[EmulatedServo]:
    """Servos as configured by `paramove arm setup`, in the order of the joints, in the base pose.

    Raises:
        InputError: The robot is not a servo arm.
    """
    if robot.bus is None or len(robot.servo_ids) != robot.n_joints:
        raise InputError(f"{robot.name} is not a servo arm: its robot.yaml has no bus, or joints without servo_id")
    rows = zip(robot.motors, robot.servo_ids, robot.units.to_counts(robot.base_pose), strict=True)
    servos = [EmulatedServo(motor, number, robot.bus.baud_rate, float(count)) for motor, number, count in rows]
    for servo in servos:
        servo.preset("Return Delay Time", 0)
    if robot.chain is not None and robot.chain.grip_current_ma is not None:
        servos[robot.chain.gripper_index].preset("Operating Mode", CURRENT_BASED_POSITION_MODE)
    return servos


def _free_bodies(model: mujoco.MjModel) -> list[str]:
    free = [joint for joint in range(model.njnt) if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE]
    return [str(model.body(model.jnt_bodyid[joint]).name) for joint in free]
