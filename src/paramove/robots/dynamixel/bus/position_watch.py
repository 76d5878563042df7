"""Whether a measured position can be true: a servo turns no faster than its motor or a hand turns it.

A reply may have a sound checksum and the ID of a servo that was asked, and still be another's. Nothing on the wire
distinguishes it from a true one, but the joint would have jumped, or the other servo's reply is missing and the
position is nearer to that one's last than to its own. What is withheld counts as a lost reply; where `AGREEING`
positions in a row agree with each other, they are taken as true.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Container, Mapping
from dataclasses import dataclass

from paramove.robots.dynamixel.bus.servo_chain import Answered, ServoChain, ServoTimeoutError
from paramove.robots.dynamixel.bus.servo_models import PULSES_PER_TURN, ServoModel, difference

HAND_SPEED = 20.0
"""rad/s: no person turns a joint without torque faster, and no arm falls faster."""
NOISE = 8
"""Pulses, 0.7 degrees, by which positions of a servo at rest may differ."""
AGREEING = 3
"""Positions in a row that agree are taken as true, however far they are from the last accepted one."""
AGREES_S = 0.02
"""Positions agree that are at most as far apart as a servo turns in this time,"""
RECENT = 2
"""and in so many exchanges: behind a missing servo one replies in every second."""
LONGEST_S = 0.05
"""Where a reply is missing, the distance from the last accepted position grows no longer than this."""
EXCHANGED = 34
"""Pulses, 3 degrees: two servos have exchanged their positions if each is so near to the other's last one."""
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


@dataclass(frozen=True)
class _Candidate:
    """The latest position of a servo, pulses, accepted or not, and how many in a row agree with it."""

    position: int
    asked_ns: int
    exchange: int
    agreeing: int


class PositionWatch:
    """Positions of an arm's servos that can be true.

    Args:
        models: Of the servos, by ID.

    Attributes:
        jump: The first that was rejected since this was set to None.
        exchanged: IDs of two servos that were found, at once, where the other one had been; () if none were, or if they
            were exchanged back.
    """

    def __init__(self, models: Mapping[int, ServoModel]) -> None:
        self.jump: Jump | None = None
        self.exchanged: tuple[int, ...] = ()
        self._speeds = {number: _top_speed(model) for number, model in models.items()}
        self._register = next(iter(models.values())).registers[POSITION]  # at one address in all models
        self._accepted: dict[int, tuple[int, int]] = {}
        self._candidates: dict[int, _Candidate] = {}
        self._exchanges = 0
        self._misses = 0

    def read(self, chain: ServoChain, held: Collection[int] = ()) -> dict[int, Answered]:
        """Positions, by ID, of the servos that reply with one that can be true; those of `held` have torque.

        Where all of them reply, each reply is its own. Where one is missing, its reply may have another's ID: all are
        asked once more, and a position known only from such replies must come twice. Raises PortLostError.
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
            positions = {number: one.values[POSITION] for number, one in answers.items()}
            complete = len(answers) == len(numbers)
            if complete:
                self._look_for_exchanged(positions)
            resembling = self._resembling(answers)
            for number, one in answers.items():
                times_ns = (one.asked_ns, one.at_ns)
                if number in resembling:
                    self._note_jump(number, positions[number], times_ns, torque=number in held)
                elif self.accepts(number, positions[number], times_ns, torque=number in held, complete=complete):
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
        whole turns do not count, for a servo that was switched off begins within one again.

        Where the replies are not `complete`, it must move as slowly as with torque, the time counts up to `LONGEST_S`,
        and the position before must agree. What is too far away is accepted once `AGREEING` positions in a row agree,
        but with torque at most half a turn away.
        """
        agreeing = self._agreeing(number, position, times_ns, torque)
        accepted = self._accepted.get(number)
        if accepted is None:
            needed = 1 if complete else AGREEING
        else:
            if torque and abs(position - accepted[0]) > PULSES_PER_TURN / 2:
                agreeing = 0
            self._note_jump(number, position, times_ns, torque=torque, complete=complete)
            longest_s = math.inf if complete else LONGEST_S
            is_near = self._jump(number, position, times_ns, torque, complete, longest_s) is None
            needed = AGREEING if not is_near else 1 if complete else 2
        if agreeing < needed:
            return False
        self._accepted[number] = (position, times_ns[0])
        return True

    def _resembling(self, answers: Mapping[int, Answered]) -> set[int]:
        """Servos whose position may be that of another, whose reply is missing or resembles a third one's.

        It is nearer to the other's last position than to its own, or where the other one may be by now; a position as
        it was before is its own.
        """
        resembling = set[int]()
        doubtful = self._accepted.keys() - answers.keys()
        while doubtful:
            now_doubtful = set()
            for number in self._accepted.keys() & answers.keys() - resembling:
                position, at_ns = answers[number].values[POSITION], answers[number].at_ns
                own = abs(difference(position, self._accepted[number][0]))
                if own > NOISE and any(self._may_be(other, position, at_ns, own) for other in doubtful):
                    now_doubtful.add(number)
            resembling |= now_doubtful
            doubtful = now_doubtful
        return resembling

    def _may_be(self, other: int, position: int, at_ns: int, own: int) -> bool:
        last, asked_ns = self._accepted[other]
        reach = NOISE + self._speeds[other] * min(1e-9 * (at_ns - asked_ns), LONGEST_S)
        return abs(difference(position, last)) < max(own, reach)

    def _agreeing(self, number: int, position: int, times_ns: tuple[int, int], torque: bool) -> int:
        """How many positions in a row agree, this one included."""
        before, agreeing = self._candidates.get(number), 1
        if before is not None and self._exchanges - before.exchange <= RECENT:
            allowed = NOISE + self._speeds[number] * min(1e-9 * (times_ns[1] - before.asked_ns), AGREES_S)
            if abs(_distance(position, before.position, torque)) <= allowed:
                agreeing += before.agreeing
        self._candidates[number] = _Candidate(position, times_ns[0], self._exchanges, agreeing)
        return agreeing

    def _jump(
        self, number: int, position: int, times_ns: tuple[int, int], torque: bool, complete: bool, longest_s: float
    ) -> Jump | None:
        """Whether it is too far from the last accepted position, for a time of at most `longest_s`."""
        before, before_ns = self._accepted[number]
        speed = self._speeds[number]
        if complete and not torque:
            speed = max(speed, HAND_SPEED * PULSES_PER_TURN / (2.0 * math.pi))
        seconds = 1e-9 * (times_ns[1] - before_ns)
        allowed = NOISE + speed * min(seconds, longest_s)
        if torque:
            allowed = min(allowed, PULSES_PER_TURN / 2)
        if abs(_distance(position, before, torque)) <= allowed:
            return None
        return Jump(number, before, position, seconds, allowed)

    def _note_jump(
        self, number: int, position: int, times_ns: tuple[int, int], *, torque: bool, complete: bool = False
    ) -> None:
        """Remember the first position that no servo can have reached."""
        self.jump = self.jump or self._jump(number, position, times_ns, torque, complete, math.inf)

    def _look_for_exchanged(self, positions: Mapping[int, int]) -> None:
        """Two servos that are, from one exchange to the next, where the other one was: their IDs were exchanged."""
        last = {number: accepted[0] for number, accepted in self._accepted.items()}
        for one, other in itertools.combinations(last, 2):
            apart = abs(difference(last[one], last[other])) > 2 * EXCHANGED
            crossed = ((positions[one], last[other]), (positions[other], last[one]))
            if apart and all(abs(difference(now, before)) <= EXCHANGED for now, before in crossed):
                self.exchanged = () if self.exchanged == (one, other) else (one, other)


def _distance(position: int, before: int, torque: bool) -> int:
    """Pulses; without torque by the shorter way, as whole turns do not count."""
    return position - before if torque else difference(position, before)


def _top_speed(model: ServoModel) -> float:
    """Pulses per second without load at the maximum voltage of the model."""
    return model.top_speed / 60.0 * PULSES_PER_TURN * model.voltage_limits[1] / model.voltage
