"""Checks every byte that a program sends to emulated servos: packet format, and whether the content is safe and valid.

Independent of the packet encoder and of the servos, so that an error there is not repeated here. Servos reject most of
the findings, but not all: they follow any goal within their limits, as fast as they can.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from dynamixel_emulator.memory import POSITION_MODE
from dynamixel_emulator.models import PULSES_PER_TURN, within
from dynamixel_emulator.servo import EmulatedServo

HEADER = b"\xff\xff\xfd"
BROADCAST = 0xFE
WRITES = {0x03, 0x04}
SYNC_WRITE, BULK_WRITE = 0x83, 0x93
KNOWN = {0x01, 0x02, *WRITES, 0x05, 0x06, 0x08, 0x10, 0x20, 0x82, SYNC_WRITE, 0x8A, 0x92, BULK_WRITE, 0x9A}
RATE_WINDOW_S = 0.1
"""Maximum time since the last goal that counts for the allowed size of the next step."""
ROUNDING = 2.0
"""Tolerance of the allowed step, pulses."""
NEAR = 20.0
"""Maximum distance from the goal when torque is switched on, pulses."""
MAX_FINDINGS = 1000
MAX_BYTES = 1024
PULSES_PER_MINUTE_TO_SECOND = 4096 / 60
LOCKED_BELOW = 64


@dataclass(frozen=True)
class Finding:
    """An error of the client.

    Attributes:
        time_s: Time of receipt, s.
        id: The addressed servo; -1 without one.
        kind: One of noise, incomplete, length, checksum, stuffing, instruction, register, eeprom, range, limit, step,
            torque, watchdog or shut_down.
        detail: Message: the received data and what is valid.
    """

    time_s: float
    id: int
    kind: str
    detail: str


@dataclass(frozen=True)
class _LastGoal:
    goal: float
    time_s: float


class ProtocolChecker:
    """Checks all bytes that a bus of servos receives.

    Args:
        servos: Servos whose state determines what is valid; later changes of the list take effect.
        max_speeds: Maximum speed of a stream of goals by servo id, pulses per second; otherwise the no-load speed.
        servo_rules_only: Whether to report only packets that the servos themselves reject or cannot read. An arm's
            driver must also avoid jumping goals, which are common in other programs.

    Attributes:
        findings: The first thousand findings, in order of receipt.
        counts: Number of findings by kind.
        packets: Number of valid packets.
    """

    def __init__(
        self,
        servos: Sequence[EmulatedServo],
        max_speeds: Mapping[int, float] | None = None,
        servo_rules_only: bool = False,
    ) -> None:
        self.servos, self.servo_rules_only = servos, servo_rules_only
        self.max_speeds = dict(max_speeds or {})
        self.findings: list[Finding] = []
        self.counts: Counter[str] = Counter()
        self.packets = 0
        self._bytes = bytearray()
        self._last_goals: dict[int, _LastGoal] = {}
        self._now_s = 0.0

    def pieces(self, data: bytes, now_s: float) -> Iterator[bytes]:
        """Splits the data after each packet; each packet is checked before it is yielded for execution."""
        self._now_s = now_s
        buffered = len(self._bytes)
        self._bytes += data
        yielded = complete = 0
        for size in self._packets():
            complete += size
            end = max(yielded, complete - buffered)
            yield data[yielded:end]
            yielded = end
        yield data[yielded:]

    def discard_incomplete(self, now_s: float) -> None:
        """Reports and discards an incomplete packet whose rest did not arrive in time."""
        self._now_s = now_s
        if self._bytes:
            self._report(
                "incomplete", f"{_hex(self._bytes)} without the rest of the packet: a packet is sent without a pause"
            )
            self._bytes.clear()

    # -- framing ----------------------------------------------------------------------------------------------------

    def _packets(self) -> Iterator[int]:
        """Checks and removes complete packets and noise; yields the number of bytes removed each time."""
        while self._bytes:
            start = self._bytes.find(HEADER)
            if start != 0:
                n_partial = next((n for n in (2, 1) if self._bytes.endswith(HEADER[:n])), 0)
                noise = start if start > 0 else len(self._bytes) - n_partial
                if noise == 0:
                    return
                self._report("noise", f"{_hex(self._bytes[:noise])} before a header FF FF FD 00")
                yield self._remove(noise)
                continue
            if len(self._bytes) < 7:
                return
            size = 7 + int.from_bytes(self._bytes[5:7], "little")
            if size < 10 or size > 7 + MAX_BYTES or self._bytes[3] != 0:
                self._report(
                    "length",
                    f"{_hex(self._bytes[:7])} starts no packet: valid are 00, an ID and a length of 3 to {MAX_BYTES}",
                )
                yield self._remove(3)
                continue
            if len(self._bytes) < size:
                return
            self._check(bytes(self._bytes[:size]))
            yield self._remove(size)

    def _remove(self, size: int) -> int:
        del self._bytes[:size]
        return size

    def _check(self, packet: bytes) -> None:
        """Checks one packet."""
        number, content = packet[4], packet[7:-2]
        if _crc(packet[:-2]) != packet[-2] + 256 * packet[-1]:
            self._report(
                "checksum", f"{_hex(packet)} should end with {_hex(_crc(packet[:-2]).to_bytes(2, 'little'))}", number
            )
            return
        self.packets += 1
        stuffed = HEADER + b"\xfd"
        if HEADER in content.replace(stuffed, b""):
            self._report("stuffing", f"{_hex(packet)} contains FF FF FD without a stuffed FD after it", number)
        plain = content.replace(stuffed, HEADER)
        self._check_instruction(number, plain[0], plain[1:])

    # -- content ----------------------------------------------------------------------------------------------------

    def _check_instruction(self, number: int, instruction: int, parameters: bytes) -> None:
        if instruction not in KNOWN:
            self._report("instruction", f"unknown instruction {instruction:#04x}", number)
        elif instruction in WRITES and len(parameters) < 3:
            self._report("instruction", f"write of {_hex(parameters)} has no data after its address", number)
        elif instruction in WRITES:
            self._check_write(number, _word(parameters), parameters[2:])
        elif instruction == SYNC_WRITE:
            size = _word(parameters[2:]) + 1
            if len(parameters) < 4 + size or size == 1 or (len(parameters) - 4) % size:
                self._report(
                    "instruction", f"sync write of {_hex(parameters)} does not have parts of equal length", number
                )
                return
            for at in range(4, len(parameters), size):
                self._check_write(parameters[at], _word(parameters), parameters[at + 1 : at + size])
        elif instruction == BULK_WRITE:
            at = 0
            while at < len(parameters):
                end = at + 5 + _word(parameters[at + 3 :])
                if end > len(parameters) or end == at + 5:
                    self._report("instruction", f"bulk write of {_hex(parameters)} ends inside a part", number)
                    return
                self._check_write(parameters[at], _word(parameters[at + 1 :]), parameters[at + 5 : end])
                at = end

    def _check_write(self, number: int, address: int, data: bytes) -> None:
        for servo in self.servos:
            if number in (servo.id, BROADCAST) and servo.listens:
                for name, value in self._written_registers(servo, address, data):
                    self._check_register(servo, name, value)

    def _written_registers(self, servo: EmulatedServo, address: int, data: bytes) -> Iterator[tuple[str, int]]:
        """Registers and values that these bytes write; indirect data count for the register that they are mapped to."""
        end = min(block.addresses for block in servo.model.indirect)
        written = {target: byte for i, byte in enumerate(data) if (target := _resolved(servo, address + i)) < end}
        covered = 0
        for one in servo.model.registers.values():
            addresses = range(one.address, one.address + one.size)
            part = bytes(written[at] for at in addresses if at in written)
            covered += len(part)
            if part and len(part) < one.size:
                self._report("register", f"{len(data)} bytes at {address} cover only a part of {one.name}", servo.id)
            elif part and one.allowed is None:
                self._report("register", f"{one.name} is read-only", servo.id)
            elif part:
                yield one.name, int.from_bytes(part, "little", signed=one.signed)
        if covered < len(written):
            self._report("register", f"{len(data)} bytes at {address}: not all of them are in a register", servo.id)

    def _check_register(self, servo: EmulatedServo, name: str, value: int) -> None:
        memory = servo.memory
        if servo.model.registers[name].address < LOCKED_BELOW and memory["Torque Enable"]:
            self._report("eeprom", f"{name} was written while torque is on", servo.id)
        allowed = servo.model.registers[name].allowed
        if allowed is not None and not within(value, allowed):
            self._report("range", f"{name} {value} is outside of {allowed[0]} to {allowed[1]}", servo.id)
        if name == "Torque Enable":
            self._check_torque(servo, value)
        limits = {
            "Goal PWM": "PWM Limit", "Goal Current": "Current Limit", "Goal Velocity": "Velocity Limit",
        }  # fmt: skip
        if name in limits and abs(value) > memory[limits[name]]:
            self._report("limit", f"{name} {value} exceeds {limits[name]} {memory[limits[name]]}", servo.id)
        if name.startswith("Goal") and memory["Bus Watchdog"] == 255:
            self._report(
                "watchdog",
                f"{name} was written after Bus Watchdog had tripped: first write 0 to Bus Watchdog",
                servo.id,
            )
        if name == "Goal Position":
            self._check_goal(servo, value)

    def _check_torque(self, servo: EmulatedServo, value: int) -> None:
        memory = servo.memory
        self._last_goals.pop(servo.id, None)
        if not value or memory["Torque Enable"]:
            return
        position = servo.position % PULSES_PER_TURN if memory["Operating Mode"] == POSITION_MODE else servo.position
        distance = memory["Goal Position"] - memory.homing - position
        if not self.servo_rules_only and memory["Operating Mode"] in (3, 4, 5) and abs(distance) > NEAR:
            self._report(
                "torque",
                f"torque was switched on with the goal {distance:.0f} pulses away: first write Present Position to it",
                servo.id,
            )
        error = memory["Hardware Error Status"]
        if servo.is_shut_down or (error and not self.servo_rules_only):
            self._report("shut_down", f"torque was switched on while Hardware Error Status is {error:#04x}", servo.id)

    def _check_goal(self, servo: EmulatedServo, goal: int) -> None:
        memory = servo.memory
        low, high = memory["Min Position Limit"], memory["Max Position Limit"]
        if memory["Operating Mode"] == 3 and not low <= goal <= high:
            self._report("limit", f"Goal Position {goal} is outside of {low} to {high}", servo.id)
        if self.servo_rules_only or not memory["Torque Enable"]:
            return
        present = _LastGoal(servo.position + memory.homing, -RATE_WINDOW_S)
        last = self._last_goals.get(servo.id, present)
        elapsed_s = min(RATE_WINDOW_S, self._now_s - last.time_s)
        max_speed = self.max_speeds.get(servo.id, servo.model.top_speed * PULSES_PER_MINUTE_TO_SECOND)
        step, allowed = abs(goal - last.goal), max_speed * elapsed_s + ROUNDING
        if step > allowed:
            detail = (
                f"Goal Position goes from {last.goal:.0f} to {goal} within {1e3 * elapsed_s:.0f} ms: "
                f"{max_speed:.0f} pulses/s allow {allowed:.0f} of these {step:.0f}"
            )
            self._report("step", detail, servo.id)
        self._last_goals[servo.id] = _LastGoal(goal, self._now_s)

    def _report(self, kind: str, detail: str, number: int = -1) -> None:
        self.counts[kind] += 1
        if len(self.findings) < MAX_FINDINGS:
            self.findings.append(Finding(self._now_s, number, kind, detail))


def _word(data: bytes) -> int:
    return int.from_bytes(data[:2], "little")


def _resolved(servo: EmulatedServo, address: int) -> int:
    """Resolves the address of indirect data to the address that it is mapped to; returns any other unchanged."""
    for block in servo.model.indirect:
        if block.data <= address < block.data + block.count:
            return _word(servo.memory.read(block.addresses + 2 * (address - block.data), 2))
    return address


def _crc(data: bytes) -> int:
    """CRC-16 with polynomial x^16 + x^15 + x^2 + 1, initial value 0, bit by bit."""
    remainder = 0
    for byte in data:
        remainder ^= byte << 8
        for _ in range(8):
            remainder = remainder << 1 ^ (0x18005 if remainder & 0x8000 else 0)
    return remainder


def _hex(data: bytes | bytearray) -> str:
    text = bytes(data[:24]).hex(" ").upper()
    return f"{text} ... ({len(data)} bytes)" if len(data) > 24 else text
