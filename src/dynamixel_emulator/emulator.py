"""Emulated servos behind a pseudo-terminal: to any program they are a serial port with a Dynamixel bus."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import hashlib
import os
import select
import socket
import struct
import termios
import threading
import time
import tty
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from dynamixel_emulator.bus import EmulatedBus
from dynamixel_emulator.errors import EmulatorError
from dynamixel_emulator.mechanics import Mechanics
from dynamixel_emulator.servo import EmulatedServo
from dynamixel_emulator.wire_faults import WireFaults

BITS_PER_BYTE = 10
"""Start bit, eight bits, stop bit."""
IDLE_S = 0.005
PSEUDO_TERMINALS = "/dev/pts/"
"""Between two looks at a quiet line, and of the servos' time at most before what was heard is answered."""
LATE_S = 0.02
"""So much the servos' time may be behind; what the system does not let them have beyond, passes them by."""
FIRST = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
MAX_BYTES = 4096
TCGETS2 = 0x802C542A
"""Settings of a line with its rates as numbers (Linux, asm-generic/ioctls.h). Python's `termios` reads only rates that
have a name; pyserial sets those, programs in Rust set numbers."""
TIOCGEXCL = 0x80045440
"""Whether a program has asked to be the only one at the line (Linux, asm-generic/ioctls.h)."""
TERMIOS2 = struct.Struct("4I B 19s 2I")
"""Input, output, control and local modes, line discipline, control characters, input and output speed."""


class DynamixelEmulator:
    """Serves a bus at `port` while it is open.

    Answers take as long as their bytes, those of the question and Return Delay Time (9) say. What the line's baud rate
    is, the client has set as at any serial port; servos at another one hear nothing. Real servos have processors of
    their own: where the system allows it, the thread that serves the port runs before all other programs.

    Args:
        servos: In the order of the chain.
        link: A symbolic link to make to the port, so that its name does not change from run to run.
        mechanics: What the servos move, in the same order; without, each carries nothing.
        servo_rules_only: Whether the judge finds only what the servos themselves reject, not jumps: for the programs of
            others.

    Raises:
        EmulatorError: Something else is at the path of the link, or another emulator serves it.

    Attributes:
        faults: What goes wrong on the wire; may be replaced at any time.
        link: As given.
        port: Name of the terminal; another one after `plug_in`.
    """

    def __init__(
        self,
        servos: Sequence[EmulatedServo],
        link: Path | None = None,
        mechanics: Mechanics | None = None,
        servo_rules_only: bool = False,
    ) -> None:
        self.bus = EmulatedBus(servos, mechanics, servo_rules_only)
        self.faults = WireFaults()
        self.lock = threading.Lock()
        """Held while the servos hear and move; hold it to look at them."""
        self.link = link
        self._began_s = time.monotonic()
        self._stopped, self._moved = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._serve, name="dynamixel_emulator", daemon=True)
        self._wanted = self.plugged_in = False
        self._error: Exception | None = None
        with contextlib.ExitStack() as claimed:
            if link is not None:
                claimed.enter_context(_claim(link))
            self._open()
            self._claimed = claimed.pop_all()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self._stopped.set()
        self._thread.join()
        if self.plugged_in:
            self._close()
        self._claimed.close()

    def check(self) -> None:
        """Raises RuntimeError if the thread that serves the port has ended by an error."""
        if self._error is not None:
            raise RuntimeError(f"the emulated servos have stopped: {self._error}") from self._error

    def unplug(self) -> None:
        """Takes the port away, as if its plug were pulled; the servos keep their power and go on."""
        self._move_plug(False)

    def plug_in(self) -> None:
        """A new port, usually of another name; the link leads to it."""
        self._move_plug(True)

    def _move_plug(self, wanted: bool) -> None:
        """The thread that serves the port does it, between two questions; returns when it is done."""
        self._moved.clear()
        self._wanted = wanted
        while self._thread.is_alive() and self.plugged_in != wanted:
            self._moved.wait(IDLE_S)

    def _open(self) -> None:
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self.port = os.ttyname(self._theirs)
        if self.link is not None:
            ours = self.link.is_symlink() and os.readlink(self.link).startswith(PSEUDO_TERMINALS)
            if os.path.lexists(self.link) and not ours:
                raise EmulatorError(
                    f"{self.link} is there already and no link to a pseudo-terminal: name another path for the port"
                )
            self.link.unlink(missing_ok=True)
            self.link.symlink_to(self.port)
        self._wanted = self.plugged_in = True

    def _close(self) -> None:
        if self.link is not None:  # first: the terminal's name may be another program's as soon as it is closed
            self.link.unlink(missing_ok=True)
        os.close(self._ours)
        os.close(self._theirs)
        self.plugged_in = False

    @property
    def baud_rate(self) -> int:
        """To which the client has set the line, bit/s."""
        speed: int = TERMIOS2.unpack(fcntl.ioctl(self._theirs, TCGETS2, bytes(TERMIOS2.size)))[-1]
        return speed

    def _now_s(self) -> float:
        return time.monotonic() - self._began_s

    def _serve(self) -> None:
        try:
            self._serve_until_stopped()
        except (RuntimeError, OSError) as error:  # a world that broke, a terminal that the system took away
            self._error = error

    def _serve_until_stopped(self) -> None:
        lost_s = 0.0
        _go_first(True)
        while not self._stopped.is_set():
            if self._wanted != self.plugged_in:
                self._open() if self._wanted else self._close()
                self._moved.set()
            behind_s = self._now_s() - lost_s - self.bus.now_s
            heard, now_s = self._read(max(0.0, min(IDLE_S, IDLE_S - behind_s))), self._now_s()
            with self.lock:
                behind_s = now_s - lost_s - self.bus.now_s
                if behind_s > LATE_S:
                    lost_s += behind_s - LATE_S
                    _go_first(time.thread_time() < 0.5 * now_s)  # not a world that is too slow for this machine
                self.bus.run_to(min(now_s - lost_s, self.bus.now_s + IDLE_S))
                answers = self.bus.receive(heard, self.baud_rate, now_s) if heard else []
            if heard:
                self._say(heard, self.faults.told(heard, answers), now_s)

    def _read(self, within_s: float) -> bytes:
        """What the client has written, waiting so long for it."""
        if not self.plugged_in:
            self._stopped.wait(within_s)
            return b""
        ready, _, _ = select.select([self._ours], [], [], within_s)
        if not ready and within_s > 0.0:
            self._forget_who_was_killed()
        return os.read(self._ours, MAX_BYTES) if ready else b""

    def _forget_who_was_killed(self) -> None:
        """A program that was the only one at the line, and is no more, leaves it closed to others while it is open.

        A real one would not be: nobody else has it open, as this emulator has. Such programs hold a lock on it, too.
        """
        if not struct.unpack("i", fcntl.ioctl(self._theirs, TIOCGEXCL, bytes(4)))[0]:
            return
        with contextlib.suppress(BlockingIOError):
            fcntl.flock(self._theirs, fcntl.LOCK_EX | fcntl.LOCK_NB)
            fcntl.ioctl(self._theirs, termios.TIOCNXCL)
            fcntl.flock(self._theirs, fcntl.LOCK_UN)

    def _say(self, question: bytes, answers: list[tuple[float, bytes]], heard_s: float) -> None:
        byte_s = BITS_PER_BYTE / self.baud_rate if self.baud_rate else 0.0
        free_s = heard_s + len(question) * byte_s  # it was there at once; on a wire it takes its time
        for delay_s, answer in answers:
            free_s += delay_s + len(answer) * byte_s
            early_s = free_s - self._now_s()
            if early_s > 0.0:
                self._stopped.wait(early_s)
            with contextlib.suppress(BlockingIOError):  # a client that never reads loses what its port cannot hold
                os.write(self._ours, answer)


def _go_first(first: bool) -> None:
    """Where the system allows it, the calling thread runs before all others, or like any other."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, FIRST if first else os.SCHED_OTHER, os.sched_param(int(first)))


def _claim(link: Path) -> socket.socket:
    """Keeps other emulators from this link, also those of other programs, until it is closed or its program ends."""
    claim = socket.socket(socket.AF_UNIX)
    name = hashlib.sha256(os.fsencode(link.absolute())).hexdigest()
    try:
        claim.bind(f"\0dynamixel-emulator-{name}")  # of the system, not of a folder: nothing is left behind
    except OSError as error:
        claim.close()
        if error.errno != errno.EADDRINUSE:
            raise
        raise EmulatorError(
            f"{link} is the port of another emulator, which is running: end that one, or name another path"
        ) from None
    return claim
