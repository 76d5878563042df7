"""Calibrates an arm together with the person who moves it: requests, measurements and writes, step by step.

Joints are moved by hand, with Homing Offset (20) at 0; positions are unwrapped, and the encoder's seam is located.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from paramove.robots.dynamixel.bus.position_watch import POSITION, PositionWatch
from paramove.robots.dynamixel.bus.scan import DetectedServo, looked_at
from paramove.robots.dynamixel.bus.servo_chain import ServoChain
from paramove.robots.dynamixel.bus.servo_models import (
    CURRENT_BASED_MODE,
    EXTENDED_MODE,
    POSITION_MODE,
    PULSES_PER_TURN,
    difference,
    model_named,
)
from paramove.robots.dynamixel.calibration.arm_calibration import (
    COUNTS_PER_RAD,
    LONGEST_TRAVEL,
    SEAM_MARGIN,
    ArmCalibration,
    CalibratedBus,
    CalibrationError,
    JointCalibration,
)
from paramove.robots.dynamixel.calibration.arm_plan import ArmPlan, PlannedServo
from paramove.robots.dynamixel.calibration.servo_settings import write_settings

ATTEMPTS = 3
LARGEST_STEP = PULSES_PER_TURN // 4
"""Between two readings; with half a turn the direction would be ambiguous."""
SMALLEST_TRAVEL = 57
"""Counts, 5 degrees: less is a joint that was not moved."""
SMALLEST_MOVE = 34
"""Counts, 3 degrees, that show a direction."""
TRAVEL_TOLERANCE = float(np.deg2rad(3.0))
"""By which the demonstrated travel may fall short of the described range without a remark."""
MIN_FRACTION = 0.5
"""Of the described range that must lie in the travel: less, and posture or direction were not as described."""


@dataclass(frozen=True)
class Travel:
    """Counts between which a joint was moved; `lowest` is within the encoder's turn, `highest` may be beyond it."""

    lowest: int
    highest: int

    @property
    def has_seam(self) -> bool:
        """Whether the encoder's seam lies in it or too near."""
        return self.lowest < SEAM_MARGIN or self.highest >= PULSES_PER_TURN - SEAM_MARGIN


class JointSweep:
    """Follows a joint that a person moves through its travel.

    Attributes:
        joint: Name.
        lowest, present, highest: Unwrapped counts so far.
    """

    def __init__(self, joint: str, position: int) -> None:
        self.joint = joint
        self.lowest = self.present = self.highest = position
        self._widest_step = 0

    def add(self, position: int) -> None:
        """A later position, in whatever turn it is presented."""
        step = difference(position, self.present)
        self._widest_step = max(self._widest_step, abs(step))
        self.present += step
        self.lowest, self.highest = min(self.lowest, self.present), max(self.highest, self.present)

    def travel(self) -> Travel:
        """The demonstrated travel. Raises CalibrationError if it cannot be used."""
        length = self.highest - self.lowest
        if self._widest_step > LARGEST_STEP:
            raise CalibrationError(
                f"joint {self.joint} moved by {self._widest_step} counts between two readings, at most {LARGEST_STEP} "
                "can be followed: move it more slowly"
            )
        if length < SMALLEST_TRAVEL:
            raise CalibrationError(
                f"joint {self.joint} was moved by {length} counts, at least {SMALLEST_TRAVEL} are expected: move it "
                "from one end to the other"
            )
        if length > LONGEST_TRAVEL:
            raise CalibrationError(
                f"joint {self.joint} was moved by {length} counts, but after power was off its encoder distinguishes "
                f"only {LONGEST_TRAVEL} of the {PULSES_PER_TURN} of a turn: turn it by at most "
                f"{LONGEST_TRAVEL * 360 // PULSES_PER_TURN} deg"
            )
        lowest = self.lowest % PULSES_PER_TURN
        return Travel(lowest, lowest + length)


class Person(Protocol):
    """Who moves the arm."""

    def tell(self, message: str) -> None:
        """Show a message that needs no answer."""

    def until_done(self, request: str, look: Callable[[], list[str]]) -> None:
        """Show a request, and the lines of `look` again and again, until the person confirms that it is done."""


class ArmCalibrator:
    """One calibration. `run` guides the person, measures, writes the servos' settings and returns what to save.

    Args:
        chain: At the arm's baud rate.
        plan: Of the arm.
        serial: USB serial number of the adapter.
        person: Who moves the arm.
    """

    def __init__(self, chain: ServoChain, plan: ArmPlan, serial: str, person: Person) -> None:
        self._chain, self._plan, self._serial, self._person = chain, plan, serial, person
        self._watch = PositionWatch({servo.number: model_named(servo.model) for servo in plan.servos})

    def run(self, created: str, tool: str) -> ArmCalibration:
        """Raises CalibrationError, ServoError and PortLostError; settings are written at the very end."""
        servos = self._detected()
        self._person.until_done("Hold the arm, it becomes limp.", list)
        self._release()
        travels = {sweep.joint: sweep.travel() for sweep in self._sweep()}
        held = self._held()
        joints = {}
        for servo in self._plan.servos:
            step = self._direction(servo)
            joints[servo.joint] = calibrated_joint(
                servos[servo.joint], servo, travels[servo.joint], held[servo.number], step
            )
        for servo in self._plan.servos:
            for remark in remarks(joints[servo.joint], servo):
                self._person.tell(remark)
        self._person.until_done("Move the arm and compare the angles with the real ones.", lambda: self._angles(joints))
        for joint in joints.values():
            write_settings(self._chain, joint)
        bus = CalibratedBus(serial=self._serial, baud_rate=self._plan.baud_rate)
        return ArmCalibration(created=created, tool=tool, robot=self._plan.robot, bus=bus, joints=joints)

    def _detected(self) -> dict[str, DetectedServo]:
        """The servos by joint. Raises CalibrationError with all that are missing or of another model."""
        detected, wrong = {}, []
        for servo in self._plan.servos:
            pinged = self._chain.ping(servo.number)
            if pinged is None:
                wrong.append(f"{servo.joint}: expected {servo.model} with ID {servo.number}, none answers")
                continue
            detected[servo.joint] = looked_at(self._chain, pinged)
            if detected[servo.joint].model != servo.model:
                name = detected[servo.joint].name
                wrong.append(f"{servo.joint}: expected {servo.model} with ID {servo.number}, found {name}")
        if wrong:
            raise CalibrationError(
                f"at {self._plan.baud_rate}: {'; '.join(wrong)}; `paramove arm scan` lists the servos, `paramove arm "
                "setup` gives IDs and baud rate"
            )
        return detected

    def _release(self) -> None:
        for servo in self._plan.servos:
            registers = model_named(servo.model).registers
            self._chain.write(servo.number, registers["Torque Enable"], 0)
            for name in ("Drive Mode", "Homing Offset"):
                if self._chain.read(servo.number, registers[name]):
                    self._chain.write(servo.number, registers[name], 0)

    def _positions(self) -> dict[int, int]:
        """Of all servos; without those whose reply is missing, or has a position that cannot be true."""
        answers = self._watch.read(self._chain)
        while self._watch.jump is not None:  # a true position can be after a while, however fast the joint was moved
            self._watch.jump = None
            answers |= self._watch.read(self._chain)
        self._watch.missing(answers)  # it gives up after a while
        return {number: answer.values[POSITION] for number, answer in answers.items()}

    def _all_positions(self) -> dict[int, int]:
        positions = self._positions()
        while len(positions) < len(self._plan.servos):
            positions |= self._positions()
        return positions

    def _sweep(self) -> list[JointSweep]:
        first = self._all_positions()
        sweeps = {servo.number: JointSweep(servo.joint, first[servo.number]) for servo in self._plan.servos}

        def look() -> list[str]:
            for number, position in self._positions().items():
                sweeps[number].add(position)
            return [f"{one.joint}: {one.lowest} to {one.highest}, now {one.present}" for one in sweeps.values()]

        hint = "".join(
            f" Turn {servo.joint}, which has no ends, by less than {LONGEST_TRAVEL * 360 // PULSES_PER_TURN} deg."
            for servo in self._plan.servos
            if (servo.upper - servo.lower) * COUNTS_PER_RAD > LONGEST_TRAVEL
        )
        self._person.until_done(f"Move every joint slowly from one end of its travel to the other.{hint}", look)
        look()
        return list(sweeps.values())

    def _held(self) -> dict[int, int]:
        posture = ", ".join(f"{servo.joint} 0 deg" for servo in self._plan.servos)
        self._person.until_done(
            f"Hold the arm in its posture for calibration, which its description shows: {posture}.",
            self._position_lines,
        )
        return self._all_positions()

    def _position_lines(self) -> list[str]:
        positions = self._positions()
        return [f"{servo.joint}: {positions.get(servo.number, 'no data')}" for servo in self._plan.servos]

    def _direction(self, servo: PlannedServo) -> int:
        """Counts by which the person moves the joint in the direction of a growing angle."""
        start = self._all_positions()[servo.number]
        sweep = JointSweep(servo.joint, start)

        def look() -> list[str]:
            positions = self._positions()
            if servo.number in positions:
                sweep.add(positions[servo.number])
            return [f"{servo.joint}: moved by {sweep.present - start} counts"]

        for _ in range(ATTEMPTS):
            self._person.until_done(f"Move {servo.joint} by 10 deg or more so that {servo.direction}.", look)
            sweep.add(self._all_positions()[servo.number])
            moved = sweep.present - start
            if abs(moved) >= SMALLEST_MOVE:
                break
            self._person.tell(f"{servo.joint} is back at its start: leave it where you have moved it.")
        return moved if servo.grows else -moved

    def _angles(self, joints: dict[str, JointCalibration]) -> list[str]:
        positions = self._positions()
        return [
            f"{name}: {np.rad2deg(joint.angle(positions[joint.id])):.1f} deg"
            for name, joint in joints.items()
            if joint.id in positions
        ]


def calibrated_joint(
    servo: DetectedServo, planned: PlannedServo, travel: Travel, held: int, step: int
) -> JointCalibration:
    """A joint's calibration from the person's movements.

    Args:
        servo: As it was detected.
        planned: As the arm's description has it.
        travel: From a sweep.
        held: Position in the posture for calibration.
        step: Counts by which the joint was then moved in the direction of a growing angle.

    Raises:
        CalibrationError: It was not moved, or range, posture and direction do not fit the description.
    """
    if abs(step) < SMALLEST_MOVE:
        raise CalibrationError(
            f"joint {planned.joint} was moved by {abs(step)} counts, at least {SMALLEST_MOVE} show a direction: move "
            "it further"
        )
    mode: Literal[3, 4, 5] = POSITION_MODE
    if planned.grips:
        mode = CURRENT_BASED_MODE
    elif travel.has_seam:
        mode = EXTENDED_MODE
    joint = JointCalibration(
        id=servo.number,
        model=servo.model,
        firmware=servo.firmware,
        sign=1 if step > 0 else -1,
        operating_mode=mode,
        homing_offset=0,
        zero_counts=0,
        min_counts=travel.lowest,
        max_counts=travel.highest,
    )
    counts = joint.counts(held)
    if not travel.lowest - SEAM_MARGIN <= counts <= travel.highest + SEAM_MARGIN:
        raise CalibrationError(
            f"joint {planned.joint}: the posture is at {counts} counts, outside of the demonstrated travel of "
            f"{travel.lowest} to {travel.highest}: calibrate again, and move the joint to both of its ends"
        )
    joint = joint.model_copy(update={"zero_counts": counts})
    low, high = joint.travel
    if min(high, planned.upper) - max(low, planned.lower) < MIN_FRACTION * (planned.upper - planned.lower):
        raise CalibrationError(
            f"joint {planned.joint} would reach from {_degrees(low, high)}, its description has "
            f"{_degrees(planned.lower, planned.upper)}: the posture was not the described one, the joint was moved in "
            "the opposite direction, or not to both of its ends; calibrate again"
        )
    return joint


def remarks(joint: JointCalibration, planned: PlannedServo) -> list[str]:
    """Remarks on a joint's calibration for a person, if any."""
    messages = []
    low, high = joint.travel
    if low > planned.lower + TRAVEL_TOLERANCE or high < planned.upper - TRAVEL_TOLERANCE:
        messages.append(
            f"joint {planned.joint} was moved from {_degrees(low, high)} of {_degrees(planned.lower, planned.upper)}: "
            "it will stay within that"
        )
    if joint.sign != planned.sign:
        messages.append(
            f"joint {planned.joint} counts in the opposite direction to the description: its servo is mounted mirrored"
        )
    if joint.operating_mode == EXTENDED_MODE:
        messages.append(
            f"joint {planned.joint} crosses the seam of its encoder: it works in the extended mode, in which the servo "
            "itself has no limits"
        )
    return messages


def _degrees(low: float, high: float) -> str:
    return f"{np.rad2deg(low):.0f} to {np.rad2deg(high):.0f} deg"
