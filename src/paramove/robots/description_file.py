"""The file `robot.yaml`: its keys, and the checks that it does not contradict itself. Degrees, as in the manuals."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from paramove.documents import InputError, findings, read_document
from paramove.workspace import Workspace

POSITION_MODE_MAXIMUM = 4095


class DescriptionError(InputError):
    """A robot description that cannot be used; the message names the file, what was found and what was expected."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class JointPart(_Part):
    """One joint, degrees. `servo_id` is the address of a joint on a servo bus."""

    name: str
    motor: str
    lower_deg: float
    upper_deg: float
    counts_per_deg: float
    zero_counts: int
    base_deg: float
    servo_id: int | None = Field(default=None, ge=0, le=252)


class MotorPart(_Part):
    """Abilities and limits of a kind of motor. `position_gains`: P, I and D of a servo's own loop, in its units.

    A planned motion that is slower than the least operating limits has more points than a driver takes.
    """

    loop: Literal["velocity", "servo"]
    torque_average: float = Field(gt=0)
    torque_peak: float = Field(gt=0)
    velocity_deg_s: float = Field(gt=0)
    margin_deg: float = Field(ge=0)
    operating_velocity_deg_s: float = Field(ge=1.0)
    operating_acceleration_deg_s2: float = Field(ge=1.0)
    stop_acceleration_deg_s2: float = Field(gt=0)
    jerk_deg_s3: float = Field(ge=1.0)
    position_gains: tuple[int, int, int] | None = None


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
    guard_ms: int = Field(ge=0)
    start_tolerance_deg: float = Field(gt=0)


Opening = Annotated[float, Field(ge=0.0, le=1.0)]
"""ξ: 0 closed, 1 open."""


class FingersPart(_Part):
    """The joint that closes a hand or a gripper.

    `felt_opening`: commanded to close, it holds something if it stops at a wider opening than this. `holding_openings`:
    where it stops on objects; an arm that is found at rest with such an opening, away from its base pose, is taken to
    hold one.
    """

    joint: str
    open_deg: float
    closed_deg: float
    felt_opening: Opening = 0.12
    holding_openings: tuple[Opening, Opening] = (0.05, 0.55)

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        low, high = self.holding_openings
        if low >= high:
            raise ValueError(f"expected holding_openings from a smaller to a larger one, found {low} and {high}")
        return self


class GripperPart(FingersPart):
    """`object_width_m`: smallest and largest object that it can hold and feel, between the opened fingers as it comes
    down. `grip_current_ma`: with which it holds one; None for a servo without such a mode. `fixed_finger_m`: y, in the
    hand, of the inner face of a finger that does not move, from the end effector; None: both fingers move.
    """

    object_width_m: tuple[float, float] = (0.015, 0.025)
    grip_current_ma: float | None = Field(default=None, gt=0)
    fixed_finger_m: float | None = None


class ArmSites(_Part):
    """Names of an arm's sites in the model file."""

    shoulder: str
    elbow: str
    gripper: str
    fingertip: str


class AboveTablePart(_Part):
    """How a movement is begun that people begin above a table, at which they sit.

    Attributes:
        begin_within: x, y, z of where it may begin, frame of the shoulder, m: clear of body and objects.
        via_deg: Angles of the arm's joints on the path from the base pose to there, round the table's edge.
    """

    begin_within: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
    via_deg: tuple[tuple[float, float, float, float, float], ...]


class SurfacePart(_Part):
    """The upper face of what stands before an arm, on which it works; ranges and height, frame of the arm's base, m."""

    x: tuple[float, float]
    y: tuple[float, float]
    z: float


class ArmPart(_Part):
    """One arm; lengths in m."""

    joints: tuple[str, str, str, str, str]
    fingers: FingersPart
    sites: ArmSites
    upper_arm: float
    gripper_from_elbow: tuple[float, float, float]
    fingertip_from_elbow: tuple[float, float, float]
    above_table: AboveTablePart | None = None
    surface: SurfacePart | None = None


class BusParameters(_Part):
    """The servos' bus; they speak Dynamixel Protocol 2.0. `calibrate`: whether zeros differ from arm to arm."""

    baud_rate: int = Field(gt=0)
    calibrate: bool = False


class ChainSites(_Part):
    """Names of a chain's sites in the model file."""

    base: str
    end_effector: str


class ChainLinks(_Part):
    """Lengths in the zero pose, m; see `paramove.robots.planar_arm.PlanarArm`."""

    yaw_axis: tuple[float, float]
    shoulder: tuple[float, float, float]
    upper_arm: tuple[float, float]
    forearm: tuple[float, float]
    hand: tuple[float, float, float]


class ChainPart(_Part):
    """An arm with a yaw, three pitches and perhaps a roll, and a gripper at its end."""

    joints: tuple[str, str, str, str] | tuple[str, str, str, str, str]
    gripper: GripperPart
    sites: ChainSites
    links: ChainLinks


class RobotFile(_Part):
    """All of robot.yaml."""

    name: str
    model: str
    joints: tuple[JointPart, ...]
    motors: dict[str, MotorPart]
    firmware: FirmwareParameters | None = None
    stream: StreamParameters
    arms: dict[str, ArmPart] = {}
    bus: BusParameters | None = None
    chain: ChainPart | None = None


def read_robot_file(path: Path) -> RobotFile:
    """Read and check a `robot.yaml`. Raises DescriptionError with every wrong key, what was found and expected."""
    try:
        known = "" if path.exists() else f", or one of {', '.join(Workspace.here().robots())}"
        remedy = f"name the folder that holds robot.yaml{known}"
        file = RobotFile.model_validate(read_document(path, "robot description", DescriptionError, remedy).data)
    except ValidationError as error:
        raise DescriptionError(f"{path}: {findings(error)}") from error
    _check(path, file)
    return file


def _check(path: Path, file: RobotFile) -> None:
    if not file.joints:
        raise DescriptionError(f"{path}: expected joints, found none")
    names = [joint.name for joint in file.joints]
    if len(set(names)) != len(names):
        twice = sorted({name for name in names if names.count(name) > 1})
        raise DescriptionError(f"{path}: joints named twice: {', '.join(twice)}")
    for joint in file.joints:
        if joint.motor not in file.motors:
            raise DescriptionError(
                f"{path}: joint {joint.name} has motor {joint.motor!r}; known motors are {', '.join(file.motors)}"
            )
        if not joint.lower_deg < joint.upper_deg:
            raise DescriptionError(
                f"{path}: joint {joint.name}: expected lower_deg below upper_deg, found {joint.lower_deg} and "
                f"{joint.upper_deg}"
            )
        if joint.counts_per_deg == 0:
            raise DescriptionError(f"{path}: joint {joint.name}: expected counts_per_deg other than 0")
        margin = file.motors[joint.motor].margin_deg
        if joint.lower_deg + margin > joint.upper_deg - margin:
            raise DescriptionError(
                f"{path}: joint {joint.name}: a margin of {margin} deg at both ends leaves nothing of "
                f"{joint.lower_deg} to {joint.upper_deg} deg"
            )
        if not joint.lower_deg <= joint.base_deg <= joint.upper_deg:
            raise DescriptionError(
                f"{path}: joint {joint.name}: base pose {joint.base_deg} deg is outside "
                f"{joint.lower_deg} to {joint.upper_deg} deg"
            )
    for side, arm in file.arms.items():
        _check_hand(path, f"arm {side!r}", names, arm.joints, arm.fingers)
    _check_servos(path, file)
    if file.chain is not None:
        _check_hand(path, "the chain", names, file.chain.joints, file.chain.gripper)
        _check_gripper(path, file.joints[names.index(file.chain.gripper.joint)], file.chain.gripper)
    if not (path.parent / file.model).is_file():
        raise DescriptionError(f"{path}: the model file {path.parent / file.model} does not exist", missing=True)


def _check_hand(path: Path, what: str, names: list[str], joints: tuple[str, ...], hand: FingersPart) -> None:
    unknown = [name for name in (*joints, hand.joint) if name not in names]
    if unknown:
        raise DescriptionError(f"{path}: {what} names unknown joints: {', '.join(unknown)}")
    if hand.open_deg == hand.closed_deg:
        raise DescriptionError(f"{path}: {what}: expected different angles of the open and the closed {hand.joint}")


def _check_servos(path: Path, file: RobotFile) -> None:
    numbers = [joint.servo_id for joint in file.joints if joint.servo_id is not None]
    if (file.bus is not None) != bool(numbers) or 0 < len(numbers) < len(file.joints):
        raise DescriptionError(
            f"{path}: expected a bus and a servo_id for every joint, or neither, found "
            f"{'a' if file.bus else 'no'} bus and {len(numbers)} of {len(file.joints)} joints with a servo_id"
        )
    if len(set(numbers)) != len(numbers):
        twice = sorted({number for number in numbers if numbers.count(number) > 1})
        raise DescriptionError(f"{path}: servo_id given twice: {', '.join(map(str, twice))}")
    if file.bus is not None:
        _check_models(path, file)
    for joint in file.joints:
        ends = sorted(joint.zero_counts + joint.counts_per_deg * end for end in (joint.lower_deg, joint.upper_deg))
        if joint.servo_id is not None and not (ends[0] >= 0 and ends[1] <= POSITION_MODE_MAXIMUM):
            raise DescriptionError(
                f"{path}: joint {joint.name}: expected a range within 0 to {POSITION_MODE_MAXIMUM} counts, what a "
                f"servo's position mode takes, found {ends[0]:.0f} to {ends[1]:.0f}"
            )


def _check_models(path: Path, file: RobotFile) -> None:
    """Of the motors, which are named as the servos' models."""
    from paramove.robots.dynamixel import MODELS  # needs the SDK

    gripper = None if file.chain is None else file.chain.gripper
    current = None if gripper is None else gripper.grip_current_ma
    for joint in file.joints:
        if joint.motor not in MODELS:
            raise DescriptionError(
                f"{path}: joint {joint.name} has motor {joint.motor!r}, a servo whose registers are not known here; "
                f"known are {', '.join(MODELS)}, and none of them stands in for another"
            )
        is_gripper = gripper is not None and gripper.joint == joint.name
        if is_gripper and current is not None and MODELS[joint.motor].current_unit is None:
            known = [name for name, model in MODELS.items() if model.current_unit is not None]
            raise DescriptionError(
                f"{path}: the chain's gripper has grip_current_ma, but {joint.motor}, the motor of {joint.name}, "
                f"controls no current; leave it out, or use one of {', '.join(known)}"
            )


def _check_gripper(path: Path, joint: JointPart, gripper: GripperPart) -> None:
    for angle in (gripper.open_deg, gripper.closed_deg):
        if not joint.lower_deg <= angle <= joint.upper_deg:
            raise DescriptionError(
                f"{path}: the chain's gripper: {angle} deg is outside {joint.lower_deg} to {joint.upper_deg} deg of "
                f"joint {joint.name}"
            )
