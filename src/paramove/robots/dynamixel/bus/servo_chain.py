"""The servos of one bus: requests to one or to all of them, and replies that are never another servo's.

Requests go out through dynamixel-sdk. Replies are read here: the SDK's own reading (4.1.0) gives up all servos behind a
missing one, gives 0 for a number that never came, raises IndexError for a reply without data, and takes a delayed reply
for that to the next request.

Delayed replies are recognised by their lengths: after a timeout, a read requests some bytes more than it needs, so that
a reply to an earlier request has the wrong length. Servos reply in the order of the requests: after a reply to one of
them, none to an earlier one comes any more.
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
"""So many lengths are remembered; when many replies are missing, requests are rare: an arm that comes back has little
to reply to, and a length is used again after half a second."""
PACKET_BYTES = 11
"""Of a reply without data."""
MAX_BYTES = 4096
ATTEMPTS_S = (0.0, 0.02, 0.2)
"""Each attempt waits so much longer than a reply needs: machines and adapters pause, servos do not."""
PING_DATA = 3
TURN_S = 0.003
"""For each ID's reply to a ping of all, as dynamixel-sdk 4.1.0 waits (`broadcastPing`); a servo alone with ID 5 did not
reply within 10 ms (github.com/ROBOTIS-GIT/Dynamixel2Arduino, issue 106)."""
REJECTIONS = {
    Status.RESULT_FAIL: "could not do it, as after a hardware error (`paramove arm scan` shows it, `reboot` clears it)",
    Status.INSTRUCTION: "does not know the instruction",
    Status.CHECKSUM: "received a damaged packet",
    Status.DATA_RANGE: "rejects the value: it is out of range",
    Status.DATA_LENGTH: "rejects the value: it has the wrong length",
    Status.DATA_LIMIT: "rejects the value: it is beyond its limits",
    Status.ACCESS: "cannot write this now (EEPROM is locked while torque is on)",
}


class ServoError(Exception):
    """A servo did not carry out a request. `number` is its ID."""

    def __init__(self, number: int, message: str) -> None:
        super().__init__(message)
        self.number = number


class ServoTimeoutError(ServoError):
    """No reply, or none that could be read."""


class ServoRejectedError(ServoError):
    """The servo replied with an error."""


@dataclass(frozen=True)
class PingedServo:
    """A servo's reply to a ping."""

    number: int
    model_number: int
    firmware: int


@dataclass(frozen=True)
class Answered:
    """One servo's numbers by the names of the registers.

    Attributes:
        values: Numbers.
        asked_ns, at_ns: When it was asked, and when the reply was complete, by the port's clock.
    """

    values: dict[str, int]
    asked_ns: int
    at_ns: int


@dataclass
class WireCounts:
    """What came over the wire since the chain was made.

    Attributes:
        exchanges: Requests with a reply.
        noisy: Exchanges with bytes that belonged to no sound packet, or with replies to no request.
        expected: Replies that were expected.
        missing: Those that did not come in time.
        damaged: Packets with a wrong checksum.
        noise: Bytes that belonged to no sound packet, those of damaged ones among them.
        stray: Replies of the wrong length, or together with one of a servo that was not asked or replied twice.
        echoed: Own packets that came back.
    """

    exchanges: int = 0
    noisy: int = 0
    expected: int = 0
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
        self._delayed = DelayedReplies()

    def has_room(self) -> bool:
        """Whether a read is sent at once; after many requests without a reply it waits."""
        if self._delayed.many:
            self._read_delayed_replies(0.0)
        return not self._delayed.rest_s

    def ping(self, number: int, retry: bool = True) -> PingedServo | None:
        """Ask one servo whether it is there; `retry`: with the attempts of a read, else once."""
        answer = self._insist(
            _packet(number, Instruction.PING), number, PING_DATA, ATTEMPTS_S if retry else ATTEMPTS_S[:1]
        )
        return None if answer is None else _pinged(answer)

    def ping_all(self) -> list[PingedServo]:
        """All servos that reply at this baud rate, by ID.

        Two servos of one ID reply at the same time: `counts.noise` grows. If both are understood, both are listed.
        """
        self._send(lambda: self._sdk.txPacket(self.port, _packet(BROADCAST, Instruction.PING)))
        wire_s = (PACKET_BYTES + PING_DATA) * BITS_PER_BYTE / self.port.baud_rate
        self.port.setPacketTimeoutMillis(1e3 * (BROADCAST * (wire_s + TURN_S) + self.port.latency_s))
        servos = [_pinged(one) for one in self._replies({}) if len(one.parameters) == 1 + PING_DATA]
        return sorted(servos, key=lambda one: one.number)

    def read(self, number: int, register: Register) -> int:
        """One number of one servo. Raises ServoError."""
        for timeout_s in ATTEMPTS_S:
            answers = self._read([number], register.address, register.size, timeout_s)
            if number in answers:
                _check(number, answers[number], f"read {register.name}")
                return _values([register], answers[number])[register.name]
        raise _no_reply(number, f"read {register.name}")

    def write(self, number: int, register: Register, value: int) -> None:
        """Write one number of one servo. Raises ServoError."""
        parameters = [*register.address.to_bytes(2, "little"), *_bytes(register, value)]
        answer = self._insist(_packet(number, Instruction.WRITE, parameters), number, 0, ATTEMPTS_S)
        if answer is None:
            raise _no_reply(number, f"write {register.name}")
        _check(number, answer, f"write {register.name} = {value}")

    def reboot(self, number: int) -> None:
        """Switch a servo off and on: torque off, errors cleared. Raises ServoError."""
        packet = _packet(number, Instruction.REBOOT)
        if number not in self._exchange(lambda: self._sdk.txPacket(self.port, packet), {number: 0}):
            raise _no_reply(number, "reboot")

    def sync_read(self, numbers: Sequence[int], registers: Sequence[Register]) -> dict[int, Answered]:
        """The same numbers of several servos in one exchange; those that did not reply are asked once more.

        Args:
            numbers: IDs.
            registers: Which must be the same for all of the servos; everything between the first and the last is read.

        Returns:
            Of those that replied; the others are left out.
        """
        answers: dict[int, Answered] = {}
        for order in (1, -1):  # a servo waits for the reply of the one before it: behind a missing one none may reply
            missing = [number for number in numbers if number not in answers][::order]
            if missing and (order == 1 or self.has_room()):
                answers |= self.read_once(missing, registers)
        return answers

    def read_once(self, numbers: Sequence[int], registers: Sequence[Register]) -> dict[int, Answered]:
        """As `sync_read`, but in one exchange."""
        address = min(one.address for one in registers)
        size = max(one.address + one.size for one in registers) - address
        answers, asked_ns = {}, self.port.clock.now_ns
        for number, packet in self._read(numbers, address, size).items():
            if packet.parameters[0] in (0, ALERT):
                answers[number] = Answered(_values(registers, packet), asked_ns, self.port.clock.now_ns)
        return answers

    def sync_write(self, register: Register, values: dict[int, int]) -> None:
        """Write one register of several servos in one packet without replies."""
        content = [byte for number, value in values.items() for byte in (number, *_bytes(register, value))]
        self._send(lambda: self._sdk.syncWriteTxOnly(self.port, register.address, register.size, content, len(content)))

    def _read(self, numbers: Sequence[int], address: int, size: int, timeout_s: float = 0.0) -> dict[int, Packet]:
        while not self.has_room():
            self._read_delayed_replies(self._delayed.rest_s)
        wide = self._delayed.length_for(size)
        if len(numbers) == 1:
            parameters = [*address.to_bytes(2, "little"), *wide.to_bytes(2, "little")]
            packet = _packet(numbers[0], Instruction.READ, parameters)
            return self._exchange(lambda: self._sdk.txPacket(self.port, packet), {numbers[0]: wide}, timeout_s)
        sizes = dict.fromkeys(numbers, wide)
        return self._exchange(
            lambda: self._sdk.syncReadTx(self.port, address, wide, list(numbers), len(numbers), False), sizes
        )

    def _read_delayed_replies(self, wait_s: float) -> None:
        self.port.setPacketTimeoutMillis(1e3 * wait_s)
        for packet in PacketReader().feed(self.port.readPort(MAX_BYTES)):
            if isinstance(packet, Packet) and packet.instruction == Instruction.STATUS:
                self._delayed.arrived(len(packet.parameters) - 1)

    def _insist(self, packet: list[int], number: int, size: int, attempts_s: Sequence[float]) -> Packet | None:
        """Ask one servo more than once if need be; replies to its first requests may come with that to the last."""
        n_delayed = 0
        for timeout_s in attempts_s:
            stray = self.counts.stray
            answers = self._exchange(
                lambda: self._sdk.txPacket(self.port, list(packet)), {number: size}, timeout_s, n_delayed
            )
            if number in answers:
                return answers[number]
            n_delayed += self.counts.stray == stray
        return None

    def _exchange(
        self, send: Callable[[], int], sizes: dict[int, int], timeout_s: float = 0.0, n_delayed: int = 0
    ) -> dict[int, Packet]:
        """Send a request, and wait for the reply of each of these servos with so many bytes of data.

        `n_delayed`: earlier sendings of this request that have no reply yet.
        """
        self._delayed.requested()
        self._send(send)
        self.counts.expected += len(sizes)
        answer_bytes = sum(PACKET_BYTES + size for size in sizes.values())
        self.port.setPacketTimeout(answer_bytes, len(sizes), timeout_s)
        noisy, stray, owing = self.counts.noisy, self.counts.stray, bool(self._delayed)
        replies = self._replies(dict(sizes))
        answers = self._trusted(replies, sizes, n_delayed)
        if self.counts.stray > stray and not owing:  # else they are delayed replies
            self.counts.noisy = noisy + 1
        if any(len(packet.parameters) - 1 in sizes.values() for packet in replies):
            self._delayed.answered()
        missing = len(sizes) - len(answers)
        self.counts.missing += missing
        if missing:
            self._delayed.missed(max(sizes.values()))
        return answers

    def _send(self, send: Callable[[], int]) -> None:
        self.port.is_using = False
        result = send()
        self.port.is_using = False
        if result != COMM_SUCCESS:
            raise AssertionError(f"the packet was not sent: {self._sdk.getTxRxResult(result)}")

    def _replies(self, sizes: dict[int, int]) -> list[Packet]:
        """Status packets until each of these servos has replied with so many bytes of data, or time is up.

        Without any, all that come in time.
        """
        reader, replies = PacketReader(), list[Packet]()
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
                    replies.append(packet)
                else:
                    self.counts.stray += 1
                    self._delayed.arrived(len(packet.parameters) - 1)
            if not data and self.port.isPacketTimeout():
                break
        self.counts.exchanges += 1
        self.counts.noisy += noise > 0
        self.counts.noise += noise
        return replies

    def _trusted(self, replies: list[Packet], sizes: dict[int, int], n_delayed: int) -> dict[int, Packet]:
        """By ID; none of them if one came unasked, or more often than asked: then it is unknown whose they are."""
        by_id = {packet.id: packet for packet in replies}
        if len(replies) - len(by_id) <= n_delayed and by_id.keys() <= sizes.keys():
            return by_id
        self.counts.stray += len(replies)
        return {}


def _fits(packet: Packet, sizes: set[int]) -> bool:
    """Whether it has as many bytes as were requested, or an error instead; a reply to an older request has others."""
    if not packet.parameters:
        return False
    rejected = bool(packet.parameters[0] & ~ALERT)
    return len(packet.parameters) - 1 in sizes or (rejected and len(packet.parameters) == 1)


def _check(number: int, packet: Packet, what: str) -> None:
    error = packet.parameters[0] & ~ALERT
    if error:
        why = REJECTIONS.get(Status(error), "rejected") if error in set(Status) else f"answered error {error}"
        raise ServoRejectedError(number, f"servo {number} {why}: {what}")


def _no_reply(number: int, what: str) -> ServoTimeoutError:
    message = (
        f"servo {number} did not answer ({what}, {len(ATTEMPTS_S)} attempts): check its cable, its power and the baud "
        "rate; `paramove arm scan` looks for it"
    )
    return ServoTimeoutError(number, message)


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


def _packet(number: int, instruction: Instruction, parameters: Sequence[int] = ()) -> list[int]:
    """As the SDK sends it: header and checksum are 0 until then."""
    length = len(parameters) + 3
    return [0, 0, 0, 0, number, length & 255, length >> 8, instruction, *parameters, 0, 0]


class DelayedReplies:
    """Lengths of the replies that may still come, oldest first."""

    def __init__(self) -> None:
        self._lengths: deque[int] = deque(maxlen=MAX_OWED)
        self._requested_s = 0.0

    def __bool__(self) -> bool:
        """Whether any may come."""
        return bool(self._lengths)

    @property
    def many(self) -> bool:
        """Whether requests should become rare."""
        return len(self._lengths) >= MANY_OWED

    @property
    def rest_s(self) -> float:
        """Until the next request, if many are missing."""
        return max(0.0, self._requested_s + REST_S - time.monotonic()) if self.many else 0.0

    def length_for(self, size: int) -> int:
        """The minimum number of bytes, from `size` on, that no delayed reply has."""
        return next(one for one in range(size, size + MAX_OWED + 1) if one not in self._lengths)

    def requested(self) -> None:
        """A request goes out now."""
        self._requested_s = time.monotonic()

    def answered(self) -> None:
        """A servo replied to the last request."""
        self._lengths.clear()

    def missed(self, length: int) -> None:
        """A reply with so many bytes of data did not come in time."""
        self._lengths.append(length)

    def arrived(self, length: int) -> None:
        """A delayed reply of this length came."""
        for _ in range(self._lengths.index(length) if length in self._lengths else 0):
            self._lengths.popleft()
