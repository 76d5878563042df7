"""Robot descriptions: `robot_description/<name>/robot.yaml`, checked, in SI units and radians.

The file speaks of degrees because the manuals do; everything that leaves this module is in radians.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from paramove.robots.arm_kinematics import ArmKinematics
from paramove.robots.joint_units import JointUnits

FloatArray = NDArray[np.float64]


class DescriptionError(ValueError):
    """A robot description that cannot be used; the message names the file and what was found."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Joint(_Part):
    name: str
    motor: str
    lower_deg: float
    upper_deg: float
    counts_per_deg: float
    zero_counts: int
    base_deg: float


class _Motor(_Part):
    loop: Literal["velocity", "servo"]
    torque_average: float = Field(gt=0)
    torque_peak: float = Field(gt=0)
    velocity_deg_s: float = Field(gt=0)
    margin_deg: float = Field(ge=0)
    operating_velocity_deg_s: float = Field(gt=0)
    operating_acceleration_deg_s2: float = Field(gt=0)
    stop_acceleration_deg_s2: float = Field(gt=0)
    jerk_deg_s3: float = Field(gt=0)


class FirmwareParameters(_Part):
    """Numbers of the loop on the robot; see `paramove.robots.hoap3.firmware`."""

    period_us: int = Field(gt=0)
    kpp: float
    kpv: float
    saturation_counts_per_ms: float
    torque_per_pwm_step: float
    servo_kp: float
    servo_kv: float


class StreamParameters(_Part):
    """How targets are streamed to the robot."""

    period_us: int = Field(gt=0)
    cover_ms: int = Field(gt=0)
    guard_ms: int = Field(gt=0)
    start_tolerance_deg: float = Field(gt=0)


class _Fingers(_Part):
    joint: str
    open_deg: float
    closed_deg: float


class ArmSites(_Part):
    """Names of an arm's sites in the model file."""

    shoulder: str
    elbow: str
    gripper: str
    fingertip: str


class _Arm(_Part):
    joints: tuple[str, str, str, str, str]
    fingers: _Fingers
    sites: ArmSites
    upper_arm: float
    gripper_from_elbow: tuple[float, float, float]
    fingertip_from_elbow: tuple[float, float, float]


class _File(_Part):
    name: str
    model: str
    joints: tuple[_Joint, ...]
    motors: dict[str, _Motor]
    firmware: FirmwareParameters
    stream: StreamParameters
    arms: dict[str, _Arm]


@dataclass(frozen=True, eq=False)
class Arm:
    """One arm of a robot.

    Attributes:
        joints: Shoulder pitch, roll, torsion, elbow, wrist.
        indices: Their places in the robot's joint vector.
        fingers: Name of the joint that closes the hand; `fingers_index` its place.
        fingers_open, fingers_closed: Angles of the open (xi = 1) and the closed hand (xi = 0), rad.
        kinematics: Forward kinematics in the frame of the shoulder site.
    """

    joints: tuple[str, ...]
    indices: NDArray[np.intp]
    fingers: str
    fingers_index: int
    fingers_open: float
    fingers_closed: float
    sites: ArmSites
    kinematics: ArmKinematics

    def fingers_angle(self, xi: float) -> float:
        """Angle of the finger joint for the opening `xi` in 0 (closed) to 1 (open), rad."""
        if not 0.0 <= xi <= 1.0:
            raise ValueError(f"opening of the hand {xi!r} is outside 0 (closed) to 1 (open)")
        return self.fingers_closed + xi * (self.fingers_open - self.fingers_closed)


@dataclass(frozen=True, eq=False)
class RobotDescription:
    """A robot's joints, limits, units and arms. Joint vectors are in the order of `joint_names`.

    All arrays have shape [J]; angles in rad. `lower`, `upper` are the mechanical range, `soft_lower`, `soft_upper` what
    commands keep to. `velocity` is the motor's limit; `operating_*` are our limits for planned movement.
    """

    name: str
    model_path: Path
    joint_names: tuple[str, ...]
    motors: tuple[str, ...]
    velocity_loop: NDArray[np.bool_]
    lower: FloatArray
    upper: FloatArray
    soft_lower: FloatArray
    soft_upper: FloatArray
    velocity: FloatArray
    operating_velocity: FloatArray
    operating_acceleration: FloatArray
    stop_acceleration: FloatArray
    jerk: FloatArray
    torque_average: FloatArray
    torque_peak: FloatArray
    base_pose: FloatArray
    units: JointUnits
    firmware: FirmwareParameters
    stream: StreamParameters
    arms: dict[str, Arm]

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @cached_property
    def _places(self) -> dict[str, int]:
        return {name: place for place, name in enumerate(self.joint_names)}

    def index(self, joint: str) -> int:
        """Place of a joint in the joint vector.

        Raises:
            DescriptionError: No such joint; names the nearest one.
        """
        place = self._places.get(joint)
        if place is None:
            near = difflib.get_close_matches(joint, self.joint_names, n=1)
            hint = f"; nearest is {near[0]!r}" if near else ""
            raise DescriptionError(f"{self.name} has no joint {joint!r}{hint}")
        return place

    def indices(self, joints: Iterable[str]) -> NDArray[np.intp]:
        """Places of several joints, ready to index a joint vector."""
        return np.array([self.index(joint) for joint in joints], dtype=np.intp)

    @classmethod
    def load(cls, path: str | Path) -> RobotDescription:
        """Read and check a `robot.yaml`, or the one in the folder `path`.

        Raises:
            DescriptionError: The file is missing, is not YAML, has unknown or wrong fields, or contradicts itself.
        """
        path = Path(path)
        if path.is_dir():
            path = path / "robot.yaml"
        try:
            raw = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
            file = _File.model_validate(raw)
        except FileNotFoundError:
            raise DescriptionError(f"no robot description at {path}") from None
        except (YAMLError, ValidationError) as error:
            raise DescriptionError(f"{path}: {error}") from error
        _check(path, file)
        return _assemble(path, file)


def _check(path: Path, file: _File) -> None:
    names = [joint.name for joint in file.joints]
    if len(set(names)) != len(names):
        twice = sorted({name for name in names if names.count(name) > 1})
        raise DescriptionError(f"{path}: joints named twice: {', '.join(twice)}")
    for joint in file.joints:
        if joint.motor not in file.motors:
            raise DescriptionError(
                f"{path}: joint {joint.name} has motor {joint.motor!r}; known motors are {', '.join(file.motors)}"
            )
        if not joint.lower_deg <= joint.base_deg <= joint.upper_deg:
            raise DescriptionError(
                f"{path}: joint {joint.name}: base pose {joint.base_deg} deg is outside "
                f"{joint.lower_deg} to {joint.upper_deg} deg"
            )
    for side, arm in file.arms.items():
        unknown = [name for name in (*arm.joints, arm.fingers.joint) if name not in names]
        if unknown:
            raise DescriptionError(f"{path}: arm {side!r} names unknown joints: {', '.join(unknown)}")


def _assemble(path: Path, file: _File) -> RobotDescription:
    joints = file.joints
    motors = [file.motors[joint.motor] for joint in joints]
    names = tuple(joint.name for joint in joints)
    lower = _radians(joint.lower_deg for joint in joints)
    upper = _radians(joint.upper_deg for joint in joints)
    margin = _radians(motor.margin_deg for motor in motors)
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
        soft_lower=_frozen(lower + margin),
        soft_upper=_frozen(upper - margin),
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
    )


def _arm(names: tuple[str, ...], arm: _Arm) -> Arm:
    return Arm(
        joints=arm.joints,
        indices=np.array([names.index(joint) for joint in arm.joints], dtype=np.intp),
        fingers=arm.fingers.joint,
        fingers_index=names.index(arm.fingers.joint),
        fingers_open=float(np.deg2rad(arm.fingers.open_deg)),
        fingers_closed=float(np.deg2rad(arm.fingers.closed_deg)),
        sites=arm.sites,
        kinematics=ArmKinematics(arm.upper_arm, arm.gripper_from_elbow, arm.fingertip_from_elbow),
    )


def _frozen(values: Iterable[float]) -> FloatArray:
    array = np.array(list(values), dtype=np.float64)
    array.flags.writeable = False
    return array


def _radians(degrees: Iterable[float]) -> FloatArray:
    return _frozen(np.deg2rad(list(degrees)))
