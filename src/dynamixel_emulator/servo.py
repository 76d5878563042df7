"""One Dynamixel servo: executes instructions and replies."""

from __future__ import annotations

from dataclasses import dataclass

from dynamixel_emulator.body import REVERSE, ServoBody
from dynamixel_emulator.loops import VELOCITY_UNIT
from dynamixel_emulator.memory import GOALS, POSITION_MODE, RejectedError
from dynamixel_emulator.models import BAUD_RATES, PULSES_PER_TURN, RAM_START, ServoModel, model_named
from dynamixel_emulator.packets import ALERT, Instruction, StatusError

REBOOT_S = 0.3
"""Time of a reboot, during which a servo receives nothing; assumed."""
CLEAR_MULTI_TURN = bytes([0x01, 0x44, 0x58, 0x4C, 0x22])
STORE, RESTORE = bytes([0x01, 0x43, 0x54, 0x52, 0x4C]), bytes([0x02, 0x43, 0x54, 0x52, 0x4C])
STARTS_WITH_TORQUE, STARTS_WITH_BACKUP = 0x01, 0x02
"""Bits of Startup Configuration (60)."""
RATE_MARGIN = 0.03
"""Tolerated relative error of a baud rate (e-Manual, "Baud Rate")."""
RESET_ALL, KEEP_ID, KEEP_ID_AND_BAUD = 0xFF, 0x01, 0x02
PRESERVED = {RESET_ALL: (), KEEP_ID: ("ID",), KEEP_ID_AND_BAUD: ("ID", "Baud Rate")}
TORQUE_ON_BY_GOAL = 0x08
"""Bit of Drive Mode (10)."""


@dataclass(frozen=True)
class Reply:
    """Error byte, alert bit included, and data of a status packet."""

    error: int
    data: bytes = b""


class EmulatedServo(ServoBody):
    """A servo on a bus.

    Args:
        model: Name of one of `MODELS`, or a custom model.
        number: Its ID.
        baud_rate: Its baud rate, bit/s.
        position: Initial position, pulses.
    """

    def __init__(
        self, model: str | ServoModel, number: int = 1, baud_rate: int = 57600, position: float = 2048.0
    ) -> None:
        super().__init__(model_named(model) if isinstance(model, str) else model, position)
        self.memory["ID"], self.memory["Baud Rate"] = number, BAUD_RATES.index(baud_rate)
        self._registered: tuple[int, bytes] | None = None

    @property
    def id(self) -> int:
        """Its ID on the bus."""
        return self.memory["ID"]

    @property
    def baud_rate(self) -> int:
        """Its baud rate, bit/s."""
        return BAUD_RATES[self.memory["Baud Rate"]]

    def listens_at(self, baud_rate: int) -> bool:
        """Whether it can receive packets at this rate, bit/s."""
        return abs(baud_rate - self.baud_rate) < RATE_MARGIN * self.baud_rate

    @property
    def return_delay_s(self) -> float:
        """Delay between an instruction and the reply."""
        return 2e-6 * self.memory["Return Delay Time"]

    def replies_to(self, instruction: int) -> bool:
        """Whether Status Return Level (68) allows a reply to this instruction; always true for a ping."""
        reads = {Instruction.READ, Instruction.SYNC_READ, Instruction.BULK_READ}
        reads |= {Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ}
        level = 0 if instruction == Instruction.PING else 1 if instruction in reads else 2
        return self.memory["Status Return Level"] >= level

    def do(self, instruction: int, parameters: bytes = b"") -> Reply:
        """Executes an instruction to this servo."""
        alert = ALERT if self.memory["Hardware Error Status"] else 0  # also in the last reply before a reboot
        try:
            return Reply(alert, self._executed(instruction, parameters))
        except RejectedError as rejected:
            return Reply(alert | rejected.error)

    def _executed(self, instruction: int, parameters: bytes) -> bytes:
        if instruction == Instruction.PING:
            return self.memory["Model Number"].to_bytes(2, "little") + bytes([self.memory["Firmware Version"]])
        if instruction == Instruction.READ:
            if len(parameters) != 4:
                raise RejectedError(StatusError.INSTRUCTION)
            return self.memory.read(_word(parameters), _word(parameters[2:]))
        if instruction in (Instruction.WRITE, Instruction.REG_WRITE):
            if len(parameters) < 3:
                raise RejectedError(StatusError.INSTRUCTION)
            address, data = _word(parameters), parameters[2:]
            self.memory.check(address, data)
            if instruction == Instruction.WRITE:
                self._write(address, data)
            else:
                self._registered = (address, data)
                self.memory["Registered Instruction"] = 1
        elif instruction == Instruction.ACTION:
            if self._registered is None:
                raise RejectedError(StatusError.INSTRUCTION)
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
        elif instruction == Instruction.BACKUP:
            self._back_up(parameters)
        else:
            raise RejectedError(StatusError.INSTRUCTION)
        return b""

    def _write(self, address: int, data: bytes) -> None:
        before = {name: self.memory[name] for name in ("Torque Enable", "Operating Mode", "Bus Watchdog", "Drive Mode")}
        if self.is_shut_down and any(
            register.name == "Torque Enable" and value for register, value in self.memory.check(address, data)
        ):
            raise RejectedError(StatusError.RESULT_FAIL)  # assumed: the manual does not specify the error number
        written = self.memory.write(address, data)
        memory = self.memory
        if (memory["Drive Mode"] ^ before["Drive Mode"]) & REVERSE:
            self.position, self.velocity = -self.position, -self.velocity
            self._reset_position()
        if memory["Operating Mode"] != before["Operating Mode"]:
            memory.reset_gains()
            self._reset_position()
        goal = GOALS[memory["Operating Mode"]]
        if goal in written and memory["Drive Mode"] & TORQUE_ON_BY_GOAL and not self.is_shut_down:
            memory["Torque Enable"] = 1
        if memory["Torque Enable"] > before["Torque Enable"]:
            if memory["Operating Mode"] == POSITION_MODE:
                self.position %= PULSES_PER_TURN
            self.loops.reset(self.position)
        if memory["Bus Watchdog"] != before["Bus Watchdog"]:
            self._received_s = self._now_s
        if goal in written or "Torque Enable" in written:
            self.loops.plan()

    def reboot(self) -> None:
        """Restarts as after power-on: RAM is reset, the goal is the present position within one turn, torque is off.

        Startup Configuration (60) can switch torque on, and restore gains and profile from the backup.
        """
        startup = self.memory["Startup Configuration"]
        self.memory.reset(RAM_START)
        if startup & STARTS_WITH_BACKUP:
            self.memory.restore_ram()
        self._registered, self._overloaded_s, self.torque = None, 0.0, 0.0
        self._booted_s, self._rebooting_until_s = self._now_s, self._now_s + REBOOT_S
        self._reset_position()
        self.memory["Torque Enable"] = startup & STARTS_WITH_TORQUE
        self.loops.plan()

    def _factory_reset(self, parameters: bytes) -> None:
        if len(parameters) != 1 or parameters[0] not in PRESERVED:
            raise RejectedError(StatusError.DATA_RANGE)
        preserved = {name: self.memory[name] for name in PRESERVED[parameters[0]]}
        self.memory.reset(0)
        for name, value in preserved.items():
            self.memory[name] = value
        self.reboot()

    def _back_up(self, parameters: bytes) -> None:
        if parameters not in (STORE, RESTORE):
            raise RejectedError(StatusError.DATA_RANGE)
        if self.memory["Torque Enable"]:
            raise RejectedError(StatusError.RESULT_FAIL)
        if parameters == STORE:
            self.memory.back_up()
        elif self.memory.restore_eeprom():
            self.reboot()
        else:
            raise RejectedError(StatusError.RESULT_FAIL)

    def _clear(self, parameters: bytes) -> None:
        if parameters != CLEAR_MULTI_TURN:
            raise RejectedError(StatusError.DATA_RANGE)
        if round(self.velocity / VELOCITY_UNIT) != 0:
            raise RejectedError(StatusError.RESULT_FAIL)
        self._reset_position()


def _word(data: bytes) -> int:
    return int.from_bytes(data[:2], "little")
