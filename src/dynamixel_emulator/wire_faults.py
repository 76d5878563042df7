"""What goes wrong on the wire, on purpose: answers that are lost, late, cut, damaged or from another servo."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from dynamixel_emulator.errors import EmulatorError
from dynamixel_emulator.packets import decoded, encoded

LONGEST_NOISE = 12
UNUSED_ID = 253
"""Servos have lower ones."""


@dataclass
class WireFaults:
    """Shares of the answers, 0 to 1, to which something happens; nothing does by default.

    Attributes:
        lost: Never comes.
        damaged: One byte is another, so that the checksum is wrong.
        cut: Its second half never comes.
        noisy: Has bytes before it that mean nothing.
        bare: Has no data, with a right checksum.
        foreign: Names another servo, with a right checksum.
        late: Comes `late_s` later, which may be after the next question.
        late_s: s.
        delay_s: By which every answer comes later, as by an adapter that keeps bytes back.
        echo: Whether the client hears itself, as with an adapter of two wires.
        seed: Of what happens to which answer.
    """

    lost: float = 0.0
    damaged: float = 0.0
    cut: float = 0.0
    noisy: float = 0.0
    bare: float = 0.0
    foreign: float = 0.0
    late: float = 0.0
    late_s: float = 0.05
    delay_s: float = 0.0
    echo: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        """Raises EmulatorError for a fraction beyond 0 to 1 or a time that is negative."""
        for one in fields(self):
            value = getattr(self, one.name)
            if one.name not in ("late_s", "delay_s", "echo", "seed") and not 0.0 <= value <= 1.0:
                raise EmulatorError(f"{one.name} is a fraction of 0 to 1, found {value}")
        for name in ("late_s", "delay_s"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise EmulatorError(f"{name} is finite and not negative, found {getattr(self, name)}")
        self._rng = np.random.default_rng(self.seed)

    def told(self, question: bytes, answers: list[tuple[float, bytes]]) -> list[tuple[float, bytes]]:
        """What the client gets instead of these answers: delays, s, and bytes."""
        kept, held_back_s = ([(0.0, question)] if self.echo else []), self.delay_s
        for delay_s, answer in answers:
            if self._happens(self.lost):
                continue
            late_s = self.late_s if self._happens(self.late) else 0.0
            kept.append((delay_s + late_s + held_back_s, self._changed(answer)))
            held_back_s = 0.0  # the others come right behind the first
        return kept

    def _changed(self, answer: bytes) -> bytes:
        if self._happens(self.bare):
            packet = decoded(answer)
            answer = encoded(replace(packet, parameters=packet.parameters[:1]))
        if self._happens(self.foreign):
            packet = decoded(answer)
            answer = encoded(replace(packet, id=(packet.id + 1) % UNUSED_ID))
        if self._happens(self.damaged):
            place = int(self._rng.integers(len(answer)))
            answer = answer[:place] + bytes([answer[place] ^ int(self._rng.integers(1, 256))]) + answer[place + 1 :]
        if self._happens(self.cut):
            answer = answer[: len(answer) // 2]
        if self._happens(self.noisy):
            answer = self._rng.bytes(int(self._rng.integers(1, LONGEST_NOISE))) + answer
        return answer

    def _happens(self, share: float) -> bool:
        return share > 0.0 and bool(self._rng.random() < share)
