"""A node is ready when it is connected with the nodes that run already; what is missed nevertheless is counted."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import zmq

from paramove.bus import BusVisitor, topics
from paramove.bus.bus import Bus
from paramove.bus.connecting import CONNECT_TIMEOUT_S, NodeTopics, running_nodes
from paramove.bus.endpoint import holder_of, owner_of, socket_path
from paramove.bus.publisher import Publisher
from paramove.bus.settings import BusSettings
from paramove.bus.subscriber import Subscriber
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.msgs.rule_pb2 import Rules

ROOT = Path(__file__).resolve().parents[2]
Context = zmq.Context[Any]
Wait = Callable[..., Any]
Start = Callable[[str], "subprocess.Popen[bytes]"]


@pytest.fixture
def start(folder: Path) -> Iterator[Start]:
    started = []

    def begin(name: str) -> subprocess.Popen[bytes]:
        config = folder / f"{name}.yaml"
        config.write_text(f"node: {name}\nbus: {{folder: {folder}}}\n", encoding="utf-8")
        command = [sys.executable, "-m", f"tests.bus.{name}_node", "--config", str(config)]
        started.append(subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL))
        return started[-1]

    yield begin
    for process in started:
        process.kill()
        process.wait()


def _bus(folder: Path, node: str, subscribes: tuple[Any, ...] = (), publishes: tuple[Any, ...] = ()) -> Bus:
    return Bus(node, BusSettings(folder=folder), subscribes, publishes)


def _state(bus: Bus, node: str, state: NodeStatus.State) -> None:
    status = topics.status(node)
    bus.subscribe(status)
    next(received for received in bus.events(status) if received.message.state == state)


def test_what_a_node_publishes_at_its_start_and_restart_reaches_those_that_run(folder: Path, start: Start) -> None:
    with _bus(folder, "listener", (topics.SPEECH,)) as bus:
        bus.connect()
        for _ in range(2):
            process = start("burst")
            received = bus.events(topics.SPEECH)
            assert [next(received).message.text for _ in range(5)] == [f"first {number}" for number in range(5)]
            process.terminate()
            assert process.wait(60) == 0
        assert bus.exchange.subscribers[topics.SPEECH.name].counter.lost == 0


def test_a_ready_subscriber_gets_what_a_running_publisher_says_next(folder: Path, start: Start) -> None:
    with _bus(folder, "publisher", (), (topics.GESTURES,)) as bus:
        bus.connect()
        start("trivial")
        _state(bus, "trivial", NodeStatus.STATE_READY)
        assert bus.exchange.publishers[topics.GESTURES.name].subscribers == {"trivial"}


def test_a_stopped_node_delays_a_start_up_to_the_limit_and_is_named_until_it_is_connected(
    folder: Path, start: Start, wait: Wait
) -> None:
    stopped = start("trivial")
    with _bus(folder, "looker") as looker:
        _state(looker, "trivial", NodeStatus.STATE_READY)
    stopped.send_signal(signal.SIGSTOP)
    with _bus(folder, "burst", (), (topics.GESTURES,)) as bus:
        began_s = time.monotonic()
        bus.connect(timeout_s=0.3)
        bus.ready("begins")
        assert 0.3 <= time.monotonic() - began_s < CONNECT_TIMEOUT_S
        assert bus.exchange.unconnected() == {"trivial": ["gestures"]}
        bus.subscribe(topics.status("burst"))
        reported = next(received.message for received in bus.events(topics.status("burst")))
        assert reported.state == NodeStatus.STATE_READY
        assert "trivial (gestures)" in reported.detail
        stopped.send_signal(signal.SIGCONT)
        wait(lambda: not bus.exchange.unconnected(), lambda: bus.idle(0.01))
        bus.ready("works")
        last = next(received.message for received in bus.events() if received.message.detail.startswith("works"))
        assert last.detail == "works"


def test_a_node_that_dies_meanwhile_is_not_waited_for(folder: Path, start: Start) -> None:
    killed = start("trivial")
    with _bus(folder, "looker") as looker:
        _state(looker, "trivial", NodeStatus.STATE_READY)
    killed.kill()
    killed.wait()
    with _bus(folder, "burst", (), (topics.GESTURES,)) as bus:
        bus.connect(timeout_s=60.0)
        assert not bus.exchange.unconnected()


def test_visitors_delay_no_start(folder: Path) -> None:
    with _bus(folder, "page", (topics.GESTURES,)) as page, BusVisitor(folder) as visitor:
        page.connect(visitor=True)
        visitor.subscriber(topics.GESTURES)
        assert running_nodes(folder) == []
        with _bus(folder, "burst", (), (topics.GESTURES,)) as bus:
            bus.connect(timeout_s=60.0)
            assert not bus.exchange.unconnected()


def test_a_lock_names_its_holder_and_the_topics(folder: Path) -> None:
    with _bus(folder, "burst", (topics.RULES,), (topics.GESTURES,)) as bus:
        bus.connect()
        bus.subscribe(topics.SPEECH)
        status = socket_path(folder, "status/burst")
        names = frozenset({"gestures", "status/burst"})
        assert running_nodes(folder) == [NodeTopics("burst", frozenset({"rules", "speech"}), names)]
        assert holder_of(status).endswith("(burst)")
        assert owner_of(status)
    assert running_nodes(folder) == []


def test_a_damaged_lock_file_stops_no_start(folder: Path) -> None:
    with _bus(folder, "other", (topics.GESTURES,)) as other, _bus(folder, "burst", (), (topics.GESTURES,)) as bus:
        other.connect()
        lock = folder / "status.other.lock"
        for content in (b"", b"pid", b"\xff\n\xff \xff\n", b"pid 1 (x)\nsubscribes \npublishes \n", b"\n" * 100_000):
            lock.write_bytes(content)
            bus.connect(timeout_s=60.0)


def test_what_was_published_before_a_waiting_subscriber_was_connected_is_counted(
    context: Context, folder: Path, wait: Wait
) -> None:
    waits = Subscriber(context, folder, topics.GESTURES)
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    for _ in range(5):
        publisher.publish(Gesture(), 0, 0)
    late = Subscriber(context, folder, topics.GESTURES)
    for subscriber in (waits, late):
        wait(lambda subscriber=subscriber: subscriber.welcomed, publisher.serve, subscriber.receive)
    assert (waits.counter.lost, late.counter.lost) == (5, 0)


def test_of_a_latched_topic_all_but_the_last_value_is_counted(context: Context, folder: Path, wait: Wait) -> None:
    waits = Subscriber(context, folder, topics.RULES)
    publisher = Publisher(context, folder, topics.RULES, "rule_learner")
    for name in ("first", "second", "third"):
        publisher.publish(Rules(frame=name), 0, 0)
    assert wait(waits.receive, publisher.serve).message.frame == "third"
    assert (waits.counter.lost, waits.counter.messages) == (2, 1)
