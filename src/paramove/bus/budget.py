"""How fast a topic may come.

A publisher gone wild must not take its subscribers' time. Time is read from the messages' own stamps, on the bus clock:
so a subscriber that was busy for a while, or simulated time that runs fast, breaks no budget.
"""

from __future__ import annotations

ALLOWANCE = 1.2
"""Times the topic's nominal rate."""
BURST = 20
"""Messages beyond that at once."""


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

    def admits(self, epoch: int, published_ns: int) -> bool:
        """Whether a message of that publish time is within the budget, which it then uses up."""
        if self.rate_hz is None:
            return True
        if epoch != self._epoch:
            self._epoch, self._level, self._latest_ns = epoch, 0.0, published_ns
        if published_ns > self._latest_ns:
            self._level = max(0.0, self._level - (published_ns - self._latest_ns) * self._leak_per_ns)
            self._latest_ns = published_ns
        if self._level + 1 > BURST:
            return False
        self._level += 1
        return True
