"""The control table of one servo: reading, checked writing, and indirect addresses."""

from __future__ import annotations

from collections.abc import Iterable

from dynamixel_emulator.errors import EmulatorError, suggestion
from dynamixel_emulator.models import FIRST_INDIRECT, RAM_START, Register, ServoModel, within
from dynamixel_emulator.packets import StatusError

MULTI_TURN = 1_048_575
"""Maximum absolute goal position in the extended modes, pulses (e-Manual, "Goal Position")."""
CURRENT_MODE, VELOCITY_MODE, POSITION_MODE, EXTENDED_MODES, PWM_MODE = 0, 1, 3, (4, 5), 16
CURRENT_BASED_POSITION_MODE = 5
GOALS = {
    CURRENT_MODE: "Goal Current", VELOCITY_MODE: "Goal Velocity", POSITION_MODE: "Goal Position", 4: "Goal Position",
    5: "Goal Position", PWM_MODE: "Goal PWM",
}  # fmt: skip
"""The goal register of each value of Operating Mode (11)."""
GAINS_AND_PROFILE = (
    "Velocity I Gain", "Velocity P Gain", "Position D Gain", "Position I Gain", "Position P Gain",
    "Feedforward 2nd Gain", "Feedforward 1st Gain", "Profile Acceleration", "Profile Velocity",
)  # fmt: skip
"""Reset when Operating Mode changes; part of a backup (e-Manual, "Operating Mode", "Control Table Backup")."""
MAX_HOMING_OFFSET = 1024
"""In position mode a Homing Offset with a larger absolute value is ignored (e-Manual, "Homing Offset")."""
TRIPPED = 0xFF
"""Value of Bus Watchdog (98) after it has tripped; signed it reads -1."""


class RejectedError(Exception):
    """The servo rejects a request; carries the error number of its reply."""

    def __init__(self, error: StatusError) -> None:
        super().__init__(error.name)
        self.error = error


class ServoMemory:
    """Control table of a servo: values by register name for the servo, bytes by address for the bus."""

    def __init__(self, model: ServoModel) -> None:
        self.model = model
        self._bytes = bytearray(model.size)
        self._values: dict[str, int] = {}  # cached: the servo reads them thousands of times a second
        self._backup: bytes | None = None
        self._register_at = {one.address + i: one for one in model.registers.values() for i in range(one.size)}
        self.reset(0)

    def reset(self, first_address: int) -> None:
        """Resets registers from this address on, and all indirect addresses, to their initial values."""
        for register in self.model.registers.values():
            if register.address >= first_address:
                self[register.name] = register.initial
        self["Firmware Version"] = self.model.firmware
        self["Backup Ready"] = int(self._backup is not None)
        for block in self.model.indirect:
            for i in range(block.count):
                at = block.addresses + 2 * i
                self._bytes[at : at + 2] = (block.data + i).to_bytes(2, "little")
                self._bytes[block.data + i] = 0

    @property
    def homing(self) -> int:
        """Homing Offset in effect in this mode, pulses."""
        offset = self["Homing Offset"]
        return 0 if self["Operating Mode"] == POSITION_MODE and abs(offset) > MAX_HOMING_OFFSET else offset

    def reset_gains(self) -> None:
        """Resets gains and profile to their initial values."""
        for name in GAINS_AND_PROFILE:
            self[name] = self.model.registers[name].initial

    def back_up(self) -> None:
        """Stores the table in non-volatile memory."""
        self["Backup Ready"] = 1
        self._backup = bytes(self._bytes)

    def restore_eeprom(self) -> bool:
        """Restores the EEPROM area from the backup; returns whether there is one."""
        return self._restore(register for register in self.model.registers.values() if register.address < RAM_START)

    def restore_ram(self) -> None:
        """Restores gains, profile and indirect addresses from the backup, if there is one."""
        if self._restore(self.model.registers[name] for name in GAINS_AND_PROFILE) and self._backup is not None:
            for block in self.model.indirect:
                addresses = slice(block.addresses, block.addresses + 2 * block.count)
                self._bytes[addresses] = self._backup[addresses]

    def _restore(self, registers: Iterable[Register]) -> bool:
        if self._backup is None:
            return False
        for register in registers:
            stored = self._backup[register.address : register.address + register.size]
            self[register.name] = int.from_bytes(stored, "little")
        return True

    def register(self, name: str) -> Register:
        """The register of this name. Raises EmulatorError, with a suggestion, if the model has none."""
        if name not in self.model.registers:
            raise EmulatorError(f"{self.model.name} has no register {name!r}; {suggestion(name, self.model.registers)}")
        return self.model.registers[name]

    def __contains__(self, name: str) -> bool:
        return name in self.model.registers

    def __getitem__(self, name: str) -> int:
        return self._values[name]

    def __setitem__(self, name: str, value: int) -> None:
        register = self.model.registers[name]
        data = (value % (1 << 8 * register.size)).to_bytes(register.size, "little")
        self._bytes[register.address : register.address + register.size] = data
        self._values[name] = int.from_bytes(data, "little", signed=register.signed)

    def read(self, address: int, size: int) -> bytes:
        """Bytes at this address. Raises RejectedError beyond the end of the table."""
        if size == 0 or address + size > len(self._bytes):
            raise RejectedError(StatusError.ACCESS)
        if address + size <= FIRST_INDIRECT:
            return bytes(self._bytes[address : address + size])
        return bytes(self._bytes[self._resolved(byte_address)] for byte_address in range(address, address + size))

    def check(self, address: int, data: bytes) -> list[tuple[Register, int]]:
        """The registers that a write would change, and their values. Raises RejectedError if the servo rejects it.

        Indirect data are checked at the address that they are mapped to.
        """
        if not data or address + len(data) > len(self._bytes):
            raise RejectedError(StatusError.ACCESS)
        written: dict[int, int] = {}
        indirect: dict[int, int] = {}
        for byte_address, byte in zip(range(address, address + len(data)), data, strict=True):
            if self._is_indirect_address(byte_address):
                indirect[byte_address] = byte
            else:
                written[self._resolved(byte_address)] = byte
        self._check_indirect(indirect)
        return [self._checked(register, written) for register in self._touched(written)]

    def write(self, address: int, data: bytes) -> set[str]:
        """Writes checked bytes; returns the names of their registers. The servo applies their effect."""
        written: set[str] = set()
        for byte_address, byte in zip(range(address, address + len(data)), data, strict=True):
            target = byte_address if self._is_indirect_address(byte_address) else self._resolved(byte_address)
            self._bytes[target] = byte
            if target in self._register_at:
                written.add(self._register_at[target].name)
        for name in written:
            register = self.model.registers[name]
            stored = self._bytes[register.address : register.address + register.size]
            self._values[name] = int.from_bytes(stored, "little", signed=register.signed)
        return written

    def _check_indirect(self, written: dict[int, int]) -> None:
        """Raises RejectedError unless these are whole two-byte indirect addresses of RAM and torque is off."""
        if written and self["Torque Enable"]:
            raise RejectedError(StatusError.ACCESS)
        for byte_address, byte in written.items():
            if byte_address ^ 1 not in written:
                raise RejectedError(StatusError.DATA_LENGTH)
            if byte_address % 2 == 0 and not RAM_START <= byte + 256 * written[byte_address + 1] < len(self._bytes):
                raise RejectedError(StatusError.DATA_RANGE)

    def _touched(self, written: dict[int, int]) -> list[Register]:
        touched: dict[str, Register] = {}
        for byte_address in written:
            if byte_address >= FIRST_INDIRECT and byte_address not in self._register_at:
                continue  # unmapped indirect data
            register = self._register_at.get(byte_address)
            if register is None or not register.writable:
                raise RejectedError(StatusError.ACCESS)
            if register.address < RAM_START and self["Torque Enable"]:
                raise RejectedError(StatusError.ACCESS)
            touched[register.name] = register
        return list(touched.values())

    def _checked(self, register: Register, written: dict[int, int]) -> tuple[Register, int]:
        addresses = range(register.address, register.address + register.size)
        if any(byte_address not in written for byte_address in addresses):
            raise RejectedError(StatusError.DATA_LENGTH)
        value = int.from_bytes(
            bytes(written[byte_address] for byte_address in addresses), "little", signed=register.signed
        )
        assert register.allowed is not None
        if not within(value, register.allowed):
            raise RejectedError(StatusError.DATA_RANGE)
        if register.name == "Operating Mode" and value not in self.model.modes:
            raise RejectedError(StatusError.DATA_RANGE)
        if register.name == "Bus Watchdog":
            return register, value
        if register.name.startswith("Goal") and self["Bus Watchdog"] == TRIPPED:  # goals are read-only
            raise RejectedError(StatusError.DATA_RANGE)
        if not within(value, self._limits(register.name)):
            raise RejectedError(StatusError.DATA_LIMIT)
        return register, value

    def _limits(self, name: str) -> tuple[int | None, int | None]:
        """Limits of a goal register, from the limit registers."""
        if name == "Goal Position":
            if self["Operating Mode"] in EXTENDED_MODES:
                return -MULTI_TURN, MULTI_TURN
            return self["Min Position Limit"], self["Max Position Limit"]
        limit = {"Goal PWM": "PWM Limit", "Goal Current": "Current Limit", "Goal Velocity": "Velocity Limit"}.get(name)
        return (None, None) if limit is None else (-self[limit], self[limit])

    def _is_indirect_address(self, byte_address: int) -> bool:
        return any(one.addresses <= byte_address < one.addresses + 2 * one.count for one in self.model.indirect)

    def _resolved(self, byte_address: int) -> int:
        """Resolves the address of indirect data to the address that it is mapped to; returns any other unchanged."""
        for block in self.model.indirect:
            if block.data <= byte_address < block.data + block.count:
                at = block.addresses + 2 * (byte_address - block.data)
                resolved = int.from_bytes(self._bytes[at : at + 2], "little")
                return resolved if RAM_START <= resolved < len(self._bytes) else byte_address
        return byte_address
