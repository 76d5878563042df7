"""Hears one topic."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import zmq
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from zmq.utils.monitor import parse_monitor_message

from paramove.bus.endpoint import can_read, socket_path
from paramove.bus.envelope import SIZE, Envelope, Reason, RefusedError, unpack
from paramove.bus.schema_hash import schema_hash
from paramove.bus.sequence import Arrival, SequenceCounter
from paramove.bus.topics import Topic

_log = logging.getLogger(__name__)

DEAF_AFTER_S = 0.3
"""A socket that was disconnected and has not tried again for so long never will."""


@dataclass(frozen=True)
class Heard:
    """One message.

    Attributes:
        topic: Row of the table.
        message: Decoded.
        captured_ns: When what it tells of was so, ns of the bus clock.
        published_ns: When it was said.
        sequence: Of its publisher's epoch.
        payload: The encoded message, for those who store it.
    """

    topic: Topic
    message: Any
    captured_ns: int
    published_ns: int
    sequence: int
    payload: bytes = field(default=b"", repr=False, compare=False)


class Subscriber:
    """Hears a topic, whether its speaker is there already or comes later, and counts exactly what it misses.

    Args:
        context: libzmq context.
        folder: Bus folder.
        topic: Row of the table.
        name: Name on the bus where it differs from the topic's (a remap).
    """

    def __init__(self, context: zmq.Context[Any], folder: Path, topic: Topic, name: str | None = None) -> None:
        self.topic = topic
        self.name = name or topic.name
        self.counter = SequenceCounter()
        self.connected = False
        self.reopened = 0
        self._context = context
        self._endpoint = f"ipc://{socket_path(folder, self.name)}"
        self._frame = self.name.encode() + b"\0"
        self._schema = schema_hash(topic.type)
        self._disconnected_s: float | None = None
        self._open()

    @property
    def welcomed(self) -> bool:
        """Whether the speaker has answered: nothing said from now on is missed without being counted."""
        return self.counter.epoch is not None

    def receive(self) -> Heard | None:
        """Next new message, or None if none is waiting. Repeated and refused ones are counted and passed over."""
        while True:
            raw = self.receive_raw()
            if raw is None:
                return None
            envelope, payload = raw
            try:
                message = self.topic.type.FromString(payload)
            except (DecodeError, ValueError) as error:
                self.counter.messages -= 1
                self._refuse(RefusedError(Reason.DECODE, f"payload is no {self.topic.type_name}: {error}"))
                continue
            return Heard(self.topic, message, envelope.captured_ns, envelope.published_ns, envelope.sequence, payload)

    def receive_raw(self) -> tuple[Envelope, bytes] | None:
        """Like `receive`, with the payload left encoded."""
        while can_read(self.socket):
            frames = self.socket.recv_multipart(zmq.NOBLOCK)
            try:
                envelope = self._check(frames)
            except RefusedError as error:
                self._refuse(error)
                continue
            if self.counter.accept(envelope) is Arrival.NEW:
                return envelope, frames[2]
        return None

    def is_deaf(self) -> bool:
        """Whether libzmq has given the connection up for good, so that only `reopen` helps.

        To be asked a few times a second. libzmq drops a connection for ever when a message exceeds MAXMSGSIZE or the
        other side does not speak its protocol. Also keeps `connected` up to date.
        """
        while self._monitor.poll(0):
            event = parse_monitor_message(self._monitor.recv_multipart(zmq.NOBLOCK))["event"]
            if event == zmq.EVENT_DISCONNECTED:
                self.connected, self._disconnected_s = False, time.monotonic()
            elif event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
                self.connected, self._disconnected_s = True, None
            else:  # it tries again
                self._disconnected_s = None
        return self._disconnected_s is not None and time.monotonic() - self._disconnected_s > DEAF_AFTER_S

    def reopen(self) -> None:
        """Closes the socket and opens another. Counts go on: what is missed meanwhile is a loss."""
        self.close()
        self.connected = False
        self._open()
        self.reopened += 1

    def close(self) -> None:
        """Closes the socket; messages not yet received are gone."""
        self.socket.disable_monitor()
        self._monitor.close(linger=0)
        self.socket.close(linger=0)

    def _open(self) -> None:
        self._disconnected_s = None
        self.socket: zmq.Socket[Any] = self._context.socket(zmq.SUB)
        self.socket.setsockopt(zmq.RCVHWM, self.topic.high_water_mark)
        self.socket.setsockopt(zmq.MAXMSGSIZE, max(self.topic.max_bytes, SIZE))
        self.socket.setsockopt(zmq.RECONNECT_IVL, 20)
        self.socket.setsockopt(zmq.RECONNECT_IVL_MAX, 200)
        self._monitor: zmq.Socket[Any] = self.socket.get_monitor_socket(
            zmq.EVENT_DISCONNECTED
            | zmq.EVENT_CONNECT_RETRIED
            | zmq.EVENT_CONNECT_DELAYED
            | zmq.EVENT_CONNECTED
            | zmq.EVENT_HANDSHAKE_SUCCEEDED
        )
        self.socket.connect(self._endpoint)
        self.socket.setsockopt(zmq.SUBSCRIBE, self._frame)

    def _check(self, frames: list[bytes]) -> Envelope:
        if len(frames) != 3 or frames[0] != self._frame:
            raise RefusedError(Reason.FRAMES, f"{len(frames)} frames, expected 3: topic, header, payload")
        return unpack(frames[1], frames[2], self._schema, self.topic.max_bytes)

    def _refuse(self, error: RefusedError) -> None:
        """Counts; the first of each reason is logged, the others only counted so that a flood fills no disk."""
        self.counter.refused[error.reason] += 1
        if self.counter.refused[error.reason] == 1:
            _log.warning("topic %s: message refused (%s): %s", self.name, error.reason.value, error)
