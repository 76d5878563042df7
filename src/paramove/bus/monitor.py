"""What libzmq reports about the connections of a socket."""

from __future__ import annotations

import logging
import struct
import time
from collections.abc import Iterator
from typing import Any

import zmq

_log = logging.getLogger(__name__)

_EVENTS = int(zmq.EVENTS)
_HEAD = struct.Struct("=hi")
_READ_AT_ONCE = 2000
WARNING_PERIOD_S = 60.0
HANDSHAKE_MS = 2000
"""Timeout of a connection's ZeroMQ handshake."""


def can_read(socket: zmq.Socket[Any]) -> bool:
    """Whether a message is waiting. Cheaper than to receive and catch `zmq.Again`."""
    return bool(socket.getsockopt(_EVENTS) & 1)  # type: ignore[operator]  # POLLIN; enums would cost more


class Monitor:
    """Events of one socket.

    Args:
        socket: Of any kind, before it is bound or connected.
        events: Mask of `zmq.EVENT_...`.
    """

    def __init__(self, socket: zmq.Socket[Any], events: int) -> None:
        self._watched = socket
        endpoint = f"inproc://monitor-{id(self)}-{time.monotonic_ns()}"
        socket.monitor(endpoint, events)
        self._socket: zmq.Socket[Any] = socket.context.socket(zmq.PAIR)
        # Without a limit: libzmq's own thread, which serves all sockets, would wait for us to read.
        self._socket.setsockopt(zmq.RCVHWM, 0)
        self._socket.setsockopt(zmq.LINGER, 0)
        self._socket.connect(endpoint)

    def events(self) -> Iterator[int]:
        """Those that have come since the last call, at most 2000."""
        for _ in range(_READ_AT_ONCE):
            if not can_read(self._socket):
                return
            number, _ = _HEAD.unpack(self._socket.recv_multipart()[0])
            yield number

    def close(self) -> None:
        """To be called before the watched socket is closed."""
        if self._socket.closed:
            return
        self._watched.disable_monitor()
        self._socket.close(linger=0)


class ForeignConnections:
    """Counts connections to a bound socket that do not speak ZeroMQ, such as a browser or a port scanner.

    libzmq ends them by itself; other connections are not affected. They are logged in one line a minute at most.

    Args:
        socket: Before it is bound.
        name: Of the topic or service, for the log.

    Attributes:
        count: How many there were; includes connections whose handshake is still in progress.
    """

    def __init__(self, socket: zmq.Socket[Any], name: str) -> None:
        socket.setsockopt(zmq.HANDSHAKE_IVL, HANDSHAKE_MS)
        # With a domain, even without an authenticator, libzmq rejects peers of ZMTP 1. It takes any bytes for such a
        # peer and aborts the whole process when it meets one while the socket closes.
        socket.setsockopt(zmq.ZAP_DOMAIN, b"paramove")
        self._monitor = Monitor(socket, zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_ACCEPTED)
        self._name = name
        self.count = 0
        self._before = 0
        self._reported = 0
        self._warning_due_s = 0.0

    def look(self) -> None:
        """Counts what has happened since the last call; to be called a few times a second."""
        for event in self._monitor.events():
            self.count += 1 if event == zmq.EVENT_ACCEPTED else -1
        certain, self._before = min(self.count, self._before), self.count
        if certain > self._reported and time.monotonic() >= self._warning_due_s:
            self._warning_due_s = time.monotonic() + WARNING_PERIOD_S
            self._reported = certain
            _log.warning(
                "topic %s: %d connections to its socket did not speak ZeroMQ and were ended; only nodes and paramove's "
                "own commands may connect there",
                self._name,
                certain,
            )

    def close(self) -> None:
        """To be called before the socket is closed."""
        self._monitor.close()
