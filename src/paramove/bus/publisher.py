"""Publishes one topic."""

from __future__ import annotations

import contextlib
import secrets
from pathlib import Path
from typing import Any

import zmq

from paramove.bus.endpoint import bound_socket, prepare_folder
from paramove.bus.envelope import FLAG_LAST_VALUE, FLAG_RING, FLAG_WELCOME, Envelope, pack, publisher_id
from paramove.bus.image_ring import SMALLEST, RingWriter
from paramove.bus.monitor import can_read
from paramove.bus.schemas import schema_hash
from paramove.bus.soundness import LATEST_S, has_times, impossible_time
from paramove.bus.topics import Profile, Topic

_NOBLOCK = int(zmq.NOBLOCK)
_NOBLOCK_SNDMORE = int(zmq.NOBLOCK | zmq.SNDMORE)
"""As plain numbers: to combine enums takes longer than to send."""


class ImpossibleTimeError(ValueError):
    """A message with a time that no clock has; the text names the field and its value."""


LINGER_MS = 500
"""How long closing waits for messages published just before."""


class Publisher:
    """The one publisher of a topic, bound to `ipc://<folder>/<name with . for />`.

    Every new subscription is answered by a *welcome* with the epoch and the latest sequence. The subscriber learns from
    it that it is connected and from where on to count losses; on a latched topic it holds the latest message. The
    welcome is sent from `serve` and `publish`: there is no thread.

    Args:
        context: libzmq context; `ownership` may be released only after it was terminated.
        folder: Bus folder; made if missing.
        topic: Row of the table.
        node: Name of the node, for the publisher id and the error a second publisher gets.
        name: Name on the bus where it differs from the topic's (a remap).

    Attributes:
        epoch: Of this start.
        sequence: Of the latest message published.
        subscriptions: How many have been answered since the start.
        subscribers: Nodes that are subscribed now.
        foreign: Connections that did not speak ZeroMQ; `foreign.look()` is to be called a few times a second.

    Raises:
        TopicTakenError, BusFolderError: see `paramove.bus.endpoint`.
    """

    def __init__(
        self, context: zmq.Context[Any], folder: Path, topic: Topic, node: str, name: str | None = None
    ) -> None:
        self.topic = topic
        self.name = name or topic.name
        self.epoch = secrets.randbits(32)
        self.sequence = 0
        self.subscriptions = 0
        self.subscribers: set[str] = set()
        prepare_folder(folder)
        self._frame = self.name.encode() + b"\0"
        self._schema = schema_hash(topic.type)
        self._publisher = publisher_id(node)
        self._has_times = has_times(topic.type.DESCRIPTOR)
        self._last: tuple[Envelope, bytes] | None = None
        self._ring = RingWriter() if topic.by_ring else None
        options = {
            zmq.XPUB_VERBOSE: 1,
            zmq.SNDHWM: topic.publisher_high_water_mark,
            zmq.LINGER: LINGER_MS,
            zmq.MAXMSGSIZE: 1024,  # a subscriber sends subscriptions only
        }
        self.socket, self.ownership, self.foreign = bound_socket(context, zmq.XPUB, folder, self.name, node, options)

    def publish(self, message: Any, captured_ns: int, now_ns: int) -> int:
        """Publishes `message` and returns its sequence number. Never waits.

        Raises:
            TypeError: the topic carries another type.
            ImpossibleTimeError: a time in it is negative, or one in it or given here is beyond `LATEST_NS`. Never for
                a request, as a stop counts whatever clock its sender has.
            ValueError: the message is larger than the topic allows, or has more points.
        """
        if type(message) is not self.topic.type:
            type_name = getattr(getattr(message, "DESCRIPTOR", None), "full_name", type(message).__name__)
            raise TypeError(f"topic {self.topic.name} carries {self.topic.type_name}, not {type_name}")
        payload: bytes = message.SerializeToString(deterministic=True)
        if len(payload) > self.topic.max_bytes:
            raise ValueError(
                f"message on {self.topic.name} has {len(payload)} bytes, the topic allows {self.topic.max_bytes}"
            )
        if self.topic.max_points is not None and len(message.points) > self.topic.max_points:
            raise ValueError(
                f"trajectory on {self.topic.name} has {len(message.points)} points, allowed are {self.topic.max_points}"
            )
        envelope = Envelope(self._schema, self._publisher, self.epoch, self.sequence + 1, now_ns, captured_ns)
        self._check_times(message, envelope)
        self.sequence = envelope.sequence
        if self.topic.profile is Profile.LATCHED:
            self._last = (envelope, payload)
        self._share(envelope, payload)
        self.serve()
        return self.sequence

    def forward(self, envelope: Envelope, payload: bytes) -> None:
        """Publishes what the topic's publisher on another host has published, as it is. Never waits."""
        if envelope.epoch != self.epoch:
            self._last = None
        self.epoch, self.sequence = envelope.epoch, envelope.sequence
        if self.topic.profile is Profile.LATCHED and envelope.has_message:
            self._last = (envelope, payload)
        self._share(envelope, payload)
        self.serve()

    def serve(self) -> None:
        """Answers the subscriptions that have come in since the last call."""
        before = self.subscriptions
        while can_read(self.socket):
            self._handle(self.socket.recv(zmq.NOBLOCK))
        if self.subscriptions > before:
            self._welcome()

    def close(self) -> None:
        """Closes the socket; messages already published are still delivered for `LINGER_MS`."""
        self.foreign.close()
        self.socket.close()
        if self._ring is not None:
            self._ring.close()

    def _handle(self, subscription: bytes) -> None:
        """Handles a subscription or, after the last of its kind has gone, its end."""
        begins, frame = subscription[:1] == b"\x01", subscription[1:]
        if not frame.startswith(self._frame + b"\0"):
            self.subscriptions += begins
            return
        node = frame[len(self._frame) + 1 :].decode("utf-8", "replace")
        if begins:
            self.subscribers.add(node)
        else:
            self.subscribers.discard(node)

    def _check_times(self, message: Any, envelope: Envelope) -> None:
        if self.topic.is_request:
            return
        impossible = impossible_time(message) if self._has_times else ""
        if not impossible and not envelope.has_possible_times:
            impossible = f"it is captured at {envelope.captured_ns} ns and published at {envelope.published_ns} ns"
        if impossible:
            raise ImpossibleTimeError(f"message on {self.topic.name}: {impossible}; at most {LATEST_S} s expected")

    def _welcome(self) -> None:
        if self._last is not None:
            envelope, payload = self._last
            self._send(envelope._replace(flags=FLAG_WELCOME | FLAG_LAST_VALUE), payload)
        else:
            self._send(
                Envelope(self._schema, self._publisher, self.epoch, self.sequence, 0, 0, flags=FLAG_WELCOME), b""
            )

    def _share(self, envelope: Envelope, payload: bytes) -> None:
        """Sends a large image by the ring, all else by the socket."""
        if self._ring is not None and len(payload) >= SMALLEST:
            with contextlib.suppress(OSError):  # no memory: by the socket, as smaller ones
                payload, envelope = self._ring.write(payload, envelope), envelope._replace(flags=FLAG_RING)
        self._send(envelope, payload)

    def _send(self, envelope: Envelope, payload: bytes) -> None:
        self.socket.send(self._frame + pack(envelope, payload), _NOBLOCK_SNDMORE)
        self.socket.send(payload, _NOBLOCK)
