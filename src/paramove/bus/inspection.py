"""Looks at a running bus from outside, without taking part. For the command line and the dashboard.

Every call returns within its timeout; a publisher that is dead, busy or absent is reported as such.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import zmq

from paramove.bus import topics
from paramove.bus.endpoint import holder_of, is_held, socket_path
from paramove.bus.subscriber import Received, Subscriber
from paramove.bus.topics import Topic
from paramove.bus.visitor import BusVisitor

_POLL_MS = 50


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
    """Messages of a topic received within some seconds. Times are of this process's monotonic clock.

    Attributes:
        topic: Row of the table.
        welcomed: Whether the publisher answered.
        messages: How many were received; a latched value that was published before counts, too.
        lost: Gaps in the sequence.
        rejected: Messages that were rejected.
        sequence: Of the latest message of the publisher.
        epoch: Of the publisher.
        bytes_total: Of the payloads.
        arrivals_s: When messages arrived.
    """

    topic: Topic
    welcomed: bool = False
    messages: int = 0
    lost: int = 0
    rejected: int = 0
    sequence: int = 0
    epoch: int = 0
    bytes_total: int = 0
    arrivals_s: list[float] = field(default_factory=list)

    @property
    def rate_hz(self) -> float:
        """Messages per second between the first and the last arrival; 0 with fewer than two."""
        if len(self.arrivals_s) < 2:
            return 0.0
        return (len(self.arrivals_s) - 1) / (self.arrivals_s[-1] - self.arrivals_s[0])

    @property
    def longest_gap_s(self) -> float:
        """Longest time between two messages."""
        return max((b - a for a, b in zip(self.arrivals_s, self.arrivals_s[1:], strict=False)), default=0.0)

    @property
    def mean_bytes(self) -> float:
        """Mean size of a payload."""
        return self.bytes_total / self.messages if self.messages else 0.0


def publishers(folder: Path) -> list[PublisherOnBus]:
    """Every topic of the table, and every status topic that was published in the folder."""
    nodes = sorted(path.name.removeprefix("status.") for path in folder.glob("status.*") if path.suffix != ".lock")
    public = [topic for topic in topics.TOPICS if not topic.truth]
    return [publisher_of(folder, topic) for topic in (*public, *(topics.status(node) for node in nodes))]


def publisher_of(folder: Path, topic: Topic) -> PublisherOnBus:
    """The publisher of one topic."""
    path = socket_path(folder, topic.name)
    return PublisherOnBus(topic, is_held(path), holder_of(path))


def listen(folder: Path, selected: Sequence[Topic], seconds: float) -> Iterator[Received]:
    """Messages of the topics, decoded, as they arrive within `seconds`."""
    end_s = time.monotonic() + seconds
    with BusVisitor(folder) as visitor:
        subscribers = [visitor.subscriber(topic) for topic in selected]
        while time.monotonic() < end_s:
            for subscriber in subscribers:
                while (received := subscriber.receive()) is not None:
                    yield received
            _poll(subscribers, end_s)


def measure(folder: Path, selected: Sequence[Topic], seconds: float) -> list[Measurement]:
    """Counts what is published on the topics for `seconds`, reading envelopes only: payloads are not decoded."""
    end_s = time.monotonic() + seconds
    measurements = [Measurement(topic) for topic in selected]
    with BusVisitor(folder) as visitor:
        subscribers = [visitor.subscriber(topic) for topic in selected]
        while time.monotonic() < end_s:
            for subscriber, measurement in zip(subscribers, measurements, strict=True):
                while (raw := subscriber.receive_raw()) is not None:
                    measurement.arrivals_s.append(time.monotonic())
                    measurement.bytes_total += len(raw[1])
            _poll(subscribers, end_s)
        for subscriber, measurement in zip(subscribers, measurements, strict=True):
            counter = subscriber.counter
            measurement.welcomed = subscriber.welcomed
            measurement.messages, measurement.lost = counter.messages, counter.lost
            measurement.sequence, measurement.epoch = counter.sequence, counter.epoch or 0
            measurement.rejected = counter.rejected.total()
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


def _poll(subscribers: list[Subscriber], end_s: float) -> None:
    """Waits until something can be read, not beyond `end_s`; reopens sockets that libzmq has given up."""
    poller = zmq.Poller()
    for subscriber in subscribers:
        subscriber.revive()
        poller.register(subscriber.socket, zmq.POLLIN)
    poller.poll(max(0, min(_POLL_MS, int(1000 * (end_s - time.monotonic())))))
