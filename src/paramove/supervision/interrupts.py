"""Ctrl-C, Ctrl-Z, SIGTERM and a closed terminal, as facts that a loop can look at."""

from __future__ import annotations

import os
import signal
from types import FrameType, TracebackType
from typing import Any, Self

_ENDS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_SUSPENDS = (signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU)


class Interrupts:
    """While the block lasts, the signals that end a run are counted instead of ending the process.

    Those by which a terminal suspends a process do not suspend it: the nodes would go on, with nobody to end them.

    Attributes:
        first: The first of these signals, None before.
        urgent: Whether SIGINT or SIGTERM came once more: end everything at once. A closed terminal may send several
            SIGHUP, so these do not count.
        suspended: Whether somebody has pressed Ctrl-Z; reset by whoever says why that does nothing.
        wake_fd: Readable after a signal, and when a child process has ended, was stopped (SIGSTOP) or goes on.
    """

    def __init__(self) -> None:
        self.first: signal.Signals | None = None
        self.urgent = False
        self.suspended = False
        self.wake_fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        for number in _ENDS:
            self._before[number] = signal.signal(number, self._handle)
        for number in _SUSPENDS:
            self._before[number] = signal.signal(number, self._suspend)
        self._before[signal.SIGCHLD] = signal.signal(signal.SIGCHLD, self._wake)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        os.close(self.wake_fd)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self.first is None:
            self.first = signal.Signals(number)
        elif number != signal.SIGHUP:
            self.urgent = True
        self._wake(number, frame)

    def _suspend(self, number: int, frame: FrameType | None) -> None:
        self.suspended = True
        self._wake(number, frame)

    def _wake(self, number: int, frame: FrameType | None) -> None:
        os.eventfd_write(self.wake_fd, 1)
