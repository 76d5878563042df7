"""Whether a measured position can be true: a servo turns no faster than its motor or a hand turns it.

A reply may have a sound checksum and the ID of a servo that was asked, and still be another's. Nothing on the wire
distinguishes it from a true one, but the joint would have jumped.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Container, Mapping
from dataclasses import dataclass

from paramove.robots.dynamixel.bus.servo_chain import Answered, ServoChain, ServoTimeoutError
from paramove.robots.dynamixel.bus.servo_models import PULSES_PER_TURN, ServoModel, difference

HAND_SPEED = 20.0
"""rad/s: no person turns a joint without torque faster, and no arm falls faster."""
NOISE = 8
"""Pulses, 0.7 degrees, by which positions of a servo at rest may differ."""
AGREES_S = 0.02
"""Positions that must come twice are at most as far apart as a servo turns in this time,"""
RECENT = 2
"""and in so many exchanges: behind a missing servo one replies in every second."""
GIVES_UP = 25
"""Readings in a row without a reply of a servo, half a second or so."""
DEG_PER_PULSE = 360.0 / PULSES_PER_TURN
POSITION = "Present Position"


@dataclass(frozen=True)
class Jump:
    """A position, pulses, that cannot be true `seconds` after the one `before`, where `allowed` pulses lie between."""

    number: int
    before: int
    position: int
    seconds: float
    allowed: float

    def __str__(self) -> str:
        jump_deg = DEG_PER_PULSE * abs(self.position - self.before)
        return (
            f"jumped by {jump_deg:.1f} deg, from {self.before} to {self.position} pulses, "
            f"within {1e3 * self.seconds:.1f} ms, allowed {DEG_PER_PULSE * self.allowed:.1f} deg"
        )


class PositionWatch:
    """Positions of an arm's servos that can be true.

    Args:
        models: Of the servos, by ID.

    Attributes:
        jump: The first that was rejected since this was set to None.
    """

    def __init__(self, models: Mapping[int, ServoModel]) -> None:
        self.jump: Jump | None = None
        self._speeds = {number: _top_speed(model) for number, model in models.items()}
        self._register = next(iter(models.values())).registers[POSITION]  # at one address in all models
        self._accepted: dict[int, tuple[int, int]] = {}
        self._answered: dict[int, tuple[int, int, int]] = {}
        self._exchanges = 0
        self._misses = 0

    def read(self, chain: ServoChain, held: Collection[int] = ()) -> dict[int, Answered]:
        """Positions, by ID, of the servos that reply with one that can be true; those of `held` have torque.

        Where all of them reply, each reply is its own. Where one is missing, its ID may stand on another's reply: all
        are asked once more, and a position known only from such replies must come twice. Raises PortLostError.
        """
        numbers, exchanges = list(self._speeds), list[dict[int, Answered]]()
        for order in (1, -1):  # a servo waits for the reply of the one before it: behind a missing one none may reply
            exchanges.append(chain.read_once(numbers[::order], [self._register]))
            if len(exchanges[-1]) == len(numbers):
                del exchanges[:-1]
                break
            if not chain.has_room():
                break
        accepted = {}
        for answers in exchanges:
            self._exchanges += 1
            complete = len(answers) == len(numbers)
            for number, one in answers.items():
                times_ns = (one.asked_ns, one.at_ns)
                if self.accepts(number, one.values[POSITION], times_ns, torque=number in held, complete=complete):
                    accepted[number] = one
        return accepted

    def missing(self, answers: Container[int]) -> list[int]:
        """Servos that did not answer. Raises ServoTimeoutError after too many such readings in a row."""
        missing = [number for number in self._speeds if number not in answers]
        self._misses = self._misses + 1 if missing else 0
        if self._misses > GIVES_UP:
            raise ServoTimeoutError(missing[0], f"servo {missing[0]} no longer answers: check its cable and its power")
        return missing

    def accepts(
        self, number: int, position: int, times_ns: tuple[int, int], *, torque: bool, complete: bool = True
    ) -> bool:
        """Whether a servo can be at this position, pulses, at any time between the request and the reply.

        The distance from the last accepted position is at most what the servo turns in the time since the request for
        that: by its motor at the highest voltage or, without torque, by a hand. With torque it loses no turn; without,
        whole turns do not count, for a servo that was switched off begins within one again. Where the replies are not
        `complete`, it must move as slowly as with torque, and the last reply must agree.
        """
        asked_ns, at_ns = times_ns
        speed = self._speeds[number]
        if complete and not torque:
            speed = max(speed, HAND_SPEED * PULSES_PER_TURN / (2.0 * math.pi))

        def jump(before: tuple[int, ...], longest_s: float = math.inf) -> Jump | None:
            distance = position - before[0] if torque else difference(position, before[0])
            seconds = 1e-9 * (at_ns - before[1])
            allowed = NOISE + speed * min(seconds, longest_s)
            if torque:
                allowed = min(allowed, PULSES_PER_TURN / 2)
            return None if abs(distance) <= allowed else Jump(number, before[0], position, seconds, allowed)

        accepted, answered = self._accepted.get(number), self._answered.get(number)
        self._answered[number] = (position, asked_ns, self._exchanges)
        rejected = None if accepted is None else jump(accepted)
        if rejected is not None:
            self.jump = self.jump or rejected
            return False
        recent = answered is not None and self._exchanges - answered[2] <= RECENT
        if not complete and (answered is None or not recent or jump(answered, AGREES_S) is not None):
            return False
        self._accepted[number] = (position, asked_ns)
        return True


def _top_speed(model: ServoModel) -> float:
    """Pulses per second without load at the maximum voltage of the model."""
    return model.top_speed / 60.0 * PULSES_PER_TURN * model.voltage_limits[1] / model.voltage
