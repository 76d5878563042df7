"""Strangers at a topic's socket: good peers go on, the speaker lives, one line tells of it."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import zmq

from paramove.bus import topics
from paramove.bus.barrier import LockstepBarrier
from paramove.bus.bus import Bus
from paramove.bus.envelope import Envelope, pack
from paramove.bus.lockstep import SERVICE, from_marks, member_mark
from paramove.bus.publisher import Publisher
from paramove.bus.schemas import schema_hash
from paramove.bus.settings import BusSettings
from paramove.bus.subscriber import Subscriber
from paramove.msgs.clock_pb2 import TickDone
from paramove.msgs.gesture_pb2 import Gesture
from tests.bus.conftest import Wait

Context = zmq.Context[Any]

GREETINGS = {
    "http": b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "garbage": os.urandom(200).replace(b"\xff", b"\0"),
    "silence": b"",
    "half a greeting": b"\xff\0\0\0\0\0\0\0\x01\x7f\x03",
    "a huge frame": b"\xff\0\0\0\0\0\0\0\x01\x7f\x03\x01NULL" + b"\0" * 48 + b"\x06\x7f" + b"\xff" * 7,
}


def _knock(path: Path, greeting: bytes) -> None:
    """Connects, waiting for a place in the queue if need be, says its greeting and leaves."""
    with socket.socket(socket.AF_UNIX) as stranger:
        stranger.connect(str(path))
        stranger.sendall(greeting)


@pytest.fixture
def pair(context: Context, folder: Path, wait: Wait) -> Iterator[tuple[Publisher, Subscriber]]:
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    subscriber = Subscriber(context, folder, topics.GESTURES)
    wait(lambda: subscriber.receive() is None and subscriber.welcomed, publisher.serve)
    yield publisher, subscriber
    publisher.close()
    subscriber.close()


@pytest.mark.parametrize(
    ("greeting", "count"), [*((one, 1000) for one in GREETINGS), ("garbage", 20_000), ("silence", 20_000)]
)
def test_a_good_peer_hears_every_message_and_one_line_tells_of_the_strangers(
    greeting: str,
    count: int,
    pair: tuple[Publisher, Subscriber],
    folder: Path,
    wait: Wait,
    caplog: pytest.LogCaptureFixture,
) -> None:
    publisher, subscriber = pair
    for number in range(count):
        _knock(folder / "gestures", GREETINGS[greeting])
        if number % 10 == 0:
            publisher.publish(Gesture(object=str(number)), 0, number)
            assert wait(subscriber.receive).message.object == str(number)
    wait(lambda: publisher.foreign.count >= count, publisher.foreign.look)
    wait(lambda: "did not speak ZeroMQ" in caplog.text, publisher.foreign.look)
    publisher.foreign.look()
    assert publisher.foreign.count == count
    assert (subscriber.counter.lost, subscriber.counter.rejected.total()) == (0, 0)
    assert len(caplog.records) == 1
    assert caplog.records[0].message.startswith("topic gestures: ")
    assert "only nodes and paramove's own commands may connect there" in caplog.text


_CLOSES = """
import sys, zmq
from pathlib import Path
from paramove.bus import topics
from paramove.bus.publisher import Publisher
context = zmq.Context()
publisher = Publisher(context, Path(sys.argv[1]), topics.GESTURES, "recognizer")
sys.stdout.write("bound\\n")
sys.stdout.flush()
sys.stdin.readline()
publisher.close()
context.term()
sys.stdout.write("closed\\n")
"""


def test_a_speaker_that_ends_while_strangers_knock_ends_well(folder: Path) -> None:
    """libzmq would abort the process: it takes any bytes for a subscriber of an older protocol."""
    command = [sys.executable, "-c", _CLOSES, str(folder)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "bound\n"
        for _ in range(3000):
            _knock(folder / "gestures", GREETINGS["http"])
        assert process.communicate("\n", timeout=60)[0] == "closed\n"
    assert process.returncode == 0


def test_the_memory_of_a_speaker_that_does_nothing_stays_small_under_strangers(
    pair: tuple[Publisher, Subscriber], folder: Path
) -> None:
    import psutil

    before = psutil.Process().memory_info().rss
    for _ in range(5000):
        _knock(folder / "gestures", GREETINGS["garbage"])
    assert psutil.Process().memory_info().rss - before < 20e6


def test_strangers_at_the_lockstep_socket_are_refused(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    settings = BusSettings(folder=folder, clock="simulated", lockstep=True)
    with Bus("simulator", settings, (), (topics.CLOCK,)) as bus:
        barrier = LockstepBarrier(bus)
        stranger: zmq.Socket[Any] = bus.exchange.context.socket(zmq.DEALER)
        stranger.connect(f"ipc://{folder / SERVICE}")
        envelope = Envelope(schema_hash(TickDone), 0, 0, 0, 0, 0)

        def join(pid: int, marked: bool) -> None:
            """Greets as a member whose process does not exist."""
            marks = {member_mark("ghost"): (pid, 0)} if marked else {}
            answer = TickDone(node="ghost", pid=pid, kind=TickDone.KIND_JOIN, published=from_marks(marks))
            payload = answer.SerializeToString()
            stranger.send_multipart([pack(envelope, payload), payload])

        join(2**22 + 1, True)
        join(2**32 - 1, True)
        join(os.getpid(), False)
        stranger.send_multipart([b"nonsense"])
        stranger.send_multipart([b"x" * 56, b""])
        stranger.send_multipart([pack(envelope, b"\xff"), b"\xff"])
        for _ in range(4):
            stranger.send_multipart([b"nonsense"])
        while barrier.rejected < 10:
            bus.exchange.wait(0.1)
            barrier._read_answers()
        assert barrier.advance(1) == []
        stranger.close(linger=0)
    assert (barrier.rejected, barrier.members) == (10, frozenset())
    assert "lockstep: answer rejected (number 1): 'ghost' cannot join as process 4194305" in caplog.text
    assert "lockstep: answer rejected (number 10): 2 frames, expected 3: sender, header, answer" in caplog.text
