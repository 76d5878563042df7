"""How fast a topic may come.

A publisher gone wild must not take its subscribers' time. Time is read from the messages' own stamps, on the bus clock:
so a subscriber that was busy for a while, or simulated time that runs fast, breaks no budget. Commands are limited by
the subscriber's own clock and by their size as well, for stamps may be wrong and a large message keeps its reader busy;
whoever goes on in spite of that is cut off.
"""

from __future__ import annotations

import time

ALLOWANCE = 1.2
"""Times the topic's nominal rate."""
BURST = 20
"""Messages beyond that at once."""
COUNTED_BYTES = 2**16
"""By a process's own clock a larger message counts as so many of this size: it takes as much of the reader's time."""
CUT_OFF_S = 10.0
"""How long a publisher that floods is cut off."""
PAUSE_NS = 1_000_000_000
"""Without excess for so long, a publisher starts anew."""


class RateBudget:
    """A leaky bucket.

    Args:
        rate_hz: Nominal rate of the topic; None for no limit.
    """

    def __init__(self, rate_hz: float | None) -> None:
        self.rate_hz = rate_hz
        self._leak_per_ns = ALLOWANCE * 1e-9 * (rate_hz or 0.0)
        self._epoch: int | None = None
        self._level = 0.0
        self._latest_ns = 0

    def admits(self, epoch: int, published_ns: int, count: float = 1.0) -> bool:
        """Whether a message of that publish time, counted so often, is within the budget, which it then uses up."""
        if self.rate_hz is None:
            return True
        if epoch != self._epoch:
            self._epoch, self._level, self._latest_ns = epoch, 0.0, published_ns
        if published_ns > self._latest_ns:
            self._level = max(0.0, self._level - (published_ns - self._latest_ns) * self._leak_per_ns)
            self._latest_ns = published_ns
        if self._level + count > BURST:
            return False
        self._level += count
        return True


class FloodGuard:
    """Limits the messages of a topic by this process's own clock and their size, whatever stamps they carry.

    Args:
        rate_hz: Limit of the topic; None: all are admitted.

    Attributes:
        excess: Messages beyond the limit without a pause of a second between them.
    """

    def __init__(self, rate_hz: float | None) -> None:
        self._budget = RateBudget(rate_hz)
        self._latest_excess_ns = 0
        self.excess = 0

    @property
    def floods(self) -> bool:
        """Whether the publisher goes on so far beyond the limit that it is to be cut off."""
        return self.excess >= BURST

    def admits(self, n_bytes: int) -> bool:
        """Whether a message of that size that has just arrived is within the limit."""
        now_ns = time.monotonic_ns()
        if self._budget.admits(0, now_ns, max(1.0, n_bytes / COUNTED_BYTES)):
            return True
        paused = now_ns - self._latest_excess_ns > PAUSE_NS
        self.excess = 1 if paused else self.excess + 1
        self._latest_excess_ns = now_ns
        return False

    def reset(self) -> None:
        """Starts anew, once a publisher is no longer cut off."""
        self.excess = 0
