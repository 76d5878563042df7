"""A bus folder of its own for each test, short enough for a socket path."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import zmq

from paramove.bus.endpoint import socket_path
from paramove.bus.envelope import Envelope, pack
from paramove.bus.schemas import schema_hash
from paramove.bus.topics import Topic


@pytest.fixture
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="bus-") as path:
        yield Path(path)


class KeepingContext(zmq.Context[Any]):
    """Keeps every socket made until the end, so that none is lost to the garbage collector unclosed."""

    def __init__(self) -> None:
        super().__init__()
        self.made: list[zmq.Socket[Any]] = []

    def socket(self, *args: Any, **kwargs: Any) -> Any:
        made = super().socket(*args, **kwargs)
        self.made.append(made)
        return made

    def __setattr__(self, key: str, value: Any) -> None:
        object.__setattr__(self, key, value)


@pytest.fixture
def context() -> Iterator[zmq.Context[Any]]:
    made = KeepingContext()
    yield made
    for opened in made.made:
        opened.close(linger=0)
    made.term()


Wait = Callable[..., Any]


@pytest.fixture
def wait() -> Wait:
    """`wait(condition, *also)` calls everything again and again until `condition()` is true; returns what it gave."""

    def until(condition: Callable[[], Any], *also: Callable[[], Any], seconds: float = 60.0) -> Any:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for call in also:
                call()
            if result := condition():
                return result
            zmq.Poller().poll(1)
        raise AssertionError(f"not within {seconds} s: {condition}")

    return until


class RawPublisher:
    """A program that is not ours at a topic's socket: it says any bytes, with an envelope that fits if wanted."""

    def __init__(self, context: zmq.Context[Any], folder: Path, topic: Topic, epoch: int = 1) -> None:
        self.topic = topic
        self.epoch = epoch
        self.sequence = 0
        self.socket: zmq.Socket[Any] = context.socket(zmq.XPUB)
        self.socket.setsockopt(zmq.XPUB_VERBOSE, 1)
        self.socket.setsockopt(zmq.SNDHWM, 0)  # drops nothing where the machine is busy
        self.socket.bind(f"ipc://{socket_path(folder, topic.name)}")

    def frames(self, payload: bytes, published_ns: int = 0, **changed: Any) -> list[bytes]:
        """A well-formed message of any payload; `changed` are fields of the envelope."""
        self.sequence += 1
        fitting = Envelope(schema_hash(self.topic.type), 5, self.epoch, self.sequence, published_ns, published_ns)
        return [self.topic.name.encode() + b"\0" + pack(fitting._replace(**changed), payload), payload]

    def say(self, payload: bytes, published_ns: int = 0, **changed: Any) -> None:
        self.socket.send_multipart(self.frames(payload, published_ns, **changed))

    def subscribed(self) -> bool:
        return bool(self.socket.poll(0)) and self.socket.recv()[:1] == b"\x01"
