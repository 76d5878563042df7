"""A chain of emulated servos on one bus: bytes in, bytes out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from paramove.robots.dynamixel.emulated_servo import Answer, EmulatedServo
from paramove.robots.dynamixel.packets import (
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

FOR_SEVERAL = {Instruction.SYNC_READ, Instruction.SYNC_WRITE, Instruction.BULK_READ, Instruction.BULK_WRITE}
FOR_SEVERAL |= {Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ}


class EmulatedBus:
    """Servos that hear the same bytes.

    Args:
        servos: In the order of the chain.
    """

    def __init__(self, servos: Sequence[EmulatedServo]) -> None:
        self.servos = tuple(servos)
        self._reader = PacketReader()
        self._heard_s = 0.0
        self._baud_rate = 0

    def receive(self, data: bytes, baud_rate: int, now_s: float) -> list[tuple[float, bytes]]:
        """What the servos say to these bytes: for each answer, how long after now_s it begins, s, and its bytes.

        Bytes at another baud rate than before, or after a pause in the middle of a packet, begin anew.
        """
        if baud_rate != self._baud_rate or (self._reader.waits and now_s - self._heard_s > 0.1):
            self._reader.forget()
        self._baud_rate, self._heard_s = baud_rate, now_s
        said: list[tuple[float, bytes]] = []
        for packet in self._reader.feed(data):
            hearing = [servo for servo in self.servos if servo.listens and servo.baud_rate == baud_rate]
            for servo in hearing:
                servo.hear(now_s)
            for delay_s, answer in self._answers(packet, hearing):
                said.append((delay_s, answer))
        return said

    def run_to(self, now_s: float) -> None:
        """All servos move until this time, s."""
        for servo in self.servos:
            servo.run_to(now_s)

    def _answers(self, packet: Packet | DamagedPacket, servos: list[EmulatedServo]) -> Iterator[tuple[float, bytes]]:
        if isinstance(packet, DamagedPacket):
            for servo in servos:
                if servo.id == packet.id and servo.answers(Instruction.WRITE):
                    yield _status(servo, Answer(StatusError.CHECKSUM))
        elif packet.instruction in FOR_SEVERAL:
            yield from self._for_several(packet, servos)
        elif packet.id == BROADCAST:
            for servo in sorted(servos, key=lambda one: one.id):
                resets_all = packet.instruction == Instruction.FACTORY_RESET and packet.parameters[:1] == b"\xff"
                if packet.instruction == Instruction.READ or resets_all:
                    continue
                answer = servo.do(packet.instruction, packet.parameters)
                if packet.instruction == Instruction.PING:
                    yield _status(servo, answer)
        else:
            for servo in servos:
                if servo.id == packet.id and packet.instruction != Instruction.STATUS:
                    # Who is told another ID, delay or level answers with the old ones.
                    answers, delay_s, number = servo.answers(packet.instruction), servo.return_delay_s, servo.id
                    answer = servo.do(packet.instruction, packet.parameters)
                    if answers:
                        yield delay_s, _encoded(number, answer)
                elif servo.memory["Secondary(Shadow) ID"] == packet.id:
                    servo.do(packet.instruction, packet.parameters)

    def _for_several(self, packet: Packet, servos: list[EmulatedServo]) -> Iterator[tuple[float, bytes]]:
        """Instructions that name servos in their parameters: each acts, and those that read answer in that order."""
        by_id = {servo.id: servo for servo in servos}
        fast = packet.instruction in (Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ)
        parts: list[tuple[EmulatedServo, Answer]] = []
        for number, address, data in _tasks(packet):
            servo = by_id.get(number)
            if servo is None:
                if fast:
                    break  # those after a missing one wait for it in vain
                continue
            if isinstance(data, bytes):
                servo.do(Instruction.WRITE, address.to_bytes(2, "little") + data)
            elif servo.answers(packet.instruction):
                asked = address.to_bytes(2, "little") + data.to_bytes(2, "little")
                parts.append((servo, servo.do(Instruction.READ, asked)))
        if fast and parts:
            sizes = [data for _, _, data in _tasks(packet) if isinstance(data, int)]
            yield parts[0][0].return_delay_s, _joined(parts, 1 + sum(size + 4 for size in sizes))
        elif not fast:
            yield from (_status(servo, answer) for servo, answer in parts)


def _tasks(packet: Packet) -> Iterator[tuple[int, int, int | bytes]]:
    """Of each named servo: its id, an address, and how many bytes to read from there or which to write there."""
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


def _encoded(number: int, answer: Answer) -> bytes:
    return encoded(Packet(number, Instruction.STATUS, bytes([answer.error]) + answer.data))


def _status(servo: EmulatedServo, answer: Answer) -> tuple[float, bytes]:
    return servo.return_delay_s, _encoded(servo.id, answer)


def _joined(parts: list[tuple[EmulatedServo, Answer]], length: int) -> bytes:
    """The one packet of a fast read: error, id, data and checksum of each servo; each checksum is of all before it.

    `length` is that with all servos: where one is missing, the packet ends early.
    """
    content = [bytes([answer.error, servo.id]) + answer.data for servo, answer in parts]
    data = HEADER + bytes([0, BROADCAST]) + length.to_bytes(2, "little") + bytes([Instruction.STATUS])
    for one in content:
        data += one
        data += checksum(data).to_bytes(2, "little")
    return data
