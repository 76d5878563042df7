"""Two servos of one ID, as the wire has them: they talk at the same time, and a 0 of either is a 0."""

from __future__ import annotations

from paramove.robots.dynamixel.packets import BEFORE_LENGTH
from paramove.robots.dynamixel.wire_faults import WireFaults


class CollidingAnswers(WireFaults):
    """Answers of the same ID in one breath become one, bit by bit."""

    def told(self, question: bytes, answers: list[tuple[float, bytes]]) -> list[tuple[float, bytes]]:
        """What the client gets instead."""
        by_id: dict[int, tuple[float, bytes]] = {}
        for delay_s, answer in answers:
            number = answer[BEFORE_LENGTH - 1]
            before = by_id.get(number)
            if before is not None:
                answer = bytes(one & other for one, other in zip(before[1], answer, strict=True))
            by_id[number] = (delay_s, answer)
        return list(by_id.values())
