"""A chain of emulated servos on one bus: bytes in, bytes out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from dynamixel_emulator.loops import STEP_S
from dynamixel_emulator.mechanics import Mechanics
from dynamixel_emulator.models import RAM_START
from dynamixel_emulator.packets import (
    BROADCAST,
    HEADER,
    DamagedPacket,
    Instruction,
    Packet,
    PacketReader,
    StatusError,
    checksum,
    encoded,
)
from dynamixel_emulator.protocol_checker import ProtocolChecker
from dynamixel_emulator.servo import EmulatedServo, Reply

MULTI_SERVO = {Instruction.SYNC_READ, Instruction.SYNC_WRITE, Instruction.BULK_READ, Instruction.BULK_WRITE}
MULTI_SERVO |= {Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ}

LAST_ID = 252
RESETS = {Instruction.FACTORY_RESET, Instruction.BACKUP}

TimedReply = tuple[float, bytes]
"""Delay from the request to the start of a reply, s, and the bytes of the reply."""


class EmulatedBus:
    """Servos that share a bus.

    Args:
        servos: In the order of the chain.
        mechanics: Mechanics that they move, in the same order; without, the servos have no load.
        servo_rules_only: Whether the checker reports only packets that the servos themselves reject.

    Attributes:
        servos: The servos on the bus.
        checker: Checks all received bytes; may be replaced.
        now_s: Simulated time of the servos and the mechanics, s.
    """

    def __init__(
        self, servos: Sequence[EmulatedServo], mechanics: Mechanics | None = None, servo_rules_only: bool = False
    ) -> None:
        self.servos = list(servos)
        self.mechanics = mechanics
        self._chain = tuple(servos) if mechanics is not None else ()
        self.checker = ProtocolChecker(self.servos, servo_rules_only=servo_rules_only)
        self._reader = PacketReader()
        self.now_s = self._received_s = 0.0
        self._baud_rate = 0
        if mechanics is not None:
            for servo, (shaft, _) in zip(self._chain, mechanics.shafts(), strict=True):
                servo.set_shaft(shaft)

    def begin(self, now_s: float) -> None:
        """Sets the time of all servos, s."""
        self.now_s = now_s
        for servo in self.servos:
            servo.begin(now_s)

    def add(self, servo: EmulatedServo) -> None:
        """Adds a servo that is not connected to the mechanics."""
        servo.begin(self.now_s)
        self.servos.append(servo)

    def receive(self, data: bytes, baud_rate: int, now_s: float) -> list[TimedReply]:
        """Executes received bytes; returns for each reply its delay after now_s, s, and its bytes.

        The bytes arrived at now_s, s. The servos reply with their state at their own time, which `run_to` advances.
        A change of the baud rate, or a pause in the middle of a packet, discards an incomplete packet.
        """
        if baud_rate != self._baud_rate or (self._reader.is_incomplete and now_s - self._received_s > 0.1):
            self._reader.reset()
            self.checker.discard_incomplete(now_s)
        self._baud_rate, self._received_s = baud_rate, now_s
        replies: list[TimedReply] = []
        for piece in self.checker.pieces(data, now_s):
            replies += self._execute(piece, baud_rate)
        return replies

    def _execute(self, data: bytes, baud_rate: int) -> Iterator[TimedReply]:
        for packet in self._reader.feed(data):
            receivers = [servo for servo in self.servos if servo.listens and servo.listens_at(baud_rate)]
            for servo in receivers:
                servo.packet_received(self.now_s)
            yield from self._replies(packet, receivers)

    def run_to(self, now_s: float) -> None:
        """Advances all servos and the mechanics to this time, s."""
        while self.mechanics is not None and self.now_s + STEP_S <= now_s:
            self.now_s += STEP_S
            efforts = [servo.effort() for servo in self._chain]
            self.mechanics.step(efforts, [servo.blocked for servo in self._chain])
            for servo, (shaft, velocity) in zip(self._chain, self.mechanics.shafts(), strict=True):
                servo.moved(shaft, velocity)
        self.now_s = max(self.now_s, now_s) if self.mechanics is None else self.now_s
        for servo in self.servos:
            if servo in self._chain:
                servo.present()
            else:
                servo.run_to(now_s)

    def _replies(self, packet: Packet | DamagedPacket, servos: list[EmulatedServo]) -> Iterator[TimedReply]:
        if isinstance(packet, DamagedPacket):
            yield from _simultaneous(
                _status(servo, Reply(StatusError.CHECKSUM))
                for servo in servos
                if servo.id == packet.id and servo.replies_to(Instruction.WRITE)
            )
        elif packet.instruction in MULTI_SERVO:
            yield from self._execute_multi_servo(packet, servos)
        elif packet.id == BROADCAST:
            yield from self._execute_broadcast(packet, servos)
        else:
            yield from _simultaneous(self._execute_single(packet, servos))

    def _execute_broadcast(self, packet: Packet, servos: list[EmulatedServo]) -> Iterator[TimedReply]:
        """Executes an instruction on all servos; they reply only to a ping, in the order of their IDs."""
        resets_all = packet.instruction == Instruction.FACTORY_RESET and packet.parameters[:1] == b"\xff"
        if packet.instruction == Instruction.READ or resets_all:
            return
        replies = [(servo.id, _status(servo, servo.do(packet.instruction, packet.parameters))) for servo in servos]
        if packet.instruction == Instruction.PING:
            for number in sorted({number for number, _ in replies}):
                yield from _simultaneous(reply for one, reply in replies if one == number)

    def _execute_single(self, packet: Packet, servos: list[EmulatedServo]) -> Iterator[TimedReply]:
        for servo in servos:
            if servo.id == packet.id and packet.instruction != Instruction.STATUS:
                # The reply to a change of ID, delay or status return level uses the old values.
                replies, delay_s, number = servo.replies_to(packet.instruction), servo.return_delay_s, servo.id
                reply = servo.do(packet.instruction, packet.parameters)
                if replies:
                    yield delay_s, _encoded(number, reply)
            elif servo.memory["Secondary(Shadow) ID"] == packet.id <= LAST_ID and not _changes_eeprom(packet):
                servo.do(packet.instruction, packet.parameters)

    def _execute_multi_servo(self, packet: Packet, servos: list[EmulatedServo]) -> Iterator[TimedReply]:
        """Executes an instruction that lists servos in its parameters; those that are read reply in this order."""
        fast = packet.instruction in (Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ)
        parts: list[list[tuple[EmulatedServo, Reply]]] = []
        for number, address, data in _tasks(packet):
            named = [servo for servo in servos if servo.id == number]
            if isinstance(data, bytes):
                for servo in named:
                    servo.do(Instruction.WRITE, address.to_bytes(2, "little") + data)
                continue
            request = address.to_bytes(2, "little") + data.to_bytes(2, "little")
            replying = [servo for servo in named if servo.replies_to(packet.instruction)]
            if not replying:
                break  # each replies after its predecessor: servos after one that does not reply wait forever
            parts.append([(servo, servo.do(Instruction.READ, request)) for servo in replying])
        if fast and parts:
            sizes = [data for _, _, data in _tasks(packet) if isinstance(data, int)]
            yield parts[0][0][0].return_delay_s, _fast_reply(parts, 1 + sum(size + 4 for size in sizes))
        elif not fast:
            for replies in parts:
                yield from _simultaneous(_status(servo, reply) for servo, reply in replies)


def _tasks(packet: Packet) -> Iterator[tuple[int, int, int | bytes]]:
    """For each listed servo: its id, an address, and the number of bytes to read or the bytes to write there."""
    words = packet.parameters

    def word(at: int) -> int:
        return int.from_bytes(words[at : at + 2], "little")

    if packet.instruction in (Instruction.SYNC_READ, Instruction.FAST_SYNC_READ):
        yield from ((number, word(0), word(2)) for number in words[4:])
    elif packet.instruction == Instruction.SYNC_WRITE:
        size = word(2)
        for at in range(4, len(words) - size, size + 1):
            yield words[at], word(0), words[at + 1 : at + 1 + size]
    elif packet.instruction in (Instruction.BULK_READ, Instruction.FAST_BULK_READ):
        for at in range(0, len(words) - 4, 5):
            yield words[at], word(at + 1), word(at + 3)
    else:
        at = 0
        while at + 5 <= len(words):
            size = word(at + 3)
            if at + 5 + size <= len(words):
                yield words[at], word(at + 1), words[at + 5 : at + 5 + size]
            at += 5 + size


def _changes_eeprom(packet: Packet) -> bool:
    """Whether a packet changes EEPROM, which a servo addressed by its secondary ID ignores."""
    writes = packet.instruction in (Instruction.WRITE, Instruction.REG_WRITE)
    return packet.instruction in RESETS or (writes and int.from_bytes(packet.parameters[:2], "little") < RAM_START)


def _encoded(number: int, reply: Reply) -> bytes:
    return encoded(Packet(number, Instruction.STATUS, bytes([reply.error]) + reply.data))


def _status(servo: EmulatedServo, reply: Reply) -> TimedReply:
    return servo.return_delay_s, _encoded(servo.id, reply)


def _simultaneous(replies: Iterable[TimedReply]) -> Iterator[TimedReply]:
    """Replies of servos with the same id, which transmit simultaneously: the resulting bytes on the wire."""
    colliding = list(replies)
    if colliding:
        yield colliding[0][0], collided([data for _, data in colliding])


def collided(transmissions: Sequence[bytes]) -> bytes:
    """Bytes on the wire when servos transmit simultaneously: a low level of one overrides a high level of the others.

    Their clocks differ: each transmission after the first is assumed to be shifted by one bit.
    """
    wire = bytearray(transmissions[0])
    for data in transmissions[1:]:
        shifted = int.from_bytes(data, "little") << 1
        wire += b"\xff" * (len(data) - len(wire))
        for i, byte in enumerate(shifted.to_bytes(len(data) + 1, "little")[: len(data)]):
            wire[i] &= byte
    return bytes(wire)


def _fast_reply(parts: list[list[tuple[EmulatedServo, Reply]]], length: int) -> bytes:
    """Common reply to a fast read: error, id, data and checksum of each servo; a checksum covers all bytes before it.

    `length` counts all requested servos: if one is missing, the packet ends early.
    """
    data = HEADER + bytes([0, BROADCAST]) + length.to_bytes(2, "little") + bytes([Instruction.STATUS])
    for replies in parts:
        contents = [bytes([reply.error, servo.id]) + reply.data for servo, reply in replies]
        data += collided([one + checksum(data + one).to_bytes(2, "little") for one in contents])
    return data
