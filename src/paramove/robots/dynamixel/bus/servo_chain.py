"""The servos of one bus: questions to one or to all of them, and answers that are never another's.

Questions go out through dynamixel-sdk. Answers are read here: the SDK's own reading (4.1.0) gives up all servos behind
a missing one, gives 0 for a number that never came, takes an answer without data for an IndexError, and a late answer
for that to the next question.

Answers that may still come to questions that nobody answered in time, told from others by their lengths.

After silences, a read asks for some bytes more than it needs: an answer to an earlier question then has the wrong
length. Servos answer in the order of the questions, so an answer to one of them says that nobody answers any more to
those before it.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from dynamixel_sdk import COMM_SUCCESS, Protocol2PacketHandler

from paramove.robots.dynamixel.bus.packets import (
    ALERT,
    BROADCAST,
    DamagedPacket,
    Instruction,
    Packet,
    PacketReader,
    encoded,
)
from paramove.robots.dynamixel.bus.packets import StatusError as Status
from paramove.robots.dynamixel.bus.servo_models import Register
from paramove.robots.dynamixel.bus.servo_port import BITS_PER_BYTE, ServoPort

MAX_OWED, MANY_OWED, REST_S = 16, 8, 0.05
"""So many lengths are remembered; when many are owed, one question in a while is enough: an arm that comes back has
little to answer, and a length is used again after half a second."""
PACKET_BYTES = 11
"""Of an answer without data."""
MAX_BYTES = 4096
ATTEMPTS_S = (0.0, 0.02, 0.2)
"""So much longer than an answer needs, each attempt waits: machines and adapters make pauses, servos do not."""
PING_DATA = 3
TURN_S = 0.003
"""For each ID's answer to a ping of all: so long waits dynamixel-sdk 4.1.0 (`broadcastPing`); a servo alone with ID 5
was not heard within 10 ms (github.com/ROBOTIS-GIT/Dynamixel2Arduino, issue 106)."""
REFUSALS = {
    Status.RESULT_FAIL: "could not do it, as after a hardware error (`paramove arm scan` shows it, `reboot` clears it)",
    Status.INSTRUCTION: "does not know the instruction",
    Status.CHECKSUM: "heard a damaged packet",
    Status.DATA_RANGE: "says that the value is out of range",
    Status.DATA_LENGTH: "says that the value has the wrong length",
    Status.DATA_LIMIT: "says that the value is beyond its limits",
    Status.ACCESS: "says that this cannot be written now (EEPROM is locked while torque is on)",
}


class ServoError(Exception):
    """A servo did not do what it was asked for. `number` is its ID."""

    def __init__(self, number: int, sentence: str) -> None:
        super().__init__(sentence)
        self.number = number


class ServoSilentError(ServoError):
    """No answer, or none that could be read."""


class ServoRefusedError(ServoError):
    """The servo answered with an error."""


@dataclass(frozen=True)
class PingedServo:
    """What a servo says to a ping."""

    number: int
    model_number: int
    firmware: int


@dataclass(frozen=True)
class Answered:
    """One servo's numbers by the names of the registers.

    Attributes:
        values: Numbers.
        alert: Whether the servo has a hardware error (register 70).
        asked_ns, at_ns: When it was asked, and when the answer was complete, of the monotonic clock.
    """

    values: dict[str, int]
    alert: bool
    asked_ns: int
    at_ns: int


@dataclass
class WireCounts:
    """What came over the wire since the chain was made.

    Attributes:
        exchanges: Questions with an answer.
        noisy: Exchanges with bytes that belonged to no sound packet, or with answers to nobody's question.
        asked: Answers that were expected.
        missing: Those that did not come in time.
        damaged: Packets with a wrong checksum.
        noise: Bytes that belonged to no sound packet, those of damaged ones among them.
        stray: Answers of the wrong length, or together with one of a servo that was not asked or answered twice.
        echoed: Own packets that came back.
    """

    exchanges: int = 0
    noisy: int = 0
    asked: int = 0
    missing: int = 0
    damaged: int = 0
    noise: int = 0
    stray: int = 0
    echoed: int = 0


class ServoChain:
    """Servos behind an open port.

    All methods raise PortLostError when the port went away.

    Attributes:
        counts: What came over the wire.
    """

    def __init__(self, port: ServoPort) -> None:
        self.port = port
        self.counts = WireCounts()
        self._sdk = Protocol2PacketHandler()
        self._late = LateAnswers()

    def has_room(self) -> bool:
        """Whether a read asks at once; behind many questions that nobody answered it waits for its turn."""
        if self._late.many:
            self._read_late_replies(0.0)
        return not self._late.rest_s

    def ping(self, number: int, patient: bool = True) -> PingedServo | None:
        """Ask one servo whether it is there, as patiently as a read asks, or once."""
        packet = [0, 0, 0, 0, number, 3, 0, Instruction.PING, 0, 0]
        answer = self._insist(packet, number, PING_DATA, ATTEMPTS_S if patient else ATTEMPTS_S[:1])
        return None if answer is None else _pinged(answer)

    def ping_all(self) -> list[PingedServo]:
        """All servos that answer at this baud rate, by ID.

        Two servos of one ID talk at the same time: then `counts.noise` grows. If both were understood, both are told.
        """
        packet = [0, 0, 0, 0, BROADCAST, 3, 0, Instruction.PING, 0, 0]
        self._send(lambda: self._sdk.txPacket(self.port, packet))
        wire_s = (PACKET_BYTES + PING_DATA) * BITS_PER_BYTE / self.port.baud_rate
        self.port.setPacketTimeoutMillis(1e3 * (BROADCAST * (wire_s + TURN_S) + self.port.latency_s))
        found = [_pinged(one) for one in self._answers({}) if len(one.parameters) == 1 + PING_DATA]
        return sorted(found, key=lambda one: one.number)

    def read(self, number: int, register: Register) -> int:
        """One number of one servo. Raises ServoError."""
        for timeout_s in ATTEMPTS_S:
            answers = self._read([number], register.address, register.size, timeout_s)
            if number in answers:
                _check(number, answers[number], f"read {register.name}")
                return _values([register], answers[number])[register.name]
        raise _silent(number, f"read {register.name}")

    def write(self, number: int, register: Register, value: int) -> None:
        """Write one number of one servo. Raises ServoError."""
        packet = _write_packet(number, register.address, list(_bytes(register, value)))
        answer = self._insist(packet, number, 0, ATTEMPTS_S)
        if answer is None:
            raise _silent(number, f"write {register.name}")
        _check(number, answer, f"write {register.name} = {value}")

    def reboot(self, number: int) -> None:
        """Switch a servo off and on: torque off, errors cleared. Raises ServoError."""
        packet = [0, 0, 0, 0, number, 3, 0, Instruction.REBOOT, 0, 0]
        if number not in self._exchange(lambda: self._sdk.txPacket(self.port, packet), {number: 0}):
            raise _silent(number, "reboot")

    def sync_read(self, numbers: Sequence[int], registers: Sequence[Register]) -> dict[int, Answered]:
        """The same numbers of several servos in one exchange; those that did not answer are asked once more.

        Args:
            numbers: IDs.
            registers: Which must be the same for all of the servos; everything between the first and the last is read.

        Returns:
            Of those that answered; nothing is made up for the others.
        """
        found: dict[int, Answered] = {}
        for order in (1, -1):  # a servo waits for the answer of the one before it: behind a missing one none may answer
            missing = [number for number in numbers if number not in found][::order]
            if missing and (order == 1 or self.has_room()):
                found |= self.read_once(missing, registers)
        return found

    def read_once(self, numbers: Sequence[int], registers: Sequence[Register]) -> dict[int, Answered]:
        """As `sync_read`, but nobody is asked twice."""
        address = min(one.address for one in registers)
        size = max(one.address + one.size for one in registers) - address
        found, asked_ns = {}, time.monotonic_ns()
        for number, packet in self._read(numbers, address, size).items():
            if (error := packet.parameters[0]) in (0, ALERT):
                found[number] = Answered(_values(registers, packet), error == ALERT, asked_ns, time.monotonic_ns())
        return found

    def sync_write(self, register: Register, values: dict[int, int]) -> None:
        """Write one register of several servos in one packet, to which none answers."""
        content = [byte for number, value in values.items() for byte in (number, *_bytes(register, value))]
        self._send(lambda: self._sdk.syncWriteTxOnly(self.port, register.address, register.size, content, len(content)))

    def _read(self, numbers: Sequence[int], address: int, size: int, timeout_s: float = 0.0) -> dict[int, Packet]:
        while not self.has_room():
            self._read_late_replies(self._late.rest_s)
        wide = self._late.length_for(size)
        if len(numbers) == 1:
            asked = [*address.to_bytes(2, "little"), *wide.to_bytes(2, "little")]
            packet = [0, 0, 0, 0, numbers[0], 7, 0, Instruction.READ, *asked, 0, 0]
            return self._exchange(lambda: self._sdk.txPacket(self.port, packet), {numbers[0]: wide}, timeout_s)
        sizes = dict.fromkeys(numbers, wide)
        return self._exchange(
            lambda: self._sdk.syncReadTx(self.port, address, wide, list(numbers), len(numbers), False), sizes
        )

    def _read_late_replies(self, wait_s: float) -> None:
        self.port.setPacketTimeoutMillis(1e3 * wait_s)
        for packet in PacketReader().feed(self.port.readPort(MAX_BYTES)):
            if isinstance(packet, Packet) and packet.instruction == Instruction.STATUS:
                self._late.heard(len(packet.parameters) - 1)

    def _insist(self, packet: list[int], number: int, size: int, attempts_s: Sequence[float]) -> Packet | None:
        """Ask one servo more than once if need be; answers to its first questions may come with that to the last."""
        late = 0
        for timeout_s in attempts_s:
            stray = self.counts.stray
            answers = self._exchange(
                lambda: self._sdk.txPacket(self.port, list(packet)), {number: size}, timeout_s, late
            )
            if number in answers:
                return answers[number]
            late += self.counts.stray == stray
        return None

    def _exchange(
        self, send: Callable[[], int], sizes: dict[int, int], timeout_s: float = 0.0, late: int = 0
    ) -> dict[int, Packet]:
        """Ask, and wait for the answer of each of these servos with so many bytes of data.

        `late`: so many times the same was asked before and nobody answered yet.
        """
        self._late.asked()
        self._send(send)
        self.counts.asked += len(sizes)
        answer_bytes = sum(PACKET_BYTES + size for size in sizes.values())
        self.port.setPacketTimeout(answer_bytes, len(sizes), timeout_s)
        noisy, stray, owing = self.counts.noisy, self.counts.stray, bool(self._late)
        found = self._answers(dict(sizes))
        answers = self._trusted(found, sizes, late)
        if self.counts.stray > stray and not owing:  # else they are answers that came too late
            self.counts.noisy = noisy + 1
        if any(len(packet.parameters) - 1 in sizes.values() for packet in found):
            self._late.answered()
        missing = len(sizes) - len(answers)
        self.counts.missing += missing
        if missing:
            self._late.missed(max(sizes.values()))
        return answers

    def _send(self, send: Callable[[], int]) -> None:
        self.port.is_using = False
        result = send()
        self.port.is_using = False
        if result != COMM_SUCCESS:
            raise AssertionError(f"the packet was not sent: {self._sdk.getTxRxResult(result)}")

    def _answers(self, sizes: dict[int, int]) -> list[Packet]:
        """Status packets until each of these servos has answered with so many bytes of data, or time is up.

        Without any, all that come in time.
        """
        reader, found = PacketReader(), list[Packet]()
        waited_for = set(sizes)
        noise = 0
        while waited_for or not sizes:
            data = self.port.readPort(MAX_BYTES)
            noise += len(data)
            for packet in reader.feed(data):
                if isinstance(packet, DamagedPacket):
                    self.counts.damaged += 1
                    continue
                noise -= len(encoded(packet))
                if packet.instruction != Instruction.STATUS:
                    self.counts.echoed += 1
                elif not sizes or _fits(packet, set(sizes.values())):
                    waited_for.discard(packet.id)
                    found.append(packet)
                else:
                    self.counts.stray += 1
                    self._late.heard(len(packet.parameters) - 1)
            if not data and self.port.isPacketTimeout():
                break
        self.counts.exchanges += 1
        self.counts.noisy += noise > 0
        self.counts.noise += noise
        return found

    def _trusted(self, answers: list[Packet], sizes: dict[int, int], late: int) -> dict[int, Packet]:
        """By ID; none of them if one came more often than it was asked, or unasked: then who said what is not known."""
        by_id = {packet.id: packet for packet in answers}
        if len(answers) - len(by_id) <= late and by_id.keys() <= sizes.keys():
            return by_id
        self.counts.stray += len(answers)
        return {}


def _fits(packet: Packet, sizes: set[int]) -> bool:
    """Whether it has as many bytes as were asked for, or says why it has none; an older question's has others."""
    if not packet.parameters:
        return False
    refused = bool(packet.parameters[0] & ~ALERT)
    return len(packet.parameters) - 1 in sizes or (refused and len(packet.parameters) == 1)


def _check(number: int, packet: Packet, what: str) -> None:
    error = packet.parameters[0] & ~ALERT
    if error:
        why = REFUSALS.get(Status(error), "refused") if error in set(Status) else f"answered error {error}"
        raise ServoRefusedError(number, f"servo {number} {why}: {what}")


def _silent(number: int, what: str) -> ServoSilentError:
    sentence = (
        f"servo {number} did not answer ({what}, {len(ATTEMPTS_S)} attempts): check its cable, its power and the baud "
        "rate; `paramove arm scan` looks for it"
    )
    return ServoSilentError(number, sentence)


def _pinged(packet: Packet) -> PingedServo:
    data = packet.parameters[1:]
    return PingedServo(packet.id, int.from_bytes(data[:2], "little"), data[2])


def _values(registers: Sequence[Register], packet: Packet) -> dict[str, int]:
    first = min(one.address for one in registers)
    data = packet.parameters[1:]
    return {
        one.name: int.from_bytes(data[one.address - first :][: one.size], "little", signed=one.signed)
        for one in registers
    }


def _bytes(register: Register, value: int) -> bytes:
    """Raises OverflowError for a value that the register cannot hold; nothing is cut off."""
    return value.to_bytes(register.size, "little", signed=register.signed)


def _write_packet(number: int, address: int, data: list[int]) -> list[int]:
    length = len(data) + 5
    return [0, 0, 0, 0, number, length & 255, length >> 8, Instruction.WRITE, address & 255, address >> 8, *data, 0, 0]


class LateAnswers:
    """Lengths of the data that is owed, oldest first."""

    def __init__(self) -> None:
        self._lengths: deque[int] = deque(maxlen=MAX_OWED)
        self._asked_s = 0.0

    def __bool__(self) -> bool:
        """Whether any may come."""
        return bool(self._lengths)

    @property
    def many(self) -> bool:
        """Whether it is time to ask less often."""
        return len(self._lengths) >= MANY_OWED

    @property
    def rest_s(self) -> float:
        """Until the next question, if many are owed."""
        return max(0.0, self._asked_s + REST_S - time.monotonic()) if self.many else 0.0

    def length_for(self, size: int) -> int:
        """As few bytes as possible, from `size` on, that no late answer has."""
        return next(one for one in range(size, size + MAX_OWED + 1) if one not in self._lengths)

    def asked(self) -> None:
        """A question goes out now."""
        self._asked_s = time.monotonic()

    def answered(self) -> None:
        """Somebody answered the question that was asked last."""
        self._lengths.clear()

    def missed(self, length: int) -> None:
        """Somebody did not answer it in time, with so many bytes of data."""
        self._lengths.append(length)

    def heard(self, length: int) -> None:
        """An answer of this length came late."""
        for _ in range(self._lengths.index(length) if length in self._lengths else 0):
            self._lengths.popleft()
