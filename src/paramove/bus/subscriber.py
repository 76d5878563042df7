"""Receives one topic."""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import Any, NamedTuple

import zmq
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]

from paramove.bus.budget import ALLOWANCE, BURST, COUNTED_BYTES, CUT_OFF_S, FloodGuard, RateBudget
from paramove.bus.connecting import file_identity
from paramove.bus.endpoint import holder_of, socket_path
from paramove.bus.envelope import FLAG_RING, SIZE, Envelope, Reason, RejectedError, unpack
from paramove.bus.image_ring import OverwrittenError, RingReader
from paramove.bus.log_format import is_logged
from paramove.bus.monitor import Monitor, can_read
from paramove.bus.outline import number_of_points
from paramove.bus.schemas import schema_hash
from paramove.bus.sequence import Arrival, SequenceCounter
from paramove.bus.soundness import LATEST_NS, unsound
from paramove.bus.topics import Topic
from paramove.msgs.node_status_pb2 import NodeStatus

_log = logging.getLogger(__name__)

_NOBLOCK = int(zmq.NOBLOCK)
_SKIPPED_AT_ONCE = 200
"""Rejected messages that are read in one call, so that a flood of them does not block the process."""

DEAF_AFTER_S = 0.3
"""A socket that has not tried to reconnect for so long never will."""


class Received(NamedTuple):
    """One message.

    Attributes:
        topic: Row of the table.
        message: Decoded.
        captured_ns: Time at which the content was measured, ns of the bus clock.
        published_ns: When it was published.
        sequence: Of its publisher's epoch.
        resent: Whether it is the last value of a latched topic, sent because this process has just found its publisher:
            it may have been published at any time before.
    """

    topic: Topic
    message: Any
    captured_ns: int
    published_ns: int
    sequence: int
    resent: bool = False


def decoded(topic: Topic, payload: bytes, numbers: bool = True) -> Any:
    """The message of a topic; raises RejectedError for a payload that is none, has unsound numbers or too many points.

    Args:
        topic: Row of the table. A request may have any numbers: nobody reads them, and a stop counts whatever clock its
            sender has.
        payload: Serialised message.
        numbers: Whether unsound numbers are searched for, which takes long for a trajectory of thousands of points.
    """
    try:
        if topic.max_points is not None:
            _check_number_of_points(payload, topic.max_points)
        message = topic.type.FromString(payload)
    except (DecodeError, ValueError) as error:
        raise RejectedError(Reason.DECODE, f"payload is not a {topic.type_name}: {error}") from error
    unsound_number = unsound(message) if numbers and not topic.is_request else ""
    if unsound_number:
        raise RejectedError(Reason.NUMBER, f"{unsound_number}; finite numbers expected, correct the publisher")
    return message


def _times_message(envelope: Envelope) -> str:
    times = f"published at {envelope.published_ns} ns, captured at {envelope.captured_ns} ns"
    return f"{times}: at most {LATEST_NS} ns expected"


def _check_number_of_points(payload: bytes, allowed: int) -> None:
    """Raises RejectedError, and DecodeError for a payload that is no trajectory."""
    if len(payload) <= allowed:  # a point takes two bytes and more
        return
    found = number_of_points(payload)
    if found > allowed:
        raise RejectedError(Reason.LENGTH, f"a trajectory of {found} points, allowed are {allowed}; send fewer points")


class Subscriber:
    """Receives a topic, whether its publisher is there already or comes later, and counts exactly what is lost.

    Args:
        context: libzmq context.
        folder: Bus folder.
        topic: Row of the table.
        name: Name on the bus where it differs from the topic's (a remap).
        node: Name of the node, by which the publisher knows who has subscribed; "" for a visitor of the bus.
        by_own_clock: Whether the topic's limit counts by this process's clock too, and a publisher that floods is cut
            off; not in lockstep, where time stands still while messages are read and a run is the same on any machine.

    Attributes:
        cut_off: Who floods the topic and is cut off therefore, for people; "" normally.
    """

    def __init__(
        self,
        context: zmq.Context[Any],
        folder: Path,
        topic: Topic,
        name: str | None = None,
        node: str = "",
        by_own_clock: bool = False,
    ) -> None:
        self.topic = topic
        self.name = name or topic.name
        self.counter = SequenceCounter()
        self.connected = False
        self._context = context
        self._path = socket_path(folder, self.name)
        self._budget = RateBudget(topic.budget_hz)
        self._guard = FloodGuard(topic.limit_hz) if by_own_clock and topic.limit_hz is not None else None
        self.cut_off = ""
        self._cut_off_until_s = 0.0
        self._frame = self.name.encode() + b"\0"
        self._schema = schema_hash(topic.type)
        # A message begins with the topic's frame and a header, never with this: it only names who has subscribed.
        self._mark = self._frame + b"\0" + node.encode() if node else b""
        self._found = file_identity(self._path)
        self._disconnected_s: float | None = None
        self._ring = RingReader()
        self._open()

    @property
    def welcomed(self) -> bool:
        """Whether the publisher has answered: messages lost from now on are counted."""
        return self.counter.epoch is not None

    def receive(self, ready: bool = False) -> Received | None:
        """Next new message, or None if none is waiting.

        Repeated and rejected ones are counted and skipped. After many of them, or a large one, it also returns None.

        Args:
            ready: A poll has just shown that something is waiting, so that need not be checked again.
        """
        for _ in range(_SKIPPED_AT_ONCE):
            epoch = self.counter.epoch
            raw = self.receive_raw(ready)
            ready = False
            if raw is None:
                return None
            envelope, payload = raw
            is_first = envelope.epoch != epoch
            try:
                if not self._budget.admits(envelope.epoch, envelope.published_ns):
                    raise RejectedError(Reason.BUDGET, self._budget_message())
                if not (envelope.has_possible_times or self.topic.is_request):
                    raise RejectedError(Reason.NUMBER, _times_message(envelope))
                message = decoded(self.topic, payload, self.topic.has_checked_numbers)
            except RejectedError as error:
                self.counter.messages -= 1
                self._reject(error)
                if len(payload) > COUNTED_BYTES:  # a stop is looked for before the next one
                    return None
                continue
            return Received(
                self.topic,
                message,
                envelope.captured_ns,
                envelope.published_ns,
                envelope.sequence,
                resent=envelope.is_welcome and is_first,
            )
        return None

    def receive_raw(self, ready: bool = False) -> tuple[Envelope, bytes] | None:
        """Like `receive`, with the payload left encoded and however fast they come."""
        for _ in range(_SKIPPED_AT_ONCE):
            if not ready and not can_read(self.socket):
                return None
            ready = False
            try:
                envelope, payload = self._read()
            except RejectedError as error:
                self._reject(error)
                if self._guard is not None:
                    self._admits(self._guard, COUNTED_BYTES)  # its size is not known
                continue
            except OverwrittenError:  # the gap in the sequence counts it
                continue
            except zmq.Again:
                return None
            if self.counter.epoch is None and self.topic.type is not NodeStatus:  # of a status the last one is enough
                self.counter.from_first = file_identity(self._path) != self._found
            arrival = self.counter.accept(envelope)
            if arrival is Arrival.NEW:
                if self._guard is None or self._admits(self._guard, len(payload)):
                    return envelope, payload
                self.counter.messages -= 1
                self._reject(RejectedError(Reason.BUDGET, self._budget_message()))
                if len(payload) > COUNTED_BYTES:  # a stop is looked for before the next one
                    return None
            elif arrival is Arrival.OUTDATED:
                self._log_rejection(RejectedError(Reason.EPOCH, self._two_publishers_message(envelope)))
        return None

    def is_deaf(self) -> bool:
        """Whether libzmq has given the connection up for good, so that only `reopen` helps.

        To be called a few times a second. libzmq drops a connection for ever when a message exceeds MAXMSGSIZE or the
        other side does not speak its protocol. Also keeps `connected` up to date, and ends a cut-off that is over.
        """
        if self.cut_off and time.monotonic() > self._cut_off_until_s:
            self.cut_off = ""
            if self._guard is not None:
                self._guard.reset()
            self.socket.setsockopt(zmq.SUBSCRIBE, self._frame)  # the welcome reveals how much was lost
        for event in self._monitor.events():
            if event == zmq.EVENT_DISCONNECTED:
                self.connected, self._disconnected_s = False, time.monotonic()
            elif event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
                self.connected, self._disconnected_s = True, None
            else:  # it tries again
                self._disconnected_s = None
        return self._disconnected_s is not None and time.monotonic() - self._disconnected_s > DEAF_AFTER_S

    def revive(self) -> bool:
        """Reopens the socket if libzmq has given it up, and counts that; returns whether it did."""
        if not self.is_deaf():
            return False
        self._reject(
            RejectedError(
                Reason.CONNECTION,
                f"libzmq ended the connection to {holder_of(self._path) or 'its publisher'} for good: a message above "
                f"{self.topic.max_bytes} bytes, or no ZeroMQ; reopened",
            )
        )
        self.reopen()
        return True

    def reopen(self) -> None:
        """Closes the socket and opens another. Counts go on: what is missed meanwhile is a loss."""
        self.close()
        self.connected = False
        self._open()

    def close(self) -> None:
        """Closes the socket; messages not yet received are gone."""
        self._monitor.close()
        self.socket.close(linger=0)
        self._ring.close()

    def _open(self) -> None:
        self._disconnected_s = None
        self.socket: zmq.Socket[Any] = self._context.socket(zmq.SUB)
        self.socket.setsockopt(zmq.RCVHWM, self.topic.high_water_mark)
        self.socket.setsockopt(zmq.MAXMSGSIZE, max(self.topic.max_bytes, SIZE))
        self.socket.setsockopt(zmq.RECONNECT_IVL, 20)
        self.socket.setsockopt(zmq.RECONNECT_IVL_MAX, 200)
        self._monitor = Monitor(
            self.socket,
            zmq.EVENT_DISCONNECTED
            | zmq.EVENT_CONNECT_RETRIED
            | zmq.EVENT_CONNECT_DELAYED
            | zmq.EVENT_CONNECTED
            | zmq.EVENT_HANDSHAKE_SUCCEEDED,
        )
        self.socket.connect(f"ipc://{self._path}")
        if not self.cut_off:
            self.socket.setsockopt(zmq.SUBSCRIBE, self._frame)
        if self._mark:
            self.socket.setsockopt(zmq.SUBSCRIBE, self._mark)

    def _read(self) -> tuple[Envelope, bytes]:
        """The next message, its sequence and content unchecked; raises RejectedError."""
        frame = self.socket.recv(_NOBLOCK, copy=False)  # knows whether another one follows, which is costly to ask for
        head = frame.bytes
        frames = 1
        while frame.more:
            frame = self.socket.recv(_NOBLOCK, copy=False)
            frames += 1
        payload = frame.bytes
        if frames != 2 or not head.startswith(self._frame):
            raise RejectedError(Reason.FRAMES, f"{frames} frames, expected 2: topic and header, payload")
        envelope = unpack(head[len(self._frame) :], payload, self._schema, self.topic.max_bytes)
        if envelope.flags & FLAG_RING:
            payload = self._ring.read(payload, envelope, self.topic.max_bytes)
        return envelope, payload

    def _admits(self, guard: FloodGuard, n_bytes: int) -> bool:
        """Whether a message that has just arrived is within the topic's limit; cuts off a publisher that floods."""
        admitted = guard.admits(n_bytes)
        if guard.floods and not self.cut_off:
            self._cut_off_until_s = time.monotonic() + CUT_OFF_S
            self.cut_off = (
                f"{holder_of(self._path) or 'its publisher'} floods {self.name} and is cut off for {CUT_OFF_S:g} s"
            )
            self.socket.setsockopt(zmq.UNSUBSCRIBE, self._frame)  # what waits is dropped, and no more is sent
            _log.warning("topic %s: %s; correct the publisher", self.name, self.cut_off)
        return admitted

    def _reject(self, error: RejectedError) -> None:
        self.counter.rejected[error.reason] += 1
        self._log_rejection(error)

    def _log_rejection(self, error: RejectedError) -> None:
        """Of each reason the 1st, 10th, 100th, ... is logged, so that a flood fills no disk."""
        count = self.counter.rejected[error.reason]
        if is_logged(count):
            _log.warning("topic %s: message rejected (%s, number %d): %s", self.name, error.reason.value, count, error)

    def _budget_message(self) -> str:
        rate_hz = self.topic.budget_hz or 0.0
        return (
            f"{holder_of(self._path) or 'its publisher'} publishes more than {ALLOWANCE * rate_hz:g} a second and "
            f"{BURST} at once; the topic's rate is {rate_hz:g} Hz. Excess messages are dropped (a large command "
            "counts as several); correct the publisher"
        )

    def _two_publishers_message(self, envelope: Envelope) -> str:
        return (
            f"two publishers: epoch {envelope.epoch} still publishes after epoch {self.counter.epoch} has replaced it, "
            f"and is ignored; the lock is held by {holder_of(self._path) or 'nobody'}. End the other process"
        )
