"""Injected replies of a servo bus with a valid checksum and wrong content."""

from dataclasses import replace

from dynamixel_emulator.wire_faults import WireFaults
from paramove.robots.dynamixel.bus.packets import Packet, decoded, encoded
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
