"""What the gate watches over several steps: the emergency stop, how joints follow, how often messages come."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats
from paramove.safety.gate_io import Fault, Measured

RATE_WINDOW_NS = 250_000_000
RATE_FACTOR = 1.2


class EmergencyWatch:
    """Whether the emergency stop is pressed; a source that has sent nothing for `timeout_ms` counts as pressed."""

    def __init__(self, timeout_ms: float | None, start_ns: int) -> None:
        self._timeout_ms = timeout_ms
        self._received_ns = start_ns
        self._pressed = False

    def fault(self, now_ns: int, pressed: bool | None) -> Fault | None:
        """Take what the source sent, None: nothing; its latest state stays until the next."""
        if pressed is not None:
            self._received_ns, self._pressed = now_ns, pressed
        self._received_ns = min(self._received_ns, now_ns)
        if self._pressed:
            return Fault("emergency_stop", "", "the emergency stop is pressed; release it, then arm again")
        age_ms = (now_ns - self._received_ns) * 1e-6
        if self._timeout_ms is None or age_ms <= self._timeout_ms:
            return None
        message = (
            f"no data from the emergency stop for {age_ms:.0f} ms, allowed {self._timeout_ms:.0f} ms: it counts as "
            "pressed; restart its source, then arm again"
        )
        return Fault("emergency_silent", "", message)


class FollowingWatch:
    """Whether joints follow their commands. `allowed` [J], rad; None: not watched."""

    def __init__(self, names: tuple[str, ...], allowed: Floats | None, timeout_ms: float) -> None:
        self._names = names
        self._allowed = allowed
        self._timeout_ns = round(timeout_ms * 1e6)
        self._since_ns = np.full(len(names), -1, dtype=np.int64)

    def away(self, measured: Measured) -> NDArray[np.bool_]:
        """Which joints are too far away now, [J]; one that is not known is."""
        if self._allowed is None:
            return np.zeros(len(self._names), dtype=bool)
        return np.asarray(~(np.abs(measured.positions - measured.commanded) <= self._allowed))

    def fault(self, measured: Measured) -> Fault | None:
        """The joint that has been too far away for too long, with this report; None: no joint."""
        away = self.away(measured)
        self._since_ns = np.where(away, np.where(self._since_ns < 0, measured.captured_ns, self._since_ns), -1)
        overdue = away & (measured.captured_ns - self._since_ns >= self._timeout_ns)
        if self._allowed is None or not overdue.any():
            return None
        joint = int(np.argmax(overdue))
        error = np.rad2deg(abs(measured.positions[joint] - measured.commanded[joint]))
        message = (
            f"joint {self._names[joint]} has been {error:.2f} deg from its commanded position for "
            f"{self._timeout_ns * 1e-6:.0f} ms, allowed {np.rad2deg(self._allowed[joint]):.2f} deg; "
            "see what blocks it, then arm again"
        )
        return Fault("following", self._names[joint], message)


class RateWatch:
    """Whether something comes more often than 1.2 times its nominal rate, over 250 ms; None: not counted."""

    def __init__(self, per_s: float | None) -> None:
        self.allowed = 0 if per_s is None else max(1, int(RATE_FACTOR * per_s * RATE_WINDOW_NS * 1e-9))
        self._times: deque[int] = deque(maxlen=self.allowed + 1)

    def exceeded(self, now_ns: int) -> bool:
        """Count one more."""
        if not self.allowed:
            return False
        self._times.append(now_ns)
        return len(self._times) > self.allowed and 0 <= now_ns - self._times[0] < RATE_WINDOW_NS
