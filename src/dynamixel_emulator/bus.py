"""A chain of emulated servos on one bus: bytes in, bytes out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from dynamixel_emulator.loops import STEP_S
from dynamixel_emulator.mechanics import Mechanics
from dynamixel_emulator.models import RAM_BEGINS
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
from dynamixel_emulator.servo import Answer, EmulatedServo

FOR_SEVERAL = {Instruction.SYNC_READ, Instruction.SYNC_WRITE, Instruction.BULK_READ, Instruction.BULK_WRITE}
FOR_SEVERAL |= {Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ}

LAST_ID = 252
RESETS = {Instruction.FACTORY_RESET, Instruction.BACKUP}

Said = tuple[float, bytes]
"""How long after the question an answer begins, s, and its bytes."""


class EmulatedBus:
    """Servos that hear the same bytes.

    Args:
        servos: In the order of the chain.
        mechanics: What they move, in the same order; without, each carries nothing.
        servo_rules_only: Whether the judge finds only what the servos themselves reject.

    Attributes:
        servos: Those on the bus.
        judge: Of all that arrives; may be replaced.
        now_s: Time of the servos and of what they move, s.
    """

    def __init__(
        self, servos: Sequence[EmulatedServo], mechanics: Mechanics | None = None, servo_rules_only: bool = False
    ) -> None:
        self.servos = list(servos)
        self.mechanics = mechanics
        self._chain = tuple(servos) if mechanics is not None else ()
        self.judge = ProtocolChecker(self.servos, servo_rules_only=servo_rules_only)
        self._reader = PacketReader()
        self.now_s = self._heard_s = 0.0
        self._baud_rate = 0
        if mechanics is not None:
            for servo, (shaft, _) in zip(self._chain, mechanics.shafts(), strict=True):
                servo.stand(shaft)

    def begin(self, now_s: float) -> None:
        """The time of all servos is this one, s, from now on."""
        self.now_s = now_s
        for servo in self.servos:
            servo.begin(now_s)

    def add(self, servo: EmulatedServo) -> None:
        """One more, which moves nothing."""
        servo.begin(self.now_s)
        self.servos.append(servo)

    def receive(self, data: bytes, baud_rate: int, now_s: float) -> list[tuple[float, bytes]]:
        """What the servos say to these bytes: for each answer, how long after now_s it begins, s, and its bytes.

        The bytes came at now_s, s; the servos answer at once, as they are in their own time, which `run_to` brings on.
        Bytes at another baud rate than before, or after a pause in the middle of a packet, begin anew.
        """
        if baud_rate != self._baud_rate or (self._reader.waits and now_s - self._heard_s > 0.1):
            self._reader.forget()
            self.judge.give_up(now_s)
        self._baud_rate, self._heard_s = baud_rate, now_s
        said: list[tuple[float, bytes]] = []
        for piece in self.judge.pieces(data, now_s):
            said += self._obey(piece, baud_rate)
        return said

    def _obey(self, data: bytes, baud_rate: int) -> Iterator[Said]:
        for packet in self._reader.feed(data):
            hearing = [servo for servo in self.servos if servo.listens and servo.hears_at(baud_rate)]
            for servo in hearing:
                servo.packet_received(self.now_s)
            yield from self._answers(packet, hearing)

    def run_to(self, now_s: float) -> None:
        """All servos, and what they move, go on until this time, s."""
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

    def _answers(self, packet: Packet | DamagedPacket, servos: list[EmulatedServo]) -> Iterator[Said]:
        if isinstance(packet, DamagedPacket):
            yield from _together(
                _status(servo, Answer(StatusError.CHECKSUM))
                for servo in servos
                if servo.id == packet.id and servo.answers(Instruction.WRITE)
            )
        elif packet.instruction in FOR_SEVERAL:
            yield from self._for_several(packet, servos)
        elif packet.id == BROADCAST:
            yield from self._for_all(packet, servos)
        else:
            yield from _together(self._for_one(packet, servos))

    def _for_all(self, packet: Packet, servos: list[EmulatedServo]) -> Iterator[Said]:
        """Only a ping is answered, by each servo when those of lower ids have had their time."""
        resets_all = packet.instruction == Instruction.FACTORY_RESET and packet.parameters[:1] == b"\xff"
        if packet.instruction == Instruction.READ or resets_all:
            return
        told = [(servo.id, _status(servo, servo.do(packet.instruction, packet.parameters))) for servo in servos]
        if packet.instruction == Instruction.PING:
            for number in sorted({number for number, _ in told}):
                yield from _together(answer for one, answer in told if one == number)

    def _for_one(self, packet: Packet, servos: list[EmulatedServo]) -> Iterator[Said]:
        for servo in servos:
            if servo.id == packet.id and packet.instruction != Instruction.STATUS:
                # Who is told another ID, delay or level answers with the old ones.
                answers, delay_s, number = servo.answers(packet.instruction), servo.return_delay_s, servo.id
                answer = servo.do(packet.instruction, packet.parameters)
                if answers:
                    yield delay_s, _encoded(number, answer)
            elif servo.memory["Secondary(Shadow) ID"] == packet.id <= LAST_ID and not _changes_eeprom(packet):
                servo.do(packet.instruction, packet.parameters)

    def _for_several(self, packet: Packet, servos: list[EmulatedServo]) -> Iterator[Said]:
        """Instructions that name servos in their parameters: each acts, and those that read answer in that order."""
        fast = packet.instruction in (Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ)
        parts: list[list[tuple[EmulatedServo, Answer]]] = []
        for number, address, data in _tasks(packet):
            named = [servo for servo in servos if servo.id == number]
            if isinstance(data, bytes):
                for servo in named:
                    servo.do(Instruction.WRITE, address.to_bytes(2, "little") + data)
                continue
            asked = address.to_bytes(2, "little") + data.to_bytes(2, "little")
            answering = [servo for servo in named if servo.answers(packet.instruction)]
            if not answering:
                break  # each speaks after the one before it: those after a silent one never do
            parts.append([(servo, servo.do(Instruction.READ, asked)) for servo in answering])
        if fast and parts:
            sizes = [data for _, _, data in _tasks(packet) if isinstance(data, int)]
            yield parts[0][0][0].return_delay_s, _joined(parts, 1 + sum(size + 4 for size in sizes))
        elif not fast:
            for answers in parts:
                yield from _together(_status(servo, answer) for servo, answer in answers)


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


def _changes_eeprom(packet: Packet) -> bool:
    """Which a servo that is called by its secondary ID does not."""
    writes = packet.instruction in (Instruction.WRITE, Instruction.REG_WRITE)
    return packet.instruction in RESETS or (writes and int.from_bytes(packet.parameters[:2], "little") < RAM_BEGINS)


def _encoded(number: int, answer: Answer) -> bytes:
    return encoded(Packet(number, Instruction.STATUS, bytes([answer.error]) + answer.data))


def _status(servo: EmulatedServo, answer: Answer) -> tuple[float, bytes]:
    return servo.return_delay_s, _encoded(servo.id, answer)


def _together(answers: Iterable[Said]) -> Iterator[Said]:
    """Answers of servos with one id, which speak at once: what is on the wire then."""
    told = list(answers)
    if told:
        yield told[0][0], collided([data for _, data in told])


def collided(spoken: Sequence[bytes]) -> bytes:
    """Bytes on the wire when all speak at once: a low level of one hides a high one of others.

    Their clocks are not the same: each speaker is taken to be a bit later than the one before.
    """
    wire = bytearray(spoken[0])
    for data in spoken[1:]:
        late = int.from_bytes(data, "little") << 1
        wire += b"\xff" * (len(data) - len(wire))
        for i, byte in enumerate(late.to_bytes(len(data) + 1, "little")[: len(data)]):
            wire[i] &= byte
    return bytes(wire)


def _joined(parts: list[list[tuple[EmulatedServo, Answer]]], length: int) -> bytes:
    """The one packet of a fast read: error, id, data and checksum of each servo; each checksum is of all before it.

    `length` is that with all servos: where one is missing, the packet ends early.
    """
    data = HEADER + bytes([0, BROADCAST]) + length.to_bytes(2, "little") + bytes([Instruction.STATUS])
    for answers in parts:
        spoken = [bytes([answer.error, servo.id]) + answer.data for servo, answer in answers]
        data += collided([one + checksum(data + one).to_bytes(2, "little") for one in spoken])
    return data
