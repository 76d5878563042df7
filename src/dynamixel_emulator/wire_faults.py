"""Injected communication faults: replies that are lost, late, cut, damaged or from another servo."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from dynamixel_emulator.errors import EmulatorError
from dynamixel_emulator.packets import decoded, encoded

MAX_NOISE_BYTES = 12
UNUSED_ID = 253
"""IDs of servos are lower."""


@dataclass
class WireFaults:
    """Fractions of the replies, 0 to 1, that each fault affects; none by default.

    Attributes:
        lost: The reply never arrives.
        damaged: One byte is changed, so that the checksum is wrong.
        cut: The second half never arrives.
        noisy: Random bytes precede the reply.
        bare: The reply has no data, with a correct checksum.
        foreign: The reply has the ID of another servo, with a correct checksum.
        late: The reply arrives `late_s` later, possibly after the next request.
        late_s: Delay of late replies, s.
        delay_s: Additional delay of every reply, s, as by an adapter that buffers bytes.
        echo: Whether the client receives its own bytes, as with a half-duplex adapter.
        seed: Seed of the random faults.
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
        """Raises EmulatorError for a fraction outside of 0 to 1 or a negative time."""
        for one in fields(self):
            value = getattr(self, one.name)
            if one.name not in ("late_s", "delay_s", "echo", "seed") and not 0.0 <= value <= 1.0:
                raise EmulatorError(f"{one.name} is a fraction of 0 to 1, found {value}")
        for name in ("late_s", "delay_s"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise EmulatorError(f"{name} is finite and not negative, found {getattr(self, name)}")
        self._rng = np.random.default_rng(self.seed)

    def apply(self, request: bytes, replies: list[tuple[float, bytes]]) -> list[tuple[float, bytes]]:
        """Applies the faults to these replies; returns delays, s, and bytes as the client receives them."""
        received, buffer_delay_s = ([(0.0, request)] if self.echo else []), self.delay_s
        for delay_s, reply in replies:
            if self._occurs(self.lost):
                continue
            late_s = self.late_s if self._occurs(self.late) else 0.0
            received.append((delay_s + late_s + buffer_delay_s, self._changed(reply)))
            buffer_delay_s = 0.0  # the others follow the first without delay
        return received

    def _changed(self, reply: bytes) -> bytes:
        if self._occurs(self.bare):
            packet = decoded(reply)
            reply = encoded(replace(packet, parameters=packet.parameters[:1]))
        if self._occurs(self.foreign):
            packet = decoded(reply)
            reply = encoded(replace(packet, id=(packet.id + 1) % UNUSED_ID))
        if self._occurs(self.damaged):
            index = int(self._rng.integers(len(reply)))
            reply = reply[:index] + bytes([reply[index] ^ int(self._rng.integers(1, 256))]) + reply[index + 1 :]
        if self._occurs(self.cut):
            reply = reply[: len(reply) // 2]
        if self._occurs(self.noisy):
            reply = self._rng.bytes(int(self._rng.integers(1, MAX_NOISE_BYTES))) + reply
        return reply

    def _occurs(self, fraction: float) -> bool:
        return fraction > 0.0 and bool(self._rng.random() < fraction)
