"""Robot descriptions: `robot_description/<name>/robot.yaml`, checked, in SI units and radians.

The file speaks of degrees because the manuals do; everything that leaves this module is in radians.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator

from paramove.documents import Floats, nearest
from paramove.robots.arm_kinematics import ArmKinematics
from paramove.robots.description_file import (
    AboveTablePart,
    ArmPart,
    ArmSites,
    BusParameters,
    ChainPart,
    ChainSites,
    DescriptionError,
    FirmwareParameters,
    RobotFile,
    StreamParameters,
    SurfacePart,
    read_robot_file,
)
from paramove.robots.joint_units import JointUnits
from paramove.robots.planar_arm import PlanarArm
from paramove.safety import MotionLimits
from paramove.workspace import Workspace

__all__ = ["Arm", "Chain", "DescriptionError", "RobotDescription"]


@dataclass(frozen=True, eq=False)
class AboveTable:
    """How an arm begins movements that begin above a table.

    Attributes:
        lowest, highest: Corners of the box in which one may begin, [3], m, frame of the shoulder.
        via: Angles of the arm's joints on the path from the base pose to there, [N, 5], rad.
    """

    lowest: Floats
    highest: Floats
    via: Floats


@dataclass(frozen=True, eq=False)
class Arm:
    """One arm of a robot.

    Attributes:
        joints: Shoulder pitch, roll, torsion, elbow, wrist.
        indices: Their indices in the robot's joint vector.
        fingers: Name of the joint that closes the hand; `fingers_index` its index.
        fingers_open, fingers_closed: Angles of the open (xi = 1) and the closed hand (xi = 0), rad.
        felt_opening, holding_openings: How a held object is detected: see `FingersPart`.
        kinematics: Forward kinematics in the frame of the shoulder site.
        above_table: None: it cannot begin movements above a table.
        surface: None: there is none before it.
    """

    joints: tuple[str, ...]
    indices: NDArray[np.intp]
    fingers: str
    fingers_index: int
    fingers_open: float
    fingers_closed: float
    felt_opening: float
    holding_openings: tuple[float, float]
    sites: ArmSites
    kinematics: ArmKinematics
    above_table: AboveTable | None
    surface: SurfacePart | None


@dataclass(frozen=True, eq=False)
class Chain:
    """A servo arm of yaw, three pitches and perhaps a roll, with a gripper.

    Attributes:
        joints: From the base on, without the gripper.
        indices: Their indices in the robot's joint vector.
        gripper: Name of the joint that closes the gripper; `gripper_index` its index.
        gripper_open, gripper_closed: Its angles, rad.
        felt_opening, holding_openings: How a held object is detected: see `FingersPart`.
        object_width: Of the smallest and the largest object that the gripper can hold and feel, m.
        grip_current_ma: With which it holds one; None: its servo has no such mode.
        fixed_finger: y of the face of a finger that does not move, from the end effector, m; None: both move.
        kinematics: Within the robot's soft limits; in the frame of the base site.
    """

    joints: tuple[str, ...]
    indices: NDArray[np.intp]
    gripper: str
    gripper_index: int
    gripper_open: float
    gripper_closed: float
    felt_opening: float
    holding_openings: tuple[float, float]
    object_width: tuple[float, float]
    grip_current_ma: float | None
    fixed_finger: float | None
    sites: ChainSites
    kinematics: PlanarArm


@dataclass(frozen=True, eq=False)
class RobotDescription:
    """A robot's joints, limits, units and arms. Joint vectors are in the order of `joint_names`.

    All arrays have shape [J]; angles in rad. `lower`, `upper` are the mechanical range, `soft_lower`, `soft_upper` the
    range of commands. `velocity` is the motor's limit; `operating_*` are our limits for planned movement. A robot like
    HOAP-3 has `firmware` and `arms`; one of servos on a bus has `bus`, `servo_ids` and `position_gains` (P, I, D of the
    servo's own loop, in its units) in the order of the joints, and a `chain`. What a robot has not is None or empty.
    """

    name: str
    model_path: Path
    joint_names: tuple[str, ...]
    motors: tuple[str, ...]
    velocity_loop: NDArray[np.bool_]
    lower: Floats
    upper: Floats
    soft_lower: Floats
    soft_upper: Floats
    velocity: Floats
    operating_velocity: Floats
    operating_acceleration: Floats
    stop_acceleration: Floats
    jerk: Floats
    torque_average: Floats
    torque_peak: Floats
    base_pose: Floats
    units: JointUnits
    firmware: FirmwareParameters | None
    stream: StreamParameters
    arms: dict[str, Arm]
    bus: BusParameters | None
    servo_ids: tuple[int, ...]
    position_gains: tuple[tuple[int, int, int] | None, ...]
    chain: Chain | None

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @property
    def motion_limits(self) -> MotionLimits:
        """The soft position range and the operating limits, at the stream's period."""
        return MotionLimits(
            names=self.joint_names,
            lower=self.soft_lower,
            upper=self.soft_upper,
            motor_velocity=self.velocity,
            velocity=self.operating_velocity,
            acceleration=self.operating_acceleration,
            stop_acceleration=self.stop_acceleration,
            jerk=self.jerk,
            dt_s=self.stream.period_us * 1e-6,
        )

    def index(self, joint: str) -> int:
        """Index of a joint in the joint vector.

        Raises:
            DescriptionError: No such joint; names the nearest one.
        """
        if joint not in self.joint_names:
            raise DescriptionError(f"{self.name} has no joint {joint!r}; {nearest(joint, self.joint_names)}")
        return self.joint_names.index(joint)

    def indices(self, joints: Iterable[str]) -> NDArray[np.intp]:
        """Indices of several joints, ready to index a joint vector."""
        return np.array([self.index(joint) for joint in joints], dtype=np.intp)

    @property
    def gripper_indices(self) -> tuple[int, ...]:
        """Indices of the joints that close hands; an object in them keeps them from their commanded position."""
        fingers = tuple(arm.fingers_index for arm in self.arms.values())
        return fingers if self.chain is None else (*fingers, self.chain.gripper_index)

    def arm(self, side: str) -> Arm:
        """One of `arms`.

        Raises:
            DescriptionError: No such arm; names those that there are.
        """
        if side not in self.arms:
            arms = f"the arms {', '.join(self.arms)}" if self.arms else "no arm of five joints like HOAP-3's"
            raise DescriptionError(f"{self.model_path.parent} describes {arms}, found side {side!r}")
        return self.arms[side]

    @classmethod
    def load(cls, path: str | Path) -> RobotDescription:
        """Read and check a `robot.yaml`.

        Args:
            path: The file or its folder, in the workspace or here; or the name of a folder in `robot_description/`.

        Raises:
            DescriptionError: The file is missing, is not YAML, has unknown or wrong fields, or contradicts itself.
        """
        path = Path(path)
        if not path.is_absolute():
            described = Workspace.here().find(path if len(path.parts) > 1 else Path("robot_description", path))
            path = described if described.exists() or not path.exists() else path
        if path.is_dir():
            path = path / "robot.yaml"
        return _assemble(path, read_robot_file(path))


@dataclass(frozen=True)
class _Described:
    """Checks that a path names a description."""

    def __call__(self, path: Path) -> Path:
        try:
            RobotDescription.load(path)
        except DescriptionError as error:
            raise ValueError(str(error)) from error
        return path


RobotFolder = Annotated[Path, AfterValidator(_Described())]
"""Parameter of a node: what `RobotDescription.load` takes, and accepts."""


def _assemble(path: Path, file: RobotFile) -> RobotDescription:
    joints = file.joints
    motors = [file.motors[joint.motor] for joint in joints]
    names = tuple(joint.name for joint in joints)
    lower = _radians(joint.lower_deg for joint in joints)
    upper = _radians(joint.upper_deg for joint in joints)
    margin = _radians(motor.margin_deg for motor in motors)
    soft_lower, soft_upper = _frozen(lower + margin), _frozen(upper - margin)
    units = JointUnits(
        names=names,
        counts_per_rad=_frozen(np.rad2deg([joint.counts_per_deg for joint in joints])),
        zero_counts=_frozen([joint.zero_counts for joint in joints]),
        lower=lower,
        upper=upper,
    )
    return RobotDescription(
        name=file.name,
        model_path=path.parent / file.model,
        joint_names=names,
        motors=tuple(joint.motor for joint in joints),
        velocity_loop=np.array([motor.loop == "velocity" for motor in motors]),
        lower=lower,
        upper=upper,
        soft_lower=soft_lower,
        soft_upper=soft_upper,
        velocity=_radians(motor.velocity_deg_s for motor in motors),
        operating_velocity=_radians(motor.operating_velocity_deg_s for motor in motors),
        operating_acceleration=_radians(motor.operating_acceleration_deg_s2 for motor in motors),
        stop_acceleration=_radians(motor.stop_acceleration_deg_s2 for motor in motors),
        jerk=_radians(motor.jerk_deg_s3 for motor in motors),
        torque_average=_frozen([motor.torque_average for motor in motors]),
        torque_peak=_frozen([motor.torque_peak for motor in motors]),
        base_pose=_radians(joint.base_deg for joint in joints),
        units=units,
        firmware=file.firmware,
        stream=file.stream,
        arms={side: _arm(names, arm) for side, arm in file.arms.items()},
        bus=file.bus,
        servo_ids=tuple(joint.servo_id for joint in joints if joint.servo_id is not None),
        position_gains=tuple(motor.position_gains for motor in motors),
        chain=None if file.chain is None else _chain(names, file.chain, soft_lower, soft_upper),
    )


def _arm(names: tuple[str, ...], arm: ArmPart) -> Arm:
    return Arm(
        joints=arm.joints,
        indices=np.array([names.index(joint) for joint in arm.joints], dtype=np.intp),
        fingers=arm.fingers.joint,
        fingers_index=names.index(arm.fingers.joint),
        fingers_open=float(np.deg2rad(arm.fingers.open_deg)),
        fingers_closed=float(np.deg2rad(arm.fingers.closed_deg)),
        felt_opening=arm.fingers.felt_opening,
        holding_openings=arm.fingers.holding_openings,
        sites=arm.sites,
        kinematics=ArmKinematics(arm.upper_arm, arm.gripper_from_elbow, arm.fingertip_from_elbow),
        above_table=None if arm.above_table is None else _above_table(arm.above_table),
        surface=arm.surface,
    )


def _above_table(part: AboveTablePart) -> AboveTable:
    lowest, highest = (_frozen(ends) for ends in zip(*part.begin_within, strict=True))
    return AboveTable(lowest, highest, _radians(part.via_deg))


def _chain(names: tuple[str, ...], chain: ChainPart, lower: Floats, upper: Floats) -> Chain:
    indices = np.array([names.index(joint) for joint in chain.joints], dtype=np.intp)
    links = chain.links
    return Chain(
        joints=chain.joints,
        indices=indices,
        gripper=chain.gripper.joint,
        gripper_index=names.index(chain.gripper.joint),
        gripper_open=float(np.deg2rad(chain.gripper.open_deg)),
        gripper_closed=float(np.deg2rad(chain.gripper.closed_deg)),
        felt_opening=chain.gripper.felt_opening,
        holding_openings=chain.gripper.holding_openings,
        object_width=chain.gripper.object_width_m,
        grip_current_ma=chain.gripper.grip_current_ma,
        fixed_finger=chain.gripper.fixed_finger_m,
        sites=chain.sites,
        kinematics=PlanarArm(
            names=chain.joints,
            lower=lower[indices],
            upper=upper[indices],
            yaw_axis=links.yaw_axis,
            shoulder=links.shoulder,
            upper_arm=links.upper_arm,
            forearm=links.forearm,
            hand=links.hand,
        ),
    )


def _frozen(values: Iterable[float | tuple[float, ...]]) -> Floats:
    array = np.array(list(values), dtype=np.float64)
    array.flags.writeable = False
    return array


def _radians(degrees: Iterable[float | tuple[float, ...]]) -> Floats:
    return _frozen(np.deg2rad(list(degrees)))
