"""Injected replies of a servo bus with a valid checksum and wrong content."""

from dataclasses import replace

from dynamixel_emulator.wire_faults import WireFaults
from paramove.robots.dynamixel.bus.packets import Instruction, Packet, PacketReader, decoded, encoded
from paramove.robots.dynamixel.bus.servo_chain import Answered
from paramove.robots.dynamixel.bus.servo_models import XL430_W250

POSITION = XL430_W250.registers["Present Position"]
Replies = list[tuple[float, bytes]]


class OneAsTheNext(WireFaults):
    """In every `each`-th exchange one servo's reply has the ID of the next servo, whose own is lost."""

    def __init__(self, each: int) -> None:
        super().__init__()
        self.each, self.exchanges = each, 0

    def apply(self, request: bytes, replies: Replies) -> Replies:
        if len(replies) < 2:
            return replies
        self.exchanges += 1
        if self.exchanges % self.each:
            return replies
        index = self.exchanges // self.each % (len(replies) - 1)
        delay_s, reply = replies[index]
        foreign = replace(decoded(reply), id=decoded(replies[index + 1][1]).id)
        return [*replies[:index], (delay_s, encoded(foreign)), *replies[index + 2 :]]


class SameAsTheNext(WireFaults):
    """From now on the reply of one servo has the ID of the next servo, whose own is lost."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number

    def apply(self, request: bytes, replies: Replies) -> Replies:
        received = []
        for delay_s, reply in replies:
            packet = decoded(reply)
            if packet.id == self.number:
                received.append((delay_s, encoded(replace(packet, id=self.number + 1))))
            elif packet.id != self.number + 1:
                received.append((delay_s, reply))
        return received


class FaultyChain:
    """Replies of servos at given positions to reads of all of them, with faults of the wire, without waiting.

    Attributes:
        now_ns: Time, which an exchange without missing replies takes 2 ms of, and another one the timeout.
        positions: By ID, pulses.
    """

    def __init__(self, positions: dict[int, float], faults: WireFaults, timeout_ms: int) -> None:
        self.now_ns = 0
        self.positions, self._faults, self._timeout_ms = positions, faults, timeout_ms

    def has_room(self) -> bool:
        return True

    def read_once(self, numbers, registers) -> dict[int, Answered]:
        (register,) = registers
        replies = []
        for number in numbers:
            data = round(self.positions[number]).to_bytes(register.size, "little", signed=True)
            replies.append((0.0, encoded(Packet(number, Instruction.STATUS, b"\0" + data))))
        received = b"".join(reply for _, reply in self._faults.apply(b"", replies))
        packets = [one for one in PacketReader().feed(received) if isinstance(one, Packet)]
        by_id = {one.id: one for one in packets}
        if len(by_id) < len(packets) or not by_id.keys() <= set(numbers):
            by_id = {}
        asked_ns = self.now_ns
        self.now_ns += 1_000_000 * (2 if len(by_id) == len(numbers) else self._timeout_ms)
        values = {one.id: int.from_bytes(one.parameters[1:], "little", signed=True) for one in by_id.values()}
        return {number: Answered({register.name: value}, asked_ns, self.now_ns) for number, value in values.items()}


class OneElsewhere(WireFaults):
    """Once, the reported position of one servo is offset by this number of pulses."""

    def __init__(self, number: int, pulses: int) -> None:
        super().__init__()
        self.number, self.pulses = number, pulses

    def apply(self, request: bytes, replies: Replies) -> Replies:
        if decoded(request).parameters[:2] != POSITION.address.to_bytes(2, "little"):
            return replies
        return [(delay_s, self._offset(reply)) for delay_s, reply in replies]

    def _offset(self, reply: bytes) -> bytes:
        packet = decoded(reply)
        if packet.id != self.number or not self.pulses:
            return reply
        error, data, rest = packet.parameters[:1], packet.parameters[1:5], packet.parameters[5:]
        position = int.from_bytes(data, "little", signed=True) + self.pulses
        self.pulses = 0
        return encoded(
            Packet(packet.id, packet.instruction, error + position.to_bytes(4, "little", signed=True) + rest)
        )
