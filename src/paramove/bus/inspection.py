"""A running bus from outside, for programs that are no node of the run, such as a command in a terminal.

Every function returns within its timeout; a publisher that is dead, busy or absent is reported as such.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import zmq

from paramove.bus import topics
from paramove.bus.endpoint import holder_of, is_held, socket_path
from paramove.bus.publisher import Publisher
from paramove.bus.sequence import SequenceCounter
from paramove.bus.settings import nodes_in
from paramove.bus.subscriber import Received, Subscriber
from paramove.bus.topics import Topic
from paramove.msgs.safety_state_pb2 import SafetyState

_POLL_MS = 50
_LONGEST_DELAY_S = 60.0


class BusVisitor(contextlib.ExitStack):
    """Sockets on a run's bus, while it is a context.

    Args:
        folder: Of the run's bus.
        name: Name under which it publishes, if it does.
    """

    def __init__(self, folder: Path, name: str = "") -> None:
        super().__init__()
        self._folder, self._name = folder, name
        self._owned = self.enter_context(contextlib.ExitStack())  # released after the ZeroMQ context has ended
        self._context: zmq.Context[Any] = self.enter_context(zmq.Context())

    def publisher(self, topic: Topic) -> Publisher:
        """The one publisher of a topic. Raises TopicTakenError and BusFolderError."""
        publisher = Publisher(self._context, self._folder, topic, self._name)
        self._owned.callback(publisher.ownership.release)
        self.callback(publisher.close)
        return publisher

    def subscriber(self, topic: Topic) -> Subscriber:
        """A subscriber to a topic."""
        subscriber = Subscriber(self._context, self._folder, topic)
        self.callback(subscriber.close)
        return subscriber


def publish_now(publisher: Publisher, message: Any) -> None:
    """Publishes a person's request with the present time as `captured`."""
    now_ns = time.monotonic_ns()
    message.captured.FromNanoseconds(now_ns)
    publisher.publish(message, now_ns, now_ns)


@dataclass(frozen=True)
class PublisherOnBus:
    """Whether a topic has a publisher, and who it is.

    Attributes:
        topic: Row of the table.
        alive: Whether a process holds the topic.
        holder: What the holder of the topic's lock wrote, such as "pid 12 (camera)"; "" if nobody ever published it.
    """

    topic: Topic
    alive: bool
    holder: str


@dataclass
class Measurement:
    """Messages of a topic received within some seconds.

    A latched value that was published before is no message of this time: it counts in `counter` only.

    Attributes:
        topic: Row of the table.
        counter: Of the messages, losses and rejected messages. Its epoch is None if no publisher answered.
        arrivals_s: When messages arrived, by this process's monotonic clock.
        sizes: Of their payloads, bytes.
        published_s, captured_s: By the clock of the run, which may be simulated.
    """

    topic: Topic
    counter: SequenceCounter
    arrivals_s: list[float] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    published_s: list[float] = field(default_factory=list)
    captured_s: list[float] = field(default_factory=list)

    @property
    def rate_hz(self) -> float:
        """Messages per second between the first and the last arrival; 0 with fewer than two."""
        if len(self.arrivals_s) < 2:
            return 0.0
        return (len(self.arrivals_s) - 1) / (self.arrivals_s[-1] - self.arrivals_s[0])

    @property
    def bytes_per_s(self) -> float:
        """Of payloads, between the first and the last arrival; 0 with fewer than two."""
        return self.rate_hz * self.mean_bytes

    @property
    def longest_gap_s(self) -> float:
        """Longest time between two messages."""
        return max((b - a for a, b in zip(self.arrivals_s, self.arrivals_s[1:], strict=False)), default=0.0)

    @property
    def mean_bytes(self) -> float:
        """Mean size of a payload."""
        return sum(self.sizes) / len(self.sizes) if self.sizes else 0.0

    @property
    def waits_s(self) -> list[float]:
        """From when each message's content was captured until it was published."""
        return [after - before for before, after in zip(self.captured_s, self.published_s, strict=True)]

    @property
    def delays_s(self) -> list[float]:
        """From when each message was published until it arrived; empty where the run has another clock than this."""
        delays = [after - before for before, after in zip(self.published_s, self.arrivals_s, strict=True)]
        return delays if all(-0.01 < delay < _LONGEST_DELAY_S for delay in delays) else []


def publishers(folder: Path) -> list[PublisherOnBus]:
    """Every topic of the table, and every status topic and topic of a namespace that was published in the folder."""
    public = [topic for topic in topics.TOPICS if not topic.truth]
    others = [*_of_namespaces(folder), *map(topics.status, nodes_in(folder))]
    return [publisher_of(folder, topic) for topic in (*public, *others)]


def _of_namespaces(folder: Path) -> Iterator[Topic]:
    """Topics of namespaces whose sockets are in the folder, by name."""
    for path in sorted(folder.glob("*.*")):
        name = path.name.replace(".", "/")
        if not topics.is_name(name) or not topics.split_name(name)[0]:
            continue
        topic = topics.known_by(name)
        if topic is not None:
            yield topic


def gates(folder: Path) -> dict[str, Topic]:
    """Topics of the states of safety gates that run in a folder, by their namespaces."""
    known = [topics.ARM_SAFETY, *(topic for topic in _of_namespaces(folder) if topic.type is SafetyState)]
    return {topics.split_name(topic.name)[0]: topic for topic in known if publisher_of(folder, topic).alive}


def publisher_of(folder: Path, topic: Topic) -> PublisherOnBus:
    """The publisher of one topic."""
    path = socket_path(folder, topic.name)
    return PublisherOnBus(topic, is_held(path), holder_of(path))


def listen(folder: Path, selected: Sequence[Topic], seconds: float = math.inf) -> Iterator[Received]:
    """Messages of the topics, decoded, as they arrive within `seconds`."""
    end_s = time.monotonic() + seconds
    with BusVisitor(folder) as visitor:
        subscribers = [visitor.subscriber(topic) for topic in selected]
        while time.monotonic() < end_s:
            for subscriber in subscribers:
                while (received := subscriber.receive()) is not None:
                    yield received
            wait(subscribers, end_s - time.monotonic())


def measure(folder: Path, selected: Sequence[Topic], seconds: float) -> list[Measurement]:
    """Counts what is published on the topics for `seconds`, reading envelopes only: payloads are not decoded."""
    end_s = time.monotonic() + seconds
    with BusVisitor(folder) as visitor:
        subscribers = [visitor.subscriber(topic) for topic in selected]
        measurements = [Measurement(subscriber.topic, subscriber.counter) for subscriber in subscribers]
        while time.monotonic() < end_s:
            for subscriber, measurement in zip(subscribers, measurements, strict=True):
                while (raw := subscriber.receive_raw()) is not None:
                    envelope, payload = raw
                    if not envelope.is_welcome:
                        measurement.arrivals_s.append(time.monotonic())
                        measurement.sizes.append(len(payload))
                        measurement.published_s.append(1e-9 * envelope.published_ns)
                        measurement.captured_s.append(1e-9 * envelope.captured_ns)
            wait(subscribers, end_s - time.monotonic())
    return measurements


def statuses(folder: Path, seconds: float) -> dict[str, Any]:
    """Latest `NodeStatus` of each node whose status topic has a living publisher; None if it did not answer in time."""
    alive = [item.topic for item in publishers(folder) if item.alive and item.topic.name.startswith("status/")]
    latest: dict[str, Any] = {topic.name.removeprefix("status/"): None for topic in alive}
    if alive:
        for received in listen(folder, alive, seconds):
            latest[received.topic.name.removeprefix("status/")] = received.message
            if None not in latest.values():
                break
    return latest


def why_nothing_came(folder: Path, topic: Topic, seconds: float) -> str:
    """For a message: whether a topic has no publisher, or who published nothing within so long."""
    state = publisher_of(folder, topic)
    reason = f"{state.holder} published nothing" if state.alive else "no publisher"
    return f"{topic.name}: {reason} within {seconds:g} s"


def wait(subscribers: Iterable[Subscriber], seconds: float) -> None:
    """Waits until something can be read, a little at most; reopens sockets that libzmq has given up."""
    poller = zmq.Poller()
    for subscriber in subscribers:
        subscriber.revive()
        poller.register(subscriber.socket, zmq.POLLIN)
    poller.poll(int(max(0.0, min(_POLL_MS, 1000 * seconds))))
