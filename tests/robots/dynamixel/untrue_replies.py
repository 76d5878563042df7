"""Replies of a servo bus with a sound checksum that are not true."""

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

    def told(self, question: bytes, answers: Replies) -> Replies:
        if len(answers) < 2:
            return answers
        self.exchanges += 1
        if self.exchanges % self.each:
            return answers
        place = self.exchanges // self.each % (len(answers) - 1)
        delay_s, answer = answers[place]
        foreign = replace(decoded(answer), id=decoded(answers[place + 1][1]).id)
        return [*answers[:place], (delay_s, encoded(foreign)), *answers[place + 2 :]]


class OneElsewhere(WireFaults):
    """Once, the position of one servo is by so many pulses another."""

    def __init__(self, number: int, pulses: int) -> None:
        super().__init__()
        self.number, self.pulses = number, pulses

    def told(self, question: bytes, answers: Replies) -> Replies:
        if decoded(question).parameters[:2] != POSITION.address.to_bytes(2, "little"):
            return answers
        return [(delay_s, self._moved(answer)) for delay_s, answer in answers]

    def _moved(self, answer: bytes) -> bytes:
        packet = decoded(answer)
        if packet.id != self.number or not self.pulses:
            return answer
        error, data, rest = packet.parameters[:1], packet.parameters[1:5], packet.parameters[5:]
        moved = int.from_bytes(data, "little", signed=True) + self.pulses
        self.pulses = 0
        return encoded(Packet(packet.id, packet.instruction, error + moved.to_bytes(4, "little", signed=True) + rest))
