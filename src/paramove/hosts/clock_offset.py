"""How far the clock of another host is ahead of this one's."""

from __future__ import annotations

import math

MOST_SLEW = 5e-4
"""How much NTP makes a monotonic clock faster or slower: the limit of the kernel's adjtime, ntpd and systemd."""
MOST_CRYSTAL_ERROR = 1e-4
"""How much faster or slower a quartz crystal runs by itself."""
_FASTEST, _SLOWEST = 1.0 + MOST_SLEW + MOST_CRYSTAL_ERROR, 1.0 - MOST_SLEW - MOST_CRYSTAL_ERROR
MOST_DRIFT = _FASTEST / _SLOWEST - 1.0
"""How much faster than the other one a clock runs at most: both are slewed, in opposite directions."""
REFERENCE_NS = 10_000_000_000
"""From the first estimate after so long on, the drift is measured."""


class ClockOffset:
    """Offset and drift of a clock, from round trips; times are ns of the two monotonic clocks.

    A reply that was made there at its time t shows that the offset lies between t - received and t - sent. What earlier
    replies have shown holds, too, but for what the clocks may have drifted since: the offset lies where all these
    intervals overlap. So the bound is one and no guess, and the quickest round trips narrow it by themselves. It is
    computed in whole nanoseconds, rounded outwards: the clock of a host that runs for long exceeds a float's precision.

    Attributes:
        jumps: How often no offset fitted all replies: a clock was set or is slewed faster than `MOST_SLEW`, or its
            computer was suspended. It is then estimated anew.
    """

    def __init__(self) -> None:
        self.jumps = 0
        self._low = self._high = self._at_ns = 0
        self._first_ns: int | None = None
        self._reference: tuple[int, int, int] | None = None

    def add(self, sent_ns: int, there_ns: int, received_ns: int) -> None:
        """Take one reply: when it was requested and received here, and when it was made there."""
        drifted = _drifted(received_ns - sent_ns)
        low = there_ns - received_ns - drifted
        high = there_ns - sent_ns + drifted
        before_low, before_high = self._interval(received_ns)
        if self._first_ns is not None and max(low, before_low) > min(high, before_high):
            self.jumps += 1
            self._first_ns = None
        if self._first_ns is None:
            self._first_ns, self._reference = received_ns, None
            self._low, self._high = low, high
        else:
            self._low, self._high = max(low, before_low), min(high, before_high)
        self._at_ns = received_ns
        if self._reference is None and received_ns - self._first_ns > REFERENCE_NS:
            self._reference = received_ns, self._low, self._high

    def _interval(self, now_ns: int) -> tuple[int, int]:
        drifted = _drifted(abs(now_ns - self._at_ns))
        return self._low - drifted, self._high + drifted

    def offset_ns(self, now_ns: int) -> int:
        """Time there minus time here, within `bound_ns`; 0 before the first reply."""
        low, high = self._interval(now_ns)
        return (low + high) // 2

    def bound_ns(self, now_ns: int) -> float:
        """How far from the truth `offset_ns` is at most; infinite before the first reply."""
        low, high = self._interval(now_ns)
        return float("inf") if self._first_ns is None else (high - low) / 2 + 1.0

    @property
    def drift(self) -> tuple[float, float] | None:
        """How much faster the other clock ran since the reference, and how far that is from the truth at most.

        None in the first 20 s.
        """
        if self._reference is None or self._at_ns - self._reference[0] < REFERENCE_NS:
            return None
        at_ns, low, high = self._reference
        since_ns = self._at_ns - at_ns
        least, most = (self._low - high) / since_ns, (self._high - low) / since_ns
        return (least + most) / 2, (most - least) / 2


def _drifted(elapsed_ns: int) -> int:
    """How far two clocks may have drifted apart in a time."""
    return math.ceil(MOST_DRIFT * elapsed_ns)
