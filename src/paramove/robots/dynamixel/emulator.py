"""Emulated servos behind a pseudo-terminal: to any program they are a serial port with a Dynamixel bus."""

from __future__ import annotations

import os
import select
import termios
import threading
import time
import tty
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from paramove.robots.dynamixel.emulated_bus import EmulatedBus
from paramove.robots.dynamixel.emulated_servo import EmulatedServo

BITS_PER_BYTE = 10
"""Start bit, eight bits, stop bit."""
IDLE_S = 0.005
MOST_BYTES = 4096
BAUD_CODES = {getattr(termios, name): int(name[1:]) for name in dir(termios) if name[:1] == "B" and name[1:].isdigit()}


class DynamixelEmulator:
    """Serves a bus at `port` while it is open.

    Answers take as long as their bytes, those of the question and Return Delay Time (9) say. What the line's baud rate
    is, the client has set as at any serial port; servos at another one hear nothing.

    Args:
        servos: In the order of the chain.
        link: A symbolic link to make to the port, so that its name does not change from run to run.
    """

    def __init__(self, servos: Sequence[EmulatedServo], link: Path | None = None) -> None:
        self.bus = EmulatedBus(servos)
        self._link = link
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        self.port = os.ttyname(self._theirs)
        self._began_s = time.monotonic()
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="dynamixel_emulator", daemon=True)
        self.lock = threading.Lock()
        """Held while the servos hear and move; hold it to look at them."""

    def __enter__(self) -> Self:
        if self._link is not None:
            self._link.unlink(missing_ok=True)
            self._link.symlink_to(self.port)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self._stopped.set()
        self._thread.join()
        os.close(self._ours)
        os.close(self._theirs)
        if self._link is not None:
            self._link.unlink(missing_ok=True)

    @property
    def baud_rate(self) -> int:
        """To which the client has set the line, bit/s; 0 for one that the system has no name for."""
        return BAUD_CODES.get(termios.tcgetattr(self._theirs)[5], 0)

    def _now_s(self) -> float:
        return time.monotonic() - self._began_s

    def _serve(self) -> None:
        while not self._stopped.is_set():
            ready, _, _ = select.select([self._ours], [], [], IDLE_S)
            with self.lock:
                self.bus.run_to(self._now_s())
            if ready:
                self._hear(os.read(self._ours, MOST_BYTES))

    def _hear(self, data: bytes) -> None:
        baud_rate, free_s = self.baud_rate, self._now_s()
        with self.lock:
            answers = self.bus.receive(data, baud_rate, free_s)
        byte_s = BITS_PER_BYTE / baud_rate if baud_rate else 0.0
        free_s += len(data) * byte_s  # the bytes were there at once; on a wire they take their time
        for delay_s, answer in answers:
            free_s += delay_s + len(answer) * byte_s
            self._stopped.wait(max(0.0, free_s - self._now_s()))
            os.write(self._ours, answer)
