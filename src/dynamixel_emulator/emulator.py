"""Emulated servos behind a pseudo-terminal, which any program can use as a serial port with a Dynamixel bus."""

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
from dynamixel_emulator.errors import EmulatorError, EmulatorStoppedError
from dynamixel_emulator.mechanics import Mechanics
from dynamixel_emulator.servo import EmulatedServo
from dynamixel_emulator.wire_faults import WireFaults

BITS_PER_BYTE = 10
"""Start bit, eight bits, stop bit."""
IDLE_S = 0.005
"""Polling interval of an idle line, and maximum simulated time that a reply waits for."""
PSEUDO_TERMINALS = "/dev/pts/"
MAX_LAG_S = 0.02
"""Maximum delay of the servos' time behind real time; time lost beyond it is dropped."""
REAL_TIME = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
MAX_BYTES = 4096
HALF_STEP_S = 0.0005
"""Of the mechanics: sums of steps are not exact."""
TCGETS2 = 0x802C542A
"""Reads terminal settings with numeric baud rates (Linux, asm-generic/ioctls.h). Python's `termios` reads only the
predefined rates, which pyserial sets; programs in Rust set numeric ones."""
TIOCGEXCL = 0x80045440
"""Reads whether a program has exclusive access to the terminal (Linux, asm-generic/ioctls.h)."""
TERMIOS2 = struct.Struct("4I B 19s 2I")
"""Input, output, control and local modes, line discipline, control characters, input and output speed."""


class DynamixelEmulator:
    """Context manager that serves a bus at `port`.

    Replies are delayed by the transmission time of request and reply, and by Return Delay Time (9). The client sets the
    baud rate as at any serial port; servos with another baud rate receive nothing. Real servos have their own
    processors: where the system allows it, the thread that serves the port has priority over all other programs.

    Args:
        servos: Servos in the order of the chain.
        link: Path of a symbolic link to the port, so that its name is the same in each run.
        mechanics: Mechanics that the servos move, in the same order; without, the servos have no load.
        servo_rules_only: Whether the checker reports only packets that the servos themselves reject, not jumps of the
            goal, which are common in third-party programs.
        paced: Whether time stands still until `run_to`: requests take no time, and a program that paces it has the
            same run again on any machine, faster than the clock.

    Raises:
        EmulatorError: The path of the link is another file, its folder is missing, or another emulator serves it.

    Attributes:
        faults: Communication faults; may be replaced at any time.
        link: As given.
        port: Name of the terminal; changes with `plug_in`.
    """

    def __init__(
        self,
        servos: Sequence[EmulatedServo],
        link: Path | None = None,
        mechanics: Mechanics | None = None,
        servo_rules_only: bool = False,
        *,
        paced: bool = False,
    ) -> None:
        self.paced = paced
        self.bus = EmulatedBus(servos, mechanics, servo_rules_only)
        self.faults = WireFaults()
        self.lock = threading.Lock()
        """Held while the servos receive and move; hold it to access them."""
        self.link = link
        self._start_s = time.monotonic()
        self._stopped, self._plug_changed = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._serve, name="dynamixel_emulator", daemon=True)
        self._plug_requested = self.plugged_in = False
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
        """Raises EmulatorStoppedError if the thread that serves the port has failed."""
        if self._error is not None:
            raise EmulatorStoppedError(f"the emulated servos have stopped: {self._error}") from self._error

    def run_to(self, time_ns: int) -> None:
        """Lets servos and world run to a time since the start, if it is paced, and in the future; hold the lock.

        Raises EmulatorError if time runs by itself.
        """
        if not self.paced:
            raise EmulatorError("the time of this emulator runs by itself: start it as paced")
        self.bus.run_to(max(self.bus.now_s, 1e-9 * time_ns + HALF_STEP_S))

    def unplug(self) -> None:
        """Removes the port, as if its plug were pulled; the servos keep their power and continue."""
        self._set_plugged_in(False)

    def plug_in(self) -> None:
        """Opens a new port, usually with another name; the link points to it."""
        self._set_plugged_in(True)

    def _set_plugged_in(self, plugged_in: bool) -> None:
        """Asks the thread that serves the port to open or close it between two requests; waits until it has."""
        self._plug_changed.clear()
        self._plug_requested = plugged_in
        while self._thread.is_alive() and self.plugged_in != plugged_in:
            self._plug_changed.wait(IDLE_S)

    def _open(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.port = os.ttyname(self._slave)
        if self.link is not None:
            is_our_link = self.link.is_symlink() and os.readlink(self.link).startswith(PSEUDO_TERMINALS)
            if os.path.lexists(self.link) and not is_our_link:
                raise EmulatorError(
                    f"{self.link} exists and is not a link to a pseudo-terminal: choose another path for the port"
                )
            self.link.unlink(missing_ok=True)
            self.link.symlink_to(self.port)
        self._plug_requested = self.plugged_in = True

    def _close(self) -> None:
        if self.link is not None:  # first: once the terminal is closed, another program may get its name
            self.link.unlink(missing_ok=True)
        os.close(self._master)
        os.close(self._slave)
        self.plugged_in = False

    @property
    def baud_rate(self) -> int:
        """Baud rate that the client has set, bit/s."""
        speed: int = TERMIOS2.unpack(fcntl.ioctl(self._slave, TCGETS2, bytes(TERMIOS2.size)))[-1]
        return speed

    def _now_s(self) -> float:
        return time.monotonic() - self._start_s

    def _serve(self) -> None:
        try:
            self._serve_until_stopped()
        except (RuntimeError, OSError) as error:  # unstable simulation, or terminal removed by the system
            self._error = error

    def _serve_until_stopped(self) -> None:
        dropped_s = 0.0
        _set_priority(True)
        while not self._stopped.is_set():
            if self._plug_requested != self.plugged_in:
                self._open() if self._plug_requested else self._close()
                self._plug_changed.set()
            if self.paced:
                self._reply_at_once()
                continue
            lag_s = self._now_s() - dropped_s - self.bus.now_s
            received, now_s = self._read(max(0.0, min(IDLE_S, IDLE_S - lag_s))), self._now_s()
            with self.lock:
                lag_s = now_s - dropped_s - self.bus.now_s
                if lag_s > MAX_LAG_S:
                    dropped_s += lag_s - MAX_LAG_S
                    _set_priority(time.thread_time() < 0.5 * now_s)  # no priority for a simulation that is too slow
                self.bus.run_to(min(now_s - dropped_s, self.bus.now_s + IDLE_S))
                replies = self.bus.receive(received, self.baud_rate, now_s) if received else []
            if received:
                self._send(received, self.faults.apply(received, replies), now_s)

    def _reply_at_once(self) -> None:
        received = self._read(IDLE_S)
        with self.lock:
            replies = self.bus.receive(received, self.baud_rate, self.bus.now_s) if received else []
        for _, reply in self.faults.apply(received, replies):
            self._write(reply)

    def _read(self, timeout_s: float) -> bytes:
        """Bytes from the client; waits at most this time for them."""
        if not self.plugged_in:
            self._stopped.wait(timeout_s)
            return b""
        ready, _, _ = select.select([self._master], [], [], timeout_s)
        if not ready and timeout_s > 0.0:
            self._release_exclusive_access()
        return os.read(self._master, MAX_BYTES) if ready else b""

    def _release_exclusive_access(self) -> None:
        """Releases the exclusive access of a program that was killed; such programs also hold a file lock on the port.

        A real port releases it when the last program closes it, but the emulator itself keeps the terminal open.
        """
        if not struct.unpack("i", fcntl.ioctl(self._slave, TIOCGEXCL, bytes(4)))[0]:
            return
        with contextlib.suppress(BlockingIOError):
            fcntl.flock(self._slave, fcntl.LOCK_EX | fcntl.LOCK_NB)
            fcntl.ioctl(self._slave, termios.TIOCNXCL)
            fcntl.flock(self._slave, fcntl.LOCK_UN)

    def _send(self, request: bytes, replies: list[tuple[float, bytes]], received_s: float) -> None:
        """Writes the replies at the times at which a serial line would have transmitted them."""
        byte_s = BITS_PER_BYTE / self.baud_rate if self.baud_rate else 0.0
        line_free_s = received_s + len(request) * byte_s  # a pseudo-terminal has no transmission time
        for delay_s, reply in replies:
            line_free_s += delay_s + len(reply) * byte_s
            wait_s = line_free_s - self._now_s()
            if wait_s > 0.0:
                self._stopped.wait(wait_s)
            self._write(reply)

    def _write(self, reply: bytes) -> None:
        with contextlib.suppress(BlockingIOError):  # unread replies are dropped when the port is full
            os.write(self._master, reply)


def _set_priority(real_time: bool) -> None:
    """Gives the calling thread real-time or normal priority, where the system allows it."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, REAL_TIME if real_time else os.SCHED_OTHER, os.sched_param(int(real_time)))


def _claim(link: Path) -> socket.socket:
    """Reserves this link for one emulator on this machine, until the socket is closed or the program ends."""
    if not link.absolute().parent.is_dir():
        raise EmulatorError(f"there is no folder for the port {link}: create it", missing=True)
    claim = socket.socket(socket.AF_UNIX)
    name = hashlib.sha256(os.fsencode(link.absolute())).hexdigest()
    try:
        claim.bind(f"\0dynamixel-emulator-{name}")  # abstract socket: leaves no file behind
    except OSError as error:
        claim.close()
        if error.errno != errno.EADDRINUSE:
            raise
        raise EmulatorError(
            f"{link} is the port of another running emulator: stop that one, or choose another path"
        ) from None
    return claim
