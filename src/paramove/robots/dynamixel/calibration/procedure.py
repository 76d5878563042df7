"""Calibrates an arm together with the person who moves it: requests, measurements and writes, step by step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from paramove.robots.dynamixel.bus.position_watch import POSITION, PositionWatch
from paramove.robots.dynamixel.bus.scan import DetectedServo, looked_at
from paramove.robots.dynamixel.bus.servo_chain import ServoChain, ServoTimeoutError
from paramove.robots.dynamixel.bus.servo_models import PULSES_PER_TURN, model_named
from paramove.robots.dynamixel.calibration.arm_calibration import (
    COUNTS_PER_RAD,
    LONGEST_TRAVEL,
    ArmCalibration,
    CalibratedBus,
    CalibrationError,
    JointCalibration,
)
from paramove.robots.dynamixel.calibration.arm_plan import ArmPlan, PlannedServo
from paramove.robots.dynamixel.calibration.servo_settings import write_settings
from paramove.robots.dynamixel.calibration.sweep import SMALLEST_MOVE, JointSweep, calibrated_joint, remarks

ATTEMPTS = 3
GIVES_UP = 25
"""Readings in a row without a reply of a servo, half a second or so."""


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
        self._misses = 0

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
        numbers = [servo.number for servo in self._plan.servos]
        answers = self._watch.read(self._chain)
        while self._watch.jump is not None:  # a true position can be after a while, however fast the joint was moved
            self._watch.jump = None
            answers |= self._watch.read(self._chain)
        self._misses = 0 if len(answers) == len(numbers) else self._misses + 1
        if self._misses > GIVES_UP:
            missing = next(number for number in numbers if number not in answers)
            raise ServoTimeoutError(missing, f"servo {missing} no longer answers: check its cable and its power")
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
        posture = ", ".join(f"{servo.joint} {np.rad2deg(servo.posture):.0f} deg" for servo in self._plan.servos)
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
