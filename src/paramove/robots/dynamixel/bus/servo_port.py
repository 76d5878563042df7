# ruff: noqa: N802 - the packet handlers of dynamixel-sdk call these names
"""The serial port of a Dynamixel bus, instead of the SDK's PortHandler and without its faults.

The SDK's (4.1.0) stays busy for ever after an unplugged cable, waits 34 ms for a servo that is not there, uses the
wall clock, spins while it waits, lets a second program open the port, and sends FF FF FD within a packet bare.
pyserial's own writing spins for ever at an adapter that hangs.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import select
import termios
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

import serial

from paramove.devices import holders, serial_remedy
from paramove.documents import InputError
from paramove.robots.dynamixel.bus.clock import Clock, MonotonicClock
from paramove.robots.dynamixel.bus.packets import BEFORE_INSTRUCTION, BEFORE_LENGTH, HEADER, Packet, encoded
from paramove.robots.dynamixel.bus.serial_adapters import default_by_id, serial_adapters

BITS_PER_BYTE = 10
SLOWEST, FASTEST = 9_600, 4_500_000
"""bit/s, of all baud rates of Dynamixel servos (e-Manual, "Baud Rate")."""
LATENCY_S = 0.004
"""Beyond the time of the bytes and the servo's own delay; an adapter with a latency timer of 16 ms needs more."""
LONGEST_RETURN_DELAY_S = 254 * 2e-6
LONGEST_WRITE_S = 0.5
"""An adapter that hangs takes some thousand bytes, and then no more."""


class PortLostError(OSError):
    """The port went away while it was open: unplugged, or its adapter failed."""


class ServoPort:
    """A port that is open while it is a context, for one program at a time.

    Args:
        name: For example /dev/ttyUSB0, or a link in /dev/serial/by-id.
        baud_rate: bit/s.
        latency_s: That a reply may take beyond the time of its bytes.
        clock: The time of what is read; replies are awaited by the machine's in any case.

    Attributes:
        is_using: Whether an exchange is under way; the packet handlers set it.
        low_latency: Whether the adapter was set to hand over bytes at once; a pseudo-terminal has no such setting.
        timeout_s: Of the last wait for a reply.
        return_delay_s: That a servo may take before it replies; the longest that can be set, until it is known.
    """

    def __init__(
        self, name: str, baud_rate: int = 1_000_000, latency_s: float = LATENCY_S, clock: Clock | None = None
    ) -> None:
        self.clock = clock or MonotonicClock()
        self.name, self.baud_rate, self.latency_s = name, baud_rate, latency_s
        self.is_using = False
        self.low_latency = False
        self.return_delay_s = LONGEST_RETURN_DELAY_S
        self.timeout_s = 0.0
        self._due_s = 0.0
        self._sent_bytes = 0
        self._serial: Any = None

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def open(self) -> None:
        """Raises InputError, with the remedy, for a port that is missing, forbidden or in use, or a wrong baud rate."""
        self.close()
        _check_baud_rate(self.baud_rate)
        try:
            self._serial = serial.Serial(self.name, self.baud_rate, timeout=0, exclusive=True)
            fcntl.ioctl(self._serial.fd, termios.TIOCEXCL)  # others than pyserial, such as the SDK and the Wizard
        except serial.SerialException as error:
            raise InputError(_reason(self.name, error), missing=error.errno == errno.ENOENT) from error
        self.is_using, self.low_latency = False, True
        try:
            self._serial.set_low_latency_mode(True)
        except (ValueError, OSError):  # not every adapter has such a mode
            self.low_latency = False

    @property
    def device(self) -> Path:
        """What was opened, whatever `name` leads to by now. Raises PortLostError."""
        return Path(self._do(lambda port: os.ttyname(port.fd)))

    def close(self) -> None:
        """Also after a loss; a second time does nothing."""
        port, self._serial = self._serial, None
        self.is_using = False
        if port is not None:
            with contextlib.suppress(OSError, TypeError):  # a lost one may fail, or have no descriptor any more
                fcntl.ioctl(port.fd, termios.TIOCNXCL)  # the terminal would stay exclusive while anybody has it open
            with contextlib.suppress(OSError):
                port.close()

    def getBaudRate(self) -> int:
        """For the packet handlers."""
        return self.baud_rate

    def setBaudRate(self, baudrate: int) -> bool:
        """Of the line, from now on. Raises InputError for one that servos do not have, and PortLostError."""
        _check_baud_rate(baudrate)
        self.baud_rate = baudrate
        if self._serial is not None:
            self._do(lambda port: setattr(port, "baudrate", baudrate))
        return True

    def clearPort(self) -> None:
        """Drop what came in late."""
        self._do(lambda port: port.reset_input_buffer())

    def writePort(self, packet: Sequence[int]) -> int:
        """Send a packet that is not stuffed, stuffed where it must be; returns the length of the given one."""
        data = bytes(packet)
        content = data[BEFORE_INSTRUCTION:-2]
        if HEADER in content:
            data = encoded(Packet(data[BEFORE_LENGTH - 1], content[0], content[1:]))
        self._do(lambda port: _write(port, data))
        self._sent_bytes = len(data)
        return len(packet)

    def readPort(self, length: int) -> bytes:
        """At most so many bytes, waiting for the first of them until the reply is overdue."""
        return bytes(self._do(lambda port: self._read(port, length)))

    def _read(self, port: Any, length: int) -> bytes:
        ready, _, _ = select.select([port.fd], [], [], max(0.0, self._due_s - time.monotonic()))
        if not ready:
            return b""
        data = os.read(port.fd, length)
        if not data:
            raise OSError(errno.EIO, "end of file")
        return data

    def setPacketTimeout(self, packet_length: int, answers: int = 1, timeout_s: float = 0.0) -> None:
        """For so many bytes of so many replies to what was just sent, and so much longer, from now on."""
        wire_s = (self._sent_bytes + packet_length) * BITS_PER_BYTE / self.baud_rate
        self._wait_for(wire_s + answers * self.return_delay_s + self.latency_s + timeout_s)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        """For a reply that takes at most so long, from now on."""
        self._wait_for(1e-3 * msec)

    def isPacketTimeout(self) -> bool:
        """Whether the reply is overdue."""
        return time.monotonic() >= self._due_s

    def _wait_for(self, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self._due_s = time.monotonic() + timeout_s

    def _do(self, work: Any) -> Any:
        if self._serial is None:
            raise PortLostError(f"{self.name} is not open")
        try:
            return work(self._serial)
        except (OSError, termios.error, TypeError) as error:  # pyserial has all of them for a port that went away
            self.close()
            raise PortLostError(f"{self.name} went away ({_text(error)}): is its cable plugged in?") from error


def _write(port: Any, data: bytes) -> None:
    """All of it, as soon as there is room."""
    ends_s = time.monotonic() + LONGEST_WRITE_S
    while data:
        with contextlib.suppress(BlockingIOError):
            data = data[os.write(port.fd, data) :]
        left_s = ends_s - time.monotonic()
        if data and (left_s <= 0.0 or not select.select([], [port.fd], [], left_s)[1]):
            with contextlib.suppress(termios.error):
                port.reset_output_buffer()  # else closing it waits for ever, too
            raise OSError(errno.ETIMEDOUT, f"it took no byte for {LONGEST_WRITE_S:g} s")


def _check_baud_rate(baud_rate: int) -> None:
    if not SLOWEST <= baud_rate <= FASTEST:
        raise InputError(f"the baud rate of a servo is {SLOWEST} to {FASTEST} bit/s, found {baud_rate}")


def _reason(name: str, error: serial.SerialException) -> str:
    if error.errno == errno.ENOENT:
        found = ", ".join(str(one.link) for one in serial_adapters()) or f"none in {default_by_id()}"
        return f"no serial port {name}, found are: {found}. Plug in the adapter; `paramove arm scan` lists all of them"
    if error.errno == errno.EACCES:
        return f"{name} may not be opened by this user: {'; '.join(serial_remedy(Path(name).resolve()))}"
    if error.errno in (errno.EAGAIN, errno.EBUSY):
        held = holders(Path(name))
        if not held:
            return f"{name} is in use by another program: close it (sudo lsof {name} names it)"
        return f"{name} is in use by {', '.join(map(str, held))}: end it in its terminal, or: kill {held[0].pid}"
    if error.errno == errno.EISDIR or "Could not configure port" in str(error):
        return f"{name} is no serial port but something else: name a link in /dev/serial/by-id"
    return f"{name} cannot be opened as a serial port: {error}"


def _text(error: Exception) -> str:
    """Without the number; termios and the system give number and text as two arguments."""
    return str(error.args[-1]) if error.args else type(error).__name__
