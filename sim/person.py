"""A person who acts as the robot asks. The person sees the true world, never the robot's estimates.

A request is answered by a script: a list of moves, grasps and pauses, made one after the other as the person sees the
table at that time.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Mapping

from paramove.msgs.rule_pb2 import Speech
from sim.arm import Arm
from sim.hand import Hand, Script, Step
from sim.sights import Table

POINTING = (Speech.REQUEST_POINT_AT_OBJECT, Speech.REQUEST_POINT_AT_PLACE)


class Person(ABC):
    """Answers requests, one after the other.

    Args:
        table: The table that the person sees and moves things on.
        hand: The person's.
        arm: Around the hand; None: of this person, a hand is all there is.

    Attributes:
        doing: The person's action as text.
        finished: Whether the robot has said thank you.
        acknowledged: Whether the robot has said anything since a script set this to False.
    """

    def __init__(self, table: Table, hand: Hand, arm: Arm | None = None) -> None:
        self.table, self.hand, self.arm = table, hand, arm
        self.doing = "waits"
        self.finished = False
        self.acknowledged = False
        self._waiting: deque[tuple[int, str]] = deque()
        self._request: tuple[int, str] | None = None
        self._script = self.begin()
        self._step: Step | None = None
        self._step_s = 0.0

    @property
    @abstractmethod
    def scripts(self) -> Mapping[int, Callable[[str], Script]]:
        """Requests that are answered, and with what; called with the name in the request, or ""."""

    def begin(self) -> Script:
        """What the person does before the first request: nothing."""
        return iter(())

    def withdraw(self) -> Script:
        """The hand goes to where it is in nobody's way."""
        return self.hand.withdraw()

    @property
    def busy(self) -> bool:
        """Whether a request is being answered or waits."""
        return self._step is not None or bool(self._waiting)

    def handle(self, request: int, name: str = "") -> None:
        """Handle a request of the robot. One that is being answered or already waits is ignored.

        One to point is answered again if it comes while the arm withdraws.

        Args:
            request: Of `Speech.Request`; any other value acknowledges what the hand points at.
            name: Colour, or "".
        """
        self.acknowledged = True
        if request not in self.scripts or (request, name) in self._waiting:
            return
        again = request in POINTING and self.arm is not None and self.arm.has_pointed
        if self._step is not None and self._request == (request, name) and not again:
            return
        self._waiting.append((request, name))

    def advance(self, duration_s: float) -> None:
        """Let time pass: a millisecond, or any other time."""
        left_s = duration_s
        while left_s > 1e-12:
            if self._step is None and not self._next_step():
                return
            assert self._step is not None
            passed_s = min(left_s, self._step.duration_s - self._step_s)
            self._step_s += passed_s
            left_s -= passed_s
            self._step.during(self._step_s)
            if self._step_s >= self._step.duration_s - 1e-12 or self._step.until():
                self._next_step()

    def empty_hand(self) -> Script:
        """A new task begins: what is still held is put away."""
        held = self.table.held_by_instructor
        if held is not None:
            self.doing = f"takes {held} away"
            yield self.hand.rise()
            yield from self.hand.park(held)

    def end(self, _: str) -> Script:
        """The robot has said thank you."""
        self.finished = True
        yield from self.empty_hand()
        yield from self.withdraw()
        self.doing = "has finished"

    def _next_step(self) -> bool:
        self._step_s = 0.0
        self._step = self._next_of_script()
        while self._step is None and self._waiting:
            self._request = self._waiting.popleft()
            self._script = self.scripts[self._request[0]](self._request[1])
            self._step = self._next_of_script()
        if self._step is None and self.table.held_by_instructor is None:
            self.doing = "waits"
        return self._step is not None

    def _next_of_script(self) -> Step | None:
        step = next(self._script, None)
        if step is None and self.arm is not None:
            self.arm.has_pointed = False
        return step
