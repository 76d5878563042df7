"""A listener that is slow, stopped or gone costs nobody else anything, and knows exactly what it has missed.

The listener is a process of its own that says on its standard output what it has counted.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
import zmq

from paramove.bus import topics
from paramove.bus.publisher import Publisher
from paramove.bus.subscriber import Subscriber
from paramove.bus.topics import Topic
from tests.bus.conftest import Wait

Context = zmq.Context[Any]

_LISTENER = """
import json, sys, zmq
from pathlib import Path
from paramove.bus import topics
from paramove.bus.subscriber import Subscriber
subscriber = Subscriber(zmq.Context(), Path(sys.argv[1]), topics.by_name(sys.argv[2]))
last = int(sys.argv[3])
while not subscriber.welcomed:
    subscriber.socket.poll()
    subscriber.receive()
def tell(what):
    sys.stdout.write(json.dumps(what) + "\\n")
    sys.stdout.flush()
tell("welcomed")
if sys.argv[4] == "slow":
    sys.stdin.readline()
while subscriber.counter.sequence < last:
    subscriber.socket.poll(50)
    while subscriber.receive() is not None:
        pass
    subscriber.revive()
counter = subscriber.counter
tell([counter.messages, counter.lost, counter.repeated, counter.rejected.total()])
"""


class Listener:
    """A process that hears a topic until it knows of the message numbered `last`."""

    def __init__(self, folder: Path, topic: Topic, last: int, way: str = "") -> None:
        command = [sys.executable, "-c", _LISTENER, str(folder), topic.name, str(last), way]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def tells(self) -> Any:
        assert self.process.stdout is not None
        return json.loads(self.process.stdout.readline())

    def has_told(self) -> bool:
        return bool(zmq.select([self.process.stdout], [], [], 0.001)[0])

    def go_on(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def stop(self) -> None:
        """SIGSTOP, and waits until it stands."""
        self.process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, self.process.pid, os.WSTOPPED)


Listen = Callable[..., Listener]


@pytest.fixture
def listen(folder: Path) -> Iterator[Listen]:
    made: list[Listener] = []

    def begin(topic: Topic, last: int, way: str = "") -> Listener:
        made.append(Listener(folder, topic, last, way))
        return made[-1]

    yield begin
    for listener in made:
        listener.process.kill()
        listener.process.communicate()


def _drained(subscriber: Subscriber) -> Subscriber:
    while subscriber.receive() is not None:
        pass
    return subscriber


def _end_of_the_count(context: Context, folder: Path, topic: Topic, publisher: Publisher, wait: Wait) -> None:
    """A further subscription brings a welcome for everybody, which shows what was lost last."""
    other = Subscriber(context, folder, topic)
    wait(lambda: other.receive() is None and other.welcomed, publisher.serve)


@pytest.mark.parametrize("way", ["slow", "stopped"])
def test_it_loses_its_own_messages_only_and_counts_them_exactly(
    way: str, context: Context, folder: Path, listen: Listen, wait: Wait
) -> None:
    said = 20_000
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    healthy = Subscriber(context, folder, topics.GESTURES)
    listener = listen(topics.GESTURES, said, way)
    wait(listener.has_told, publisher.serve, healthy.receive)
    assert listener.tells() == "welcomed"
    if way == "stopped":
        listener.stop()
    message = topics.GESTURES.type(object="x" * 200)
    for number in range(said):
        publisher.publish(message, 0, number)  # comes back although nobody reads
        if number % 50 == 0:
            wait(lambda: _drained(healthy).counter.sequence == publisher.sequence)
    wait(lambda: _drained(healthy).counter.messages == said)
    assert (healthy.counter.lost, healthy.counter.repeated) == (0, 0)
    if way == "stopped":
        listener.process.send_signal(signal.SIGCONT)
    else:
        listener.go_on()
    while not listener.has_told():
        _end_of_the_count(context, folder, topics.GESTURES, publisher, wait)
    messages, lost, _, rejected = listener.tells()
    assert lost > 0
    assert (messages + lost, rejected) == (said, 0)


def test_images_for_a_stopped_listener_do_not_pile_up_in_the_speaker(
    context: Context, folder: Path, listen: Listen, wait: Wait
) -> None:
    publisher = Publisher(context, folder, topics.CAMERA_IMAGE_RAW, "simulator")
    listener = listen(topics.CAMERA_IMAGE_RAW, 10**9)
    wait(listener.has_told, publisher.serve)
    image = topics.CAMERA_IMAGE_RAW.type(data=b"\1" * 1_000_000)
    publisher.publish(image, 0, 0)
    listener.stop()
    before = psutil.Process().memory_info().rss
    for number in range(300):  # ten seconds of 30 Hz
        publisher.publish(image, 0, number)
    ctypes.CDLL(None).malloc_trim(0)  # what is free already does not count
    grown = psutil.Process().memory_info().rss - before
    assert grown <= 8 * 2**20, f"{grown / 2**20:.1f} MB for 300 MB said"
