"""Judges what a program says to emulated servos: every byte, whether it is a packet, and whether it is one to be sent.

Written apart from the packets' own code and from the servos, so that a mistake there is not repeated here. Servos
refuse much of what is found here, but not all: they follow any goal within their limits, as fast as they can.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from dynamixel_emulator.memory import POSITION_MODE
from dynamixel_emulator.models import PULSES_PER_TURN
from dynamixel_emulator.servo import EmulatedServo

HEAD = b"\xff\xff\xfd"
TO_ALL = 0xFE
WRITES = {0x03, 0x04}
SYNC_WRITE, BULK_WRITE = 0x83, 0x93
KNOWN = {0x01, 0x02, *WRITES, 0x05, 0x06, 0x08, 0x10, 0x20, 0x82, SYNC_WRITE, 0x8A, 0x92, BULK_WRITE, 0x9A}
RATE_WINDOW_S = 0.1
"""After a longer silence the next step may not be larger than after this one."""
ROUNDING = 2.0
"""Pulses by which a step may exceed what the rate allows."""
NEAR = 20.0
"""Pulses by which the goal may be away from the servo when torque comes on."""
MAX_FINDINGS = 1000
MAX_BYTES = 1024
PULSES_PER_MINUTE_TO_SECOND = 4096 / 60
LOCKED_BELOW = 64


@dataclass(frozen=True)
class Finding:
    """Something that should not have been sent.

    Attributes:
        time_s: When it came.
        id: Of the servo that is meant; -1 where none is.
        kind: A word: noise, incomplete, length, checksum, stuffing, instruction, register, eeprom, limit, step, torque,
            watchdog or shut_down.
        detail: What was found and what would have been right.
    """

    time_s: float
    id: int
    kind: str
    detail: str


@dataclass(frozen=True)
class _Course:
    goal: float
    time_s: float


class ProtocolChecker:
    """Of all that arrives at some servos.

    Args:
        servos: Whose state decides what may be sent; a list that changes is followed.
        fastest: Pulses per second that a stream of goals may ask of the servo of an id; without, what it can do without
            load.
        servo_rules_only: Whether only that is found which the servos themselves reject or cannot read; an arm's driver
            should also keep goals from jumping, which the programs of others do all the time.

    Attributes:
        findings: The first thousand, in the order in which they came.
        counts: How many of each kind.
        packets: How many were sound.
    """

    def __init__(
        self,
        servos: Sequence[EmulatedServo],
        fastest: Mapping[int, float] | None = None,
        servo_rules_only: bool = False,
    ) -> None:
        self.servos, self.servo_rules_only = servos, servo_rules_only
        self.fastest = dict(fastest or {})
        self.findings: list[Finding] = []
        self.counts: Counter[str] = Counter()
        self.packets = 0
        self._bytes = bytearray()
        self._courses: dict[int, _Course] = {}
        self._now_s = 0.0

    def pieces(self, data: bytes, now_s: float) -> Iterator[bytes]:
        """The data cut after each packet, which is judged before it is handed out and obeyed."""
        self._now_s = now_s
        waiting = len(self._bytes)
        self._bytes += data
        handed = complete = 0
        for size in self._packets():
            complete += size
            end = max(handed, complete - waiting)
            yield data[handed:end]
            handed = end
        yield data[handed:]

    def give_up(self, now_s: float) -> None:
        """The rest of a packet did not come in time."""
        self._now_s = now_s
        if self._bytes:
            self._find("incomplete", f"{_hex(self._bytes)} and nothing more: a packet goes out in one piece")
            self._bytes.clear()

    # -- framing ----------------------------------------------------------------------------------------------------

    def _packets(self) -> Iterator[int]:
        """Judges what is complete and drops it; tells each time how many bytes were dropped."""
        while self._bytes:
            place = self._bytes.find(HEAD)
            if place != 0:
                kept = next((n for n in (2, 1) if self._bytes.endswith(HEAD[:n])), 0)
                noise = place if place > 0 else len(self._bytes) - kept
                if noise == 0:
                    return
                self._find("noise", f"{_hex(self._bytes[:noise])} before a header FF FF FD 00")
                yield self._drop(noise)
                continue
            if len(self._bytes) < 7:
                return
            size = 7 + int.from_bytes(self._bytes[5:7], "little")
            if size < 10 or size > 7 + MAX_BYTES or self._bytes[3] != 0:
                self._find(
                    "length", f"{_hex(self._bytes[:7])} begins no packet: a length of 3 to {MAX_BYTES} after 00 ID"
                )
                yield self._drop(3)
                continue
            if len(self._bytes) < size:
                return
            self._judge(bytes(self._bytes[:size]))
            yield self._drop(size)

    def _drop(self, size: int) -> int:
        del self._bytes[:size]
        return size

    def _judge(self, packet: bytes) -> None:
        """Everything about one packet."""
        number, content = packet[4], packet[7:-2]
        if _crc(packet[:-2]) != packet[-2] + 256 * packet[-1]:
            self._find(
                "checksum", f"{_hex(packet)} should end with {_hex(_crc(packet[:-2]).to_bytes(2, 'little'))}", number
            )
            return
        self.packets += 1
        stuffed = HEAD + b"\xfd"
        if HEAD in content.replace(stuffed, b""):
            self._find("stuffing", f"{_hex(packet)} has FF FF FD within without another FD behind it", number)
        plain = content.replace(stuffed, HEAD)
        self._instruct(number, plain[0], plain[1:])

    # -- content ----------------------------------------------------------------------------------------------------

    def _instruct(self, number: int, instruction: int, words: bytes) -> None:
        if instruction not in KNOWN:
            self._find("instruction", f"no servo knows instruction {instruction:#04x}", number)
        elif instruction in WRITES and len(words) < 3:
            self._find("instruction", f"a write of {_hex(words)} has no data behind its address", number)
        elif instruction in WRITES:
            self._write(number, _word(words), words[2:])
        elif instruction == SYNC_WRITE:
            size = _word(words[2:]) + 1
            if len(words) < 4 + size or size == 1 or (len(words) - 4) % size:
                self._find("instruction", f"a sync write of {_hex(words)} is not of equal parts", number)
                return
            for at in range(4, len(words), size):
                self._write(words[at], _word(words), words[at + 1 : at + size])
        elif instruction == BULK_WRITE:
            at = 0
            while at < len(words):
                end = at + 5 + _word(words[at + 3 :])
                if end > len(words) or end == at + 5:
                    self._find("instruction", f"a bulk write of {_hex(words)} ends within a part", number)
                    return
                self._write(words[at], _word(words[at + 1 :]), words[at + 5 : end])
                at = end

    def _write(self, number: int, address: int, data: bytes) -> None:
        for servo in self.servos:
            if number in (servo.id, TO_ALL) and servo.listens:
                for name, value in self._registers(servo, address, data):
                    self._register(servo, name, value)

    def _registers(self, servo: EmulatedServo, address: int, data: bytes) -> Iterator[tuple[str, int]]:
        """Those that these bytes cover; indirect data are of the register for which they stand."""
        end = min(block.addresses for block in servo.model.indirect)
        written = {meant: byte for i, byte in enumerate(data) if (meant := _meant(servo, address + i)) < end}
        covered = 0
        for one in servo.model.registers.values():
            places = range(one.address, one.address + one.size)
            part = bytes(written[place] for place in places if place in written)
            covered += len(part)
            if part and len(part) < one.size:
                self._find("register", f"{len(data)} bytes at {address} are only a part of {one.name}", servo.id)
            elif part and one.allowed is None:
                self._find("register", f"{one.name} can only be read", servo.id)
            elif part:
                yield one.name, int.from_bytes(part, "little", signed=one.signed)
        if covered < len(written):
            self._find("register", f"{len(data)} bytes at {address}: not all of them belong to a register", servo.id)

    def _register(self, servo: EmulatedServo, name: str, value: int) -> None:
        memory = servo.memory
        if servo.model.registers[name].address < LOCKED_BELOW and memory["Torque Enable"]:
            self._find("eeprom", f"{name} is written while torque is on", servo.id)
        if name == "Torque Enable":
            self._torque(servo, value)
        limits = {
            "Goal PWM": "PWM Limit", "Goal Current": "Current Limit", "Goal Velocity": "Velocity Limit",
        }  # fmt: skip
        if name in limits and abs(value) > memory[limits[name]]:
            self._find("limit", f"{name} {value} is beyond {limits[name]} {memory[limits[name]]}", servo.id)
        if name.startswith("Goal") and memory["Bus Watchdog"] == 255:
            self._find("watchdog", f"{name} is written although Bus Watchdog tripped: first write 0 to it", servo.id)
        if name == "Goal Position":
            self._goal(servo, value)

    def _torque(self, servo: EmulatedServo, value: int) -> None:
        memory = servo.memory
        self._courses.pop(servo.id, None)
        if not value or memory["Torque Enable"]:
            return
        position = servo.position % PULSES_PER_TURN if memory["Operating Mode"] == POSITION_MODE else servo.position
        away = memory["Goal Position"] - memory.homing - position
        if not self.servo_rules_only and memory["Operating Mode"] in (3, 4, 5) and abs(away) > NEAR:
            self._find(
                "torque",
                f"torque comes on with the goal {away:.0f} pulses away: first write Present Position",
                servo.id,
            )
        error = memory["Hardware Error Status"]
        if servo.is_shut_down or (error and not self.servo_rules_only):
            self._find("shut_down", f"torque comes on although Hardware Error Status is {error:#04x}", servo.id)

    def _goal(self, servo: EmulatedServo, goal: int) -> None:
        memory = servo.memory
        low, high = memory["Min Position Limit"], memory["Max Position Limit"]
        if memory["Operating Mode"] == 3 and not low <= goal <= high:
            self._find("limit", f"Goal Position {goal} is outside of {low} to {high}", servo.id)
        if self.servo_rules_only or not memory["Torque Enable"]:
            return
        present = _Course(servo.position + memory.homing, -RATE_WINDOW_S)
        last = self._courses.get(servo.id, present)
        elapsed_s = min(RATE_WINDOW_S, self._now_s - last.time_s)
        fastest = self.fastest.get(servo.id, servo.model.top_speed * PULSES_PER_MINUTE_TO_SECOND)
        step, allowed = abs(goal - last.goal), fastest * elapsed_s + ROUNDING
        if step > allowed:
            detail = (
                f"Goal Position goes from {last.goal:.0f} to {goal} within {1e3 * elapsed_s:.0f} ms: "
                f"{fastest:.0f} pulses/s allow {allowed:.0f} of these {step:.0f}"
            )
            self._find("step", detail, servo.id)
        self._courses[servo.id] = _Course(goal, self._now_s)

    def _find(self, kind: str, detail: str, number: int = -1) -> None:
        self.counts[kind] += 1
        if len(self.findings) < MAX_FINDINGS:
            self.findings.append(Finding(self._now_s, number, kind, detail))


def _word(data: bytes) -> int:
    return int.from_bytes(data[:2], "little")


def _meant(servo: EmulatedServo, place: int) -> int:
    """Address at which a byte has its effect, if it is one of the indirect data."""
    for block in servo.model.indirect:
        if block.data <= place < block.data + block.count:
            return _word(servo.memory.read(block.addresses + 2 * (place - block.data), 2))
    return place


def _crc(data: bytes) -> int:
    """CRC-16 of polynomial x^16 + x^15 + x^2 + 1 from 0, bit by bit."""
    remainder = 0
    for byte in data:
        remainder ^= byte << 8
        for _ in range(8):
            remainder = remainder << 1 ^ (0x18005 if remainder & 0x8000 else 0)
    return remainder


def _hex(data: bytes | bytearray) -> str:
    shown = bytes(data[:24]).hex(" ").upper()
    return f"{shown} ... ({len(data)} bytes)" if len(data) > 24 else shown
