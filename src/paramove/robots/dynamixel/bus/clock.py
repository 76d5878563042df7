"""The time of an arm's loop: the machine's monotonic clock, or that of emulated servos which stand still meanwhile."""

from __future__ import annotations

import socket
import time
from pathlib import Path
from typing import Protocol

REPLY_TIMEOUT_S = 10.0
"""A world that is large, on a busy machine, needs tenths of a second."""


def pacing_socket(bus_folder: Path, namespace: str = "") -> Path:
    """Control socket of the emulated servos of a run in lockstep: in its bus folder, whose path is short enough."""
    return bus_folder / ".".join(filter(None, (namespace, "servo_time")))


class ClockLostError(OSError):
    """The emulator that keeps the time went away."""


class Clock(Protocol):
    """Gives the time, and waits."""

    @property
    def now_ns(self) -> int:
        """The time."""

    def wait_until(self, due_ns: int) -> None:
        """Waits, unless it is later. Raises ClockLostError."""


class MonotonicClock:
    """The machine's."""

    @property
    def now_ns(self) -> int:
        """Of the monotonic clock."""
        return time.monotonic_ns()

    def wait_until(self, due_ns: int) -> None:
        """Sleeps."""
        time.sleep(max(0.0, 1e-9 * (due_ns - time.monotonic_ns())))


class EmulatorClock:
    """That of a paced emulator: to wait is to let its servos and their world run.

    Args:
        control: Its control socket.
    """

    def __init__(self, control: Path) -> None:
        self.now_ns = 0
        self._control = control
        self._socket: socket.socket | None = None

    def wait_until(self, due_ns: int) -> None:
        """Lets the world run. Raises ClockLostError."""
        if due_ns <= self.now_ns:
            return
        try:
            if self._socket is None:
                self._socket = socket.socket(socket.AF_UNIX)
                self._socket.settimeout(REPLY_TIMEOUT_S)
                self._socket.connect(str(self._control))
            self._socket.sendall(b"run %d\n" % due_ns)
            reply = self._socket.recv(4096).decode(errors="replace").strip()
        except OSError as error:
            raise ClockLostError(f"the emulator at {self._control} does not keep the time: {error}") from error
        if reply != "ok":
            raise ClockLostError(f"the emulator at {self._control} does not keep the time: {reply or 'it has ended'}")
        self.now_ns = due_ns

    def close(self) -> None:
        """Disconnects."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
