"""Time sources: what a node gets in each iteration of its loop.

An iteration has a list of messages and at most one tick after them. The source of time decides which:

    real time     whatever has arrived; ticks are made here, 15 times a second
    simulated     whatever has arrived; a tick for each message of the topic `clock`
    lockstep      exactly what had been published before the tick, then its tick (`paramove.bus.lockstep`)
    recorded      what a recording holds (`paramove.bus.recorded`)
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Protocol

from paramove.bus import topics
from paramove.bus.exchange import Exchange
from paramove.bus.subscriber import Received

TICK_PERIOD_NS = 1_000_000_000 // 15
"""One camera period."""
LONGEST_WAIT_S = 1.0


@dataclass(frozen=True)
class Tick:
    """One camera period has passed.

    Attributes:
        number: Counts periods since the run began (real time: since this process began).
        now_ns: Time of the bus clock.
    """

    number: int
    now_ns: int


Iteration = tuple[list[Received], Tick | None]
"""Messages, and the tick after them if there is one."""


class TickSource(Protocol):
    """A source of time and iterations."""

    @property
    def now_ns(self) -> int:
        """Time of the bus clock."""

    @property
    def may_publish(self) -> bool:
        """Whether messages go out at once; otherwise the bus queues them until the next iteration."""

    def next(self, names: list[str]) -> Iteration | None:
        """Waits for the next iteration with these topics; None once the bus was stopped. Ends the iteration before."""


class RealTimeTicks:
    """Iterations of the monotonic clock."""

    may_publish = True

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        exchange.urgent_first = True
        self._start_ns = time.monotonic_ns()
        self._number = 0

    @property
    def now_ns(self) -> int:
        """Nanoseconds of the machine's monotonic clock."""
        return time.monotonic_ns()

    def next(self, names: list[str]) -> Iteration | None:
        exchange = self._exchange
        while not exchange.stopped:
            messages = exchange.take_next(names)
            now_ns = time.monotonic_ns()
            number = (now_ns - self._start_ns) // TICK_PERIOD_NS
            if number > self._number:  # missed ticks are skipped
                self._number = number
                return messages, Tick(number, now_ns)
            if messages:
                return messages, None
            due_ns = self._start_ns + (self._number + 1) * TICK_PERIOD_NS
            exchange.wait(max(0.0, (due_ns - now_ns) * 1e-9))
        return None


class SimulatedTicks:
    """Iterations of the topic `clock`, which does not wait for this process."""

    may_publish = True

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self.now_ns = 0
        exchange.urgent_first = True
        exchange.subscribe(topics.CLOCK)

    def next(self, names: list[str]) -> Iteration | None:
        exchange = self._exchange
        while not exchange.stopped:
            exchange.drain([topics.CLOCK.name])  # first: what was published before a tick has then arrived, too
            messages = exchange.take_next(names)
            tick = None
            while (clock := exchange.pop(topics.CLOCK)) is not None:  # missed ticks are skipped
                self.now_ns = clock.message.time_ns
                tick = Tick(clock.message.tick, self.now_ns)
            if messages or tick:
                return messages, tick
            exchange.wait(LONGEST_WAIT_S)
        return None


class ExternalClock:
    """The time of the process that publishes the clock, from when the run began: it makes the others' iterations."""

    def __init__(self, begun_ns: int) -> None:
        self.now_ns = begun_ns
        self.may_publish = True

    def next(self, names: list[str]) -> Iteration | None:
        raise RuntimeError("the publisher of the clock receives with LockstepBarrier.advance, not with bus.events")
