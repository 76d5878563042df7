"""What a calibrated arm's servos must be and how they must be set, compared with what they are."""

from __future__ import annotations

from dataclasses import dataclass

from paramove.robots.dynamixel.bus.scan import model_name
from paramove.robots.dynamixel.bus.servo_chain import PingedServo, ServoChain, ServoTimeoutError
from paramove.robots.dynamixel.bus.servo_models import (
    CURRENT_BASED_MODE,
    EXTENDED_MODE,
    POSITION_MODE,
    PULSES_PER_TURN,
    model_named,
)
from paramove.robots.dynamixel.calibration.arm_calibration import ArmCalibration, CalibrationError, JointCalibration
from paramove.robots.dynamixel.calibration.arm_plan import ArmPlan

DESCRIPTION, SERVO = "description", "servo"


@dataclass(frozen=True)
class Difference:
    """Something that is not as the calibration file has it.

    Attributes:
        joint: Name, "" for the arm as a whole.
        what: Register or property.
        expected: In the file. found: Elsewhere, None where there is nothing.
        where: `DESCRIPTION` or `SERVO`.
    """

    joint: str
    what: str
    expected: str | int
    found: str | int | None
    where: str


def settings(joint: JointCalibration) -> dict[str, int]:
    """What its servo must have in registers that are stored without power, and written while torque is off.

    In the other modes than that of one turn a servo ignores its limits.
    """
    within_turn = joint.operating_mode == POSITION_MODE
    return {
        "Return Delay Time": 0,
        "Drive Mode": 0,
        "Operating Mode": joint.operating_mode,
        "Homing Offset": 0,
        "Max Position Limit": joint.max_counts if within_turn else PULSES_PER_TURN - 1,
        "Min Position Limit": joint.min_counts if within_turn else 0,
    }


def read_settings(chain: ServoChain, joint: JointCalibration) -> dict[str, int]:
    """As `settings`, but those that the servo has. Raises ServoError."""
    registers = model_named(joint.model).registers
    return {name: chain.read(joint.id, registers[name]) for name in settings(joint)}


def write_settings(chain: ServoChain, joint: JointCalibration) -> dict[str, tuple[int, int]]:
    """Write what differs, with torque off, and read it back.

    Returns:
        By register, the value before and the value now.

    Raises:
        CalibrationError: The servo is of another model, its torque is on, or a value does not stay.
        ServoError: It does not reply, or rejects a value.
    """
    _pinged(chain, joint)
    registers = model_named(joint.model).registers
    if chain.read(joint.id, registers["Torque Enable"]):
        raise CalibrationError(
            f"servo {joint.id} has torque, and its settings are locked: hold the arm and run `paramove arm reboot "
            f"{joint.id}`"
        )
    before, expected = read_settings(chain, joint), settings(joint)
    changed = {name: (before[name], value) for name, value in expected.items() if before[name] != value}
    for name in changed:
        chain.write(joint.id, registers[name], expected[name])
    after = read_settings(chain, joint)
    for name, value in expected.items():
        if after[name] != value:
            raise CalibrationError(f"servo {joint.id}: {name} was written as {value}, but reads {after[name]}")
    return changed


def compare(chain: ServoChain, calibration: ArmCalibration, plan: ArmPlan | None = None) -> list[Difference]:
    """Everything in which description and servos differ from the file. Reads only. Raises PortLostError."""
    differences = [] if plan is None else _with_description(calibration, plan)
    for name, joint in calibration.joints.items():
        differences += _with_servo(chain, name, joint)
    return differences


def is_same_arm(chain: ServoChain, calibration: ArmCalibration) -> bool:
    """Whether some servo is set as the file has it: none is in an arm of another calibration, or of none.

    Limits of positions are measured, so that arms have others; servos without such limits are asked only where all are.
    Raises ServoError.
    """
    joints = calibration.joints.values()
    measured = [joint for joint in joints if joint.operating_mode == POSITION_MODE] or joints
    for joint in measured:
        pinged = chain.ping(joint.id)
        is_its_model = pinged is not None and pinged.model_number == model_named(joint.model).number
        if is_its_model and read_settings(chain, joint) == settings(joint):
            return True
    return False


def adopted(chain: ServoChain, calibration: ArmCalibration) -> ArmCalibration:
    """The calibration with firmware, operating modes and limits as the servos have them.

    Raises:
        CalibrationError: A servo has a homing offset, is another model, or the numbers would contradict each other.
        ServoError: A servo does not answer.
    """
    joints = {}
    for name, joint in calibration.joints.items():
        pinged, read = _pinged(chain, joint), read_settings(chain, joint)
        if read["Homing Offset"] != 0:
            raise CalibrationError(
                f"joint {name}: servo {joint.id} has Homing Offset {read['Homing Offset']}, and a calibration has "
                "none: `paramove arm verify --write` sets it to 0"
            )
        if read["Operating Mode"] not in (POSITION_MODE, EXTENDED_MODE, CURRENT_BASED_MODE):
            raise CalibrationError(
                f"joint {name}: servo {joint.id} has operating mode {read['Operating Mode']}, not 3 to 5"
            )
        values = {"firmware": pinged.firmware, "operating_mode": read["Operating Mode"]}
        if read["Operating Mode"] == POSITION_MODE:
            values |= {"min_counts": read["Min Position Limit"], "max_counts": read["Max Position Limit"]}
        joints[name] = joint.model_copy(update=values)
    result = calibration.model_copy(update={"joints": joints})
    result.check("with the servos' values")
    return result


def _pinged(chain: ServoChain, joint: JointCalibration) -> PingedServo:
    """The servo of a joint, as it answers. Raises ServoTimeoutError, and CalibrationError for one of another model."""
    pinged = chain.ping(joint.id)
    if pinged is None:
        raise ServoTimeoutError(joint.id, f"servo {joint.id} does not answer; `paramove arm scan` looks for it")
    if pinged.model_number != model_named(joint.model).number:
        raise CalibrationError(
            f"servo {joint.id} is a {_model(pinged)}, expected {joint.model}: nothing was written to it; connect the "
            "right one, or calibrate the arm"
        )
    return pinged


def _model(pinged: PingedServo) -> str | int:
    """Name of its model, or the number of one without a name."""
    return model_name(pinged.model_number) or pinged.model_number


def _with_description(calibration: ArmCalibration, plan: ArmPlan) -> list[Difference]:
    pairs: list[tuple[str, str, str | int, str | int]] = [
        ("", "robot", calibration.robot, plan.robot),
        ("", "baud rate", calibration.bus.baud_rate, plan.baud_rate),
    ]
    planned = {servo.joint: servo for servo in plan.servos}
    for name in dict.fromkeys([*calibration.joints, *planned]):
        joint, servo = calibration.joints.get(name), planned.get(name)
        if joint is None or servo is None:
            pairs.append((name, "joint", "there" if joint else "not there", "there" if servo else "not there"))
            continue
        pairs += [(name, "ID", joint.id, servo.number), (name, "model", joint.model, servo.model)]
    return [Difference(name, what, one, other, DESCRIPTION) for name, what, one, other in pairs if one != other]


def _with_servo(chain: ServoChain, name: str, joint: JointCalibration) -> list[Difference]:
    pinged = chain.ping(joint.id)
    if pinged is None:
        return [Difference(name, "servo", f"ID {joint.id}", None, SERVO)]
    if pinged.model_number != model_named(joint.model).number:
        return [Difference(name, "model", joint.model, _model(pinged), SERVO)]
    actual = read_settings(chain, joint)
    pairs = [(register, value, actual[register]) for register, value in settings(joint).items()]
    pairs.insert(0, ("firmware", joint.firmware, pinged.firmware))
    return [Difference(name, what, one, other, SERVO) for what, one, other in pairs if one != other]
