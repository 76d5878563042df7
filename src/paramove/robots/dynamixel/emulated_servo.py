"""One Dynamixel servo: answers to instructions, and moves."""

from __future__ import annotations

import math
from dataclasses import dataclass

from paramove.robots.dynamixel.packets import ALERT, Instruction, StatusError
from paramove.robots.dynamixel.servo_memory import EXTENDED_MODES, POSITION_MODE, RefusedError, ServoMemory
from paramove.robots.dynamixel.servo_models import BAUD_RATES, PULSES_PER_TURN, RAM_BEGINS, ServoModel

VELOCITY_MODE = 1
VELOCITY_UNIT = 0.229 * PULSES_PER_TURN / 60.0
"""Pulses per second of one unit of velocity, 0.229 rev/min (e-Manual, "Goal Velocity")."""
ACCELERATION_UNIT = 214.577 * PULSES_PER_TURN / 3600.0
"""Pulses per second squared of one unit of acceleration, 214.577 rev/min^2 (e-Manual, "Profile Acceleration")."""
REV_PER_MINUTE = PULSES_PER_TURN / 60.0
UNLOADED_ACCELERATION = 40_000.0
"""Pulses per second squared, of a servo that carries nothing and has no profile; assumed."""
WATCHDOG_UNIT_S = 0.020
TRIPPED = 0xFF
"""Of Bus Watchdog (98), which reads -1."""
REBOOT_S = 0.3
"""So long a servo that reboots hears nothing; assumed."""
STEP_S = 0.001
CLEAR_MULTI_TURN = bytes([0x01, 0x44, 0x58, 0x4C, 0x22])
RESET_ALL, KEEP_ID, KEEP_ID_AND_BAUD = 0xFF, 0x01, 0x02
KEPT = {RESET_ALL: (), KEEP_ID: ("ID",), KEEP_ID_AND_BAUD: ("ID", "Baud Rate")}
ROOM_TEMPERATURE = 30.0


@dataclass(frozen=True)
class Answer:
    """Error, alert included, and data of a status packet."""

    error: int
    data: bytes = b""


class EmulatedServo:
    """A servo that carries nothing.

    Args:
        model: Its kind.
        number: Its ID.
        baud_rate: At which it listens, bit/s.
        position: In which it stands, pulses.

    Attributes:
        model, memory: Its kind, and its control table.
        position, velocity: Pulses, without the homing offset, and pulses per second.
        voltage, temperature: V and degrees Celsius that it measures.
    """

    def __init__(self, model: ServoModel, number: int = 1, baud_rate: int = 57600, position: float = 2048.0) -> None:
        self.model = model
        self.memory = ServoMemory(model)
        self.memory["ID"], self.memory["Baud Rate"] = number, BAUD_RATES.index(baud_rate)
        self.position, self.velocity = position, 0.0
        self.voltage, self.temperature = model.voltage, ROOM_TEMPERATURE
        self._registered: tuple[int, bytes] | None = None
        self._now_s = self._heard_s = 0.0
        self._deaf_until_s = -math.inf
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
        """Whether it hears anything: not while it reboots."""
        return self._now_s >= self._deaf_until_s

    def answers(self, instruction: int) -> bool:
        """Whether Status Return Level (68) lets it answer; to a ping it always does."""
        reads = {Instruction.READ, Instruction.SYNC_READ, Instruction.BULK_READ}
        reads |= {Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ}
        needed = 0 if instruction == Instruction.PING else 1 if instruction in reads else 2
        return self.memory["Status Return Level"] >= needed

    def hear(self, now_s: float) -> None:
        """A packet is on the bus, for whomever."""
        self.run_to(now_s)
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
        before = {name: self.memory[name] for name in ("Torque Enable", "Operating Mode", "Bus Watchdog")}
        self.memory.write(address, data)
        if self.memory["Operating Mode"] != before["Operating Mode"]:
            self._settle()
        if self.memory["Torque Enable"] > before["Torque Enable"]:
            self.velocity = 0.0
        if self.memory["Bus Watchdog"] != before["Bus Watchdog"]:
            self._heard_s = self._now_s

    def reboot(self) -> None:
        """RAM is as after switching on: torque off, goals where the servo stands, within one turn."""
        self.memory.reset(RAM_BEGINS)
        self._registered, self.velocity = None, 0.0
        self._deaf_until_s = self._now_s + REBOOT_S
        self._settle()

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
        if self.velocity != 0.0:
            raise RefusedError(StatusError.RESULT_FAIL)
        self._settle()

    def _settle(self) -> None:
        """Presents the position within one turn, as after switching on, and makes it the goal."""
        self.position %= PULSES_PER_TURN
        self._present()
        self.memory["Goal Position"] = self.memory["Present Position"]
        self.memory["Goal PWM"] = self.memory["PWM Limit"]
        if "Goal Current" in self.memory:
            self.memory["Goal Current"] = self.memory["Current Limit"]

    def run_to(self, now_s: float) -> None:
        """Move until this time, s; an earlier one than the last is passed over."""
        while self._now_s + STEP_S <= now_s:
            self._now_s += STEP_S
            self._watch()
            self._move()
        self.memory["Realtime Tick"] = int(self._now_s * 1000.0) % 32768
        self._present()

    def _watch(self) -> None:
        """Bus Watchdog (98): without a packet for so long, a servo with torque stops, and refuses goals."""
        allowed = self.memory["Bus Watchdog"]
        silent_s = self._now_s - self._heard_s
        if 0 < allowed < TRIPPED and self.memory["Torque Enable"] and silent_s > allowed * WATCHDOG_UNIT_S:
            self.memory["Bus Watchdog"] = TRIPPED

    def _move(self) -> None:
        wanted = self._wanted_velocity()
        most = self.memory["Profile Acceleration"] * ACCELERATION_UNIT or UNLOADED_ACCELERATION
        change = wanted - self.velocity
        self.velocity += math.copysign(min(abs(change), most * STEP_S), change)
        self.position += self.velocity * STEP_S

    def _wanted_velocity(self) -> float:
        """Pulses per second. Without torque a servo that carries nothing stays where it is."""
        memory, top = self.memory, self.model.top_speed * REV_PER_MINUTE
        if not memory["Torque Enable"] or memory["Bus Watchdog"] == TRIPPED:
            return 0.0
        if memory["Operating Mode"] == VELOCITY_MODE:
            return max(-top, min(top, memory["Goal Velocity"] * VELOCITY_UNIT))
        if memory["Operating Mode"] in (POSITION_MODE, *EXTENDED_MODES):
            away = memory["Goal Position"] - memory["Homing Offset"] - self.position
            most = min(top, memory["Profile Velocity"] * VELOCITY_UNIT or top)
            braking = memory["Profile Acceleration"] * ACCELERATION_UNIT or UNLOADED_ACCELERATION
            # The greatest speed from which, after one more step with it, the servo can still brake in time.
            stopping = braking * (math.sqrt(STEP_S**2 + 2.0 * abs(away) / braking) - STEP_S)
            return math.copysign(min(most, stopping), away)
        return 0.0  # current and PWM move what is carried, and this servo carries nothing

    def _present(self) -> None:
        memory = self.memory
        memory["Present Position"] = round(self.position) + memory["Homing Offset"]
        memory["Present Velocity"] = round(self.velocity / VELOCITY_UNIT)
        memory["Moving"] = int(abs(self.velocity) > memory["Moving Threshold"] * VELOCITY_UNIT)
        memory["Present Input Voltage"] = round(10.0 * self.voltage)
        memory["Present Temperature"] = round(self.temperature)


def _word(data: bytes) -> int:
    return int.from_bytes(data[:2], "little")
