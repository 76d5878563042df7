"""One Dynamixel servo: answers to instructions, moves, and switches itself off when something is wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntFlag

from paramove.input_error import InputError
from paramove.robots.dynamixel.emulated_loops import ACCELERATION_UNIT, STEP_S, VELOCITY_UNIT, Loops
from paramove.robots.dynamixel.emulated_motor import LIMP, RAD_PER_PULSE, Effort, Motor
from paramove.robots.dynamixel.packets import ALERT, Instruction, StatusError
from paramove.robots.dynamixel.servo_memory import (
    CURRENT_MODE,
    GOALS,
    PWM_MODE,
    TRIPPED,
    RefusedError,
    ServoMemory,
)
from paramove.robots.dynamixel.servo_models import BAUD_RATES, PULSES_PER_TURN, RAM_BEGINS, ServoModel

__all__ = ["ACCELERATION_UNIT", "STEP_S", "VELOCITY_UNIT", "Answer", "EmulatedServo", "HardwareError"]

WATCHDOG_UNIT_S = 0.020
REBOOT_S = 0.3
"""So long a servo that reboots hears nothing; assumed."""
CLEAR_MULTI_TURN = bytes([0x01, 0x44, 0x58, 0x4C, 0x22])
RESET_ALL, KEEP_ID, KEEP_ID_AND_BAUD = 0xFF, 0x01, 0x02
KEPT = {RESET_ALL: (), KEEP_ID: ("ID",), KEEP_ID_AND_BAUD: ("ID", "Baud Rate")}
REVERSE, TORQUE_ON_BY_GOAL = 0x01, 0x08
"""Bits of Drive Mode (10)."""
OVERLOAD_SHARE, OVERLOAD_S = 0.7, 2.0
"""A servo is overloaded with this part of the stall torque for so long: assumed, the manual says "persistent load"."""


class HardwareError(IntFlag):
    """Bits of Hardware Error Status (70) and of Shutdown (63) (e-Manual, "Shutdown")."""

    VOLTAGE = 0x01
    OVERHEATING = 0x04
    ENCODER = 0x08
    SHOCK = 0x10
    OVERLOAD = 0x20


@dataclass(frozen=True)
class Answer:
    """Error, alert included, and data of a status packet."""

    error: int
    data: bytes = b""


class EmulatedServo:
    """A servo. By itself it carries nothing and follows its course exactly; a bus with mechanics moves it by torques.

    Args:
        model: Its kind.
        number: Its ID.
        baud_rate: At which it listens, bit/s.
        position: In which it stands, pulses.

    Attributes:
        model, memory: Its kind, and its control table.
        position, velocity: Pulses, without the homing offset, and pulses per second, as Drive Mode turns them.
        voltage: V that it gets.
        torque: N m at the shaft in the last step, in its own direction.
        blocked: Whether something holds its shaft.
        powered: Whether its cable is plugged in.
    """

    def __init__(self, model: ServoModel, number: int = 1, baud_rate: int = 57600, position: float = 2048.0) -> None:
        self.model = model
        self.memory = ServoMemory(model)
        self.memory["ID"], self.memory["Baud Rate"] = number, BAUD_RATES.index(baud_rate)
        self.position, self.velocity = position, 0.0
        self.motor = Motor(model)
        self.loops = Loops(self.memory, self.motor)
        self.voltage, self.torque = model.voltage, 0.0
        self.blocked, self.powered = False, True
        self._shaft = position
        self._overloaded_s = 0.0
        self._registered: tuple[int, bytes] | None = None
        self._now_s = self._heard_s = 0.0
        self._deaf_until_s = -math.inf
        self._effort = LIMP
        self._settle()

    @property
    def id(self) -> int:
        """On the bus."""
        return self.memory["ID"]

    @property
    def baud_rate(self) -> int:
        """At which it listens, bit/s."""
        return BAUD_RATES[self.memory["Baud Rate"]]

    @property
    def return_delay_s(self) -> float:
        """Between an instruction and the answer."""
        return 2e-6 * self.memory["Return Delay Time"]

    @property
    def listens(self) -> bool:
        """Whether it hears anything: not while it reboots or has no power."""
        return self.powered and self._now_s >= self._deaf_until_s

    @property
    def temperature(self) -> float:
        """Degrees Celsius that it measures."""
        return self.motor.temperature

    @temperature.setter
    def temperature(self, value: float) -> None:
        self.motor.temperature = value

    @property
    def has_torque(self) -> bool:
        """Whether its motor does anything."""
        return bool(self.powered and self.memory["Torque Enable"])

    @property
    def is_shut_down(self) -> bool:
        """Whether an error that Shutdown (63) names has switched torque off, until a reboot."""
        return bool(self.memory["Hardware Error Status"] & self.memory["Shutdown"])

    def answers(self, instruction: int) -> bool:
        """Whether Status Return Level (68) lets it answer; to a ping it always does."""
        reads = {Instruction.READ, Instruction.SYNC_READ, Instruction.BULK_READ}
        reads |= {Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ}
        needed = 0 if instruction == Instruction.PING else 1 if instruction in reads else 2
        return self.memory["Status Return Level"] >= needed

    def hear(self, now_s: float) -> None:
        """A packet is on the bus, for whomever; the servo has moved until then."""
        self._heard_s = now_s

    def do(self, instruction: int, parameters: bytes = b"") -> Answer:
        """Follow an instruction for this servo alone."""
        try:
            data = self._done(instruction, parameters)
            error = StatusError.NONE
        except RefusedError as refused:
            data, error = b"", refused.error
        return Answer(error | (ALERT if self.memory["Hardware Error Status"] else 0), data)

    def _done(self, instruction: int, parameters: bytes) -> bytes:
        if instruction == Instruction.PING:
            return self.memory["Model Number"].to_bytes(2, "little") + bytes([self.memory["Firmware Version"]])
        if instruction == Instruction.READ:
            if len(parameters) != 4:
                raise RefusedError(StatusError.INSTRUCTION)
            return self.memory.read(_word(parameters), _word(parameters[2:]))
        if instruction in (Instruction.WRITE, Instruction.REG_WRITE):
            if len(parameters) < 3:
                raise RefusedError(StatusError.INSTRUCTION)
            address, data = _word(parameters), parameters[2:]
            self.memory.check(address, data)
            if instruction == Instruction.WRITE:
                self._write(address, data)
            else:
                self._registered = (address, data)
                self.memory["Registered Instruction"] = 1
        elif instruction == Instruction.ACTION:
            if self._registered is None:
                raise RefusedError(StatusError.INSTRUCTION)
            address, data = self._registered
            self._registered, self.memory["Registered Instruction"] = None, 0
            self.memory.check(address, data)
            self._write(address, data)
        elif instruction == Instruction.REBOOT:
            self.reboot()
        elif instruction == Instruction.FACTORY_RESET:
            self._factory_reset(parameters)
        elif instruction == Instruction.CLEAR:
            self._clear(parameters)
        else:
            raise RefusedError(StatusError.INSTRUCTION)
        return b""

    def _write(self, address: int, data: bytes) -> None:
        before = {name: self.memory[name] for name in ("Torque Enable", "Operating Mode", "Bus Watchdog", "Drive Mode")}
        if self.is_shut_down and any(
            register.name == "Torque Enable" and value for register, value in self.memory.check(address, data)
        ):
            raise RefusedError(StatusError.RESULT_FAIL)  # which number it is, the manual does not tell
        written = self.memory.write(address, data)
        memory = self.memory
        if (memory["Drive Mode"] ^ before["Drive Mode"]) & REVERSE:
            self.position, self.velocity = -self.position, -self.velocity
            self._settle()
        if memory["Operating Mode"] != before["Operating Mode"]:
            self._settle()
        goal = GOALS[memory["Operating Mode"]]
        if goal in written and memory["Drive Mode"] & TORQUE_ON_BY_GOAL and not self.is_shut_down:
            memory["Torque Enable"] = 1
        if memory["Torque Enable"] > before["Torque Enable"]:
            self.loops.begin(self.position)
        if memory["Bus Watchdog"] != before["Bus Watchdog"]:
            self._heard_s = self._now_s
        if goal in written or "Torque Enable" in written:
            self.loops.plan()

    def reboot(self) -> None:
        """RAM is as after switching on: torque off, goals where the servo stands, within one turn."""
        self.memory.reset(RAM_BEGINS)
        self._registered, self._overloaded_s, self.torque = None, 0.0, 0.0
        self._deaf_until_s = self._now_s + REBOOT_S
        self._settle()

    def fail(self, error: HardwareError) -> None:
        """The servo notices this error: it tells of it until a reboot, and goes limp if Shutdown (63) names it."""
        self.memory["Hardware Error Status"] |= int(error)
        if self.is_shut_down:
            self.memory["Torque Enable"] = 0

    def preset(self, name: str, value: int) -> None:
        """Its table holds this value as if it had before power came on; the servo stands anew, within one turn.

        Raises:
            InputError: There is no such register, or the value does not fit into it.
        """
        register = self.memory.register(name)
        bits = 8 * register.size - int(register.signed)
        if not (-(1 << bits) if register.signed else 0) <= value < 1 << bits:
            raise InputError(f"{name} has {register.size} bytes, which cannot hold {value}")
        before = self._direction
        self.memory[name] = value
        self.position *= before * self._direction
        self._settle()

    def hold(self) -> None:
        """Torque is on although nobody asked for it, and the goal is where the servo stands."""
        self.loops.begin(self.position)
        self.memory["Goal Position"] = round(self.position) + self.memory["Homing Offset"]
        self.memory["Torque Enable"] = 1

    def _factory_reset(self, parameters: bytes) -> None:
        if len(parameters) != 1 or parameters[0] not in KEPT:
            raise RefusedError(StatusError.DATA_RANGE)
        kept = {name: self.memory[name] for name in KEPT[parameters[0]]}
        self.memory.reset(0)
        for name, value in kept.items():
            self.memory[name] = value
        self.reboot()

    def _clear(self, parameters: bytes) -> None:
        if parameters != CLEAR_MULTI_TURN:
            raise RefusedError(StatusError.DATA_RANGE)
        if round(self.velocity / VELOCITY_UNIT) != 0:
            raise RefusedError(StatusError.RESULT_FAIL)
        self._settle()

    def _settle(self) -> None:
        """Presents the position within one turn, as after switching on, and makes it the goal."""
        memory = self.memory
        self.position %= PULSES_PER_TURN
        self.loops.begin(self.position)
        self._present()
        memory["Goal Position"] = memory["Present Position"]
        memory["Goal PWM"] = 0 if memory["Operating Mode"] == PWM_MODE else memory["PWM Limit"]
        if "Goal Current" in memory:
            memory["Goal Current"] = 0 if memory["Operating Mode"] == CURRENT_MODE else memory["Current Limit"]

    def begin(self, now_s: float) -> None:
        """It is this time, s: nothing happened before."""
        self._now_s = self._heard_s = now_s

    def run_to(self, now_s: float) -> None:
        """Move until this time, s, carrying nothing; an earlier one than the last is passed over."""
        while self._now_s + STEP_S <= now_s:
            self._tick()
            course = self.loops.course
            if self.blocked:
                course.begin(self.position)
            else:
                self.loops.unloaded()
            if self.memory["Bus Watchdog"] == TRIPPED and course.velocity:
                self._hold()
            self.position, self.velocity = course.position, course.velocity
        self.present()

    def effort(self) -> Effort:
        """Begins a step: what the servo does at its shaft, in the direction of the encoder; `moved` ends it."""
        self._tick()
        if not self.has_torque or not self.listens:
            self.loops.begin(self.position, self.velocity)
            self.loops.pwm, self._effort = 0.0, LIMP
        else:
            self._effort = self.loops.effort(self.position, self.velocity, self.voltage)
        return Effort(self._direction * self._effort.torque, self._effort.damping)

    def moved(self, shaft: float, velocity: float) -> None:
        """Its shaft is there, pulses from the zero of the encoder, and turns so fast, pulses per second."""
        self.position += self._direction * (shaft - self._shaft)
        self.velocity, self._shaft = self._direction * velocity, shaft
        self.torque = self._effort.at(self.velocity * RAD_PER_PULSE)
        self.motor.warm(self.torque, STEP_S)
        loaded = abs(self.torque) > OVERLOAD_SHARE * self.model.stall_torque
        self._overloaded_s = max(0.0, self._overloaded_s + (STEP_S if loaded else -STEP_S))

    def stand(self, shaft: float) -> None:
        """Before any movement: the shaft is there, pulses from the zero of the encoder."""
        self._shaft, self.position = shaft, self._direction * shaft
        self._settle()

    @property
    def _direction(self) -> int:
        return -1 if self.memory["Drive Mode"] & REVERSE else 1

    def _tick(self) -> None:
        """The time goes on; the servo looks after itself and after whom it obeys."""
        self._now_s += STEP_S
        if not self.powered:
            return
        memory = self.memory
        allowed = memory["Bus Watchdog"]
        silent_s = self._now_s - self._heard_s
        if 0 < allowed < TRIPPED and memory["Torque Enable"] and silent_s > allowed * WATCHDOG_UNIT_S:
            memory["Bus Watchdog"] = TRIPPED
            self.loops.begin(self.position, self.velocity)
            self._hold()
        if not memory["Min Voltage Limit"] <= round(10.0 * self.voltage) <= memory["Max Voltage Limit"]:
            self.fail(HardwareError.VOLTAGE)
        if self.temperature > memory["Temperature Limit"]:
            self.fail(HardwareError.OVERHEATING)
        if self._overloaded_s > OVERLOAD_S:
            self.fail(HardwareError.OVERLOAD)

    def _hold(self) -> None:
        """The bus watchdog has tripped: the goal is where the servo is, so that clearing it moves nothing; assumed."""
        self.memory["Goal Position"] = round(self.position) + self.memory["Homing Offset"]
        self.memory["Goal Velocity"] = 0

    def present(self) -> None:
        """Writes what it measures to its table."""
        self.memory["Realtime Tick"] = int(self._now_s * 1000.0) % 32768
        self._present()

    def _present(self) -> None:
        memory, model, course = self.memory, self.model, self.loops.course
        memory["Present Position"] = round(self.position) + memory["Homing Offset"]
        memory["Present Velocity"] = round(self.velocity / VELOCITY_UNIT)
        memory["Position Trajectory"] = round(course.position) + memory["Homing Offset"]
        memory["Velocity Trajectory"] = round(course.velocity / VELOCITY_UNIT)
        memory["Moving"] = int(abs(self.velocity) > memory["Moving Threshold"] * VELOCITY_UNIT)
        memory["Present PWM"] = round(self.loops.pwm)
        if model.current_unit is None:
            memory["Present Load"] = round(1000.0 * self.torque / model.stall_torque)
        else:
            memory["Present Current"] = round(self.motor.amperes(self.torque) / model.current_unit)
        memory["Present Input Voltage"] = max(0, round(10.0 * self.voltage))
        memory["Present Temperature"] = round(self.temperature)


def _word(data: bytes) -> int:
    return int.from_bytes(data[:2], "little")
