"""A program that publishes and subscribes without being a node of the run, such as a command in a terminal."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path
from typing import Any

import zmq

from paramove.bus.publisher import Publisher
from paramove.bus.subscriber import Subscriber
from paramove.bus.topics import Topic


class BusVisitor(contextlib.ExitStack):
    """Sockets on a run's bus, while it is a context.

    Args:
        folder: Of the run's bus.
        name: Name under which it publishes.
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
