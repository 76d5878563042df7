"""A speaker gone wild: what is too much is dropped and attributed, and its listeners' loops go on."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import zmq

from paramove.bus import topics
from paramove.bus.budget import ALLOWANCE, BURST
from paramove.bus.bus import Bus
from paramove.bus.envelope import Reason
from paramove.bus.monitor import can_read
from paramove.bus.publisher import Publisher
from paramove.bus.settings import BusSettings
from paramove.bus.subscriber import Subscriber
from paramove.bus.ticks import Tick
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory
from paramove.msgs.tracked_objects_pb2 import TrackedObjects
from tests.bus.conftest import RawPublisher, Wait

Context = zmq.Context[Any]
SECOND_NS = 10**9


def test_beyond_the_budget_is_dropped_counted_and_attributed(
    context: Context, folder: Path, wait: Wait, caplog: pytest.LogCaptureFixture
) -> None:
    """A hundred times the rate of 15 Hz for ten seconds of the bus clock."""
    publisher = Publisher(context, folder, topics.OBJECTS_TRACKED, "colour_tracker")
    subscriber = Subscriber(context, folder, topics.OBJECTS_TRACKED)
    wait(lambda: subscriber.receive() is None and subscriber.welcomed, publisher.serve)
    heard = []
    said = 15_000
    for number in range(said):
        now_ns = number * 10 * SECOND_NS // said
        publisher.publish(TrackedObjects(), now_ns, now_ns)
        if number % 100 == 99:
            wait(
                lambda: subscriber.counter.sequence == publisher.sequence,
                lambda: heard.extend(iter(subscriber.receive, None)),
            )
    counter = subscriber.counter
    assert len(heard) == counter.messages == int(BURST + ALLOWANCE * 15 * 10 - 1e-3)
    assert counter.rejected == {Reason.BUDGET: said - len(heard)}
    assert counter.lost == 0
    assert re.search(
        rf"topic objects/tracked: .*budget.*: pid {os.getpid()} \(colour_tracker\) publishes more than 18 a second "
        r"and 20 at once; the topic's rate is 15 Hz\..*correct the publisher",
        caplog.text,
    )


def test_events_have_no_budget(context: Context, folder: Path, wait: Wait) -> None:
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    subscriber = Subscriber(context, folder, topics.GESTURES)
    wait(lambda: subscriber.receive() is None and subscriber.welcomed, publisher.serve)
    for _ in range(500):
        publisher.publish(Gesture(), 0, 0)
    wait(lambda: subscriber.receive() and subscriber.counter.messages == 500)


@pytest.mark.parametrize("kind", ["refused", "repeated", "beyond the budget"])
def test_one_call_passes_over_no_more_than_two_hundred(kind: str, context: Context, folder: Path, wait: Wait) -> None:
    speaker = RawPublisher(context, folder, topics.OBJECTS_TRACKED)
    subscriber = Subscriber(context, folder, topics.OBJECTS_TRACKED)
    wait(speaker.subscribed)
    for _ in range(900):
        if kind == "refused":
            speaker.socket.send_multipart([b"objects/tracked\0", b""])
        elif kind == "repeated":
            speaker.sequence = 0
            speaker.say(b"")
        else:
            speaker.say(b"")
    wait(lambda: subscriber.socket.poll(0))
    passed_over = []
    counter = subscriber.counter

    def count() -> int:
        before = counter.rejected.total() + counter.repeated
        subscriber.receive()
        passed_over.append(counter.rejected.total() + counter.repeated - before)
        return counter.rejected.total() + counter.repeated

    wait(lambda: count() >= 900 - BURST)
    assert max(passed_over) <= 200


_FLOODER = """
import sys, time, zmq
from pathlib import Path
from paramove.bus import topics
from paramove.bus.publisher import Publisher
topic = topics.by_name(sys.argv[2])
publisher = Publisher(zmq.Context(), Path(sys.argv[1]), topic, "wild")
message = topic.type()
while True:
    now_ns = time.monotonic_ns()
    publisher.publish(message, now_ns, now_ns)
"""


@pytest.mark.parametrize("topic", [topics.OBJECTS_TRACKED, topics.GESTURES], ids=lambda topic: topic.name)
def test_a_listener_under_a_flood_still_has_ticks_other_messages_and_a_status(
    topic: topics.Topic, folder: Path, wait: Wait
) -> None:
    """As fast as a process can; with a budget (objects/tracked) and without (gestures)."""
    settings = BusSettings(folder=folder)
    with (
        subprocess.Popen([sys.executable, "-c", _FLOODER, str(folder), topic.name]) as flooder,
        Bus("operator", settings, (), (topics.SPEECH,)) as quiet,
        Bus("listener", settings, (topic, topics.SPEECH)) as bus,
    ):
        subscriber = bus.exchange.subscribers["speech"]
        wait(lambda: subscriber.welcomed, lambda: quiet.exchange.wait(0), lambda: bus.exchange.wait(0))
        ticks = sentences = 0
        status = bus.exchange.publishers["status/listener"]
        said_before = status.sequence
        for event in bus.events(tick=True):
            ticks += isinstance(event, Tick)
            if isinstance(event, Tick):
                quiet.publish(topics.SPEECH, topics.SPEECH.type(text=str(ticks)))
            elif event.topic is topics.SPEECH:
                sentences += 1
                assert event.message.text == str(sentences)
            if ticks >= 20 and sentences >= 15 and status.sequence >= said_before + 2:
                break
        flooded = bus.exchange.subscribers[topic.name].counter
        flooder.kill()
        assert flooded.messages + flooded.rejected.total() > 1000
        assert bool(flooded.rejected[Reason.BUDGET]) == (topic is topics.OBJECTS_TRACKED)


def test_a_publisher_of_commands_that_floods_is_cut_off_and_named_and_may_come_back(
    context: Context, folder: Path, wait: Wait, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the subscriber's own clock, whatever the stamps say; a status names it, other topics arrive."""
    monkeypatch.setattr("paramove.bus.subscriber.CUT_OFF_S", 3.0)  # a status each second
    publisher = Publisher(context, folder, topics.ARM_TRAJECTORY, "wild")
    with Bus("driver", BusSettings(folder=folder), (topics.ARM_TRAJECTORY,)) as bus:
        subscriber = bus.exchange.subscribers["arm/trajectory"]
        bus.ready("as always")
        wait(lambda: subscriber.welcomed, publisher.serve, lambda: bus.exchange.wait(0))
        said = iter(range(10**9))

        def flood() -> None:
            stamp_ns = next(said) * SECOND_NS
            publisher.publish(JointTrajectory(id=str(stamp_ns)), stamp_ns, stamp_ns)
            bus.exchange.drain(["arm/trajectory"])

        wait(lambda: subscriber.cut_off, flood)
        assert f"pid {os.getpid()} (wild)" in subscriber.cut_off
        assert len(bus.exchange.take(["arm/trajectory"])) <= BURST + 2
        assert subscriber.counter.rejected[Reason.BUDGET] >= BURST
        before = subscriber.counter.messages + subscriber.counter.rejected.total()
        for _ in range(100):
            flood()
        assert subscriber.counter.messages + subscriber.counter.rejected.total() == before
        status = Subscriber(context, folder, topics.status("driver"))
        wait(lambda: (found := status.receive()) and "(wild)" in found.message.detail, lambda: bus.exchange.wait(0.01))
        wait(lambda: not subscriber.cut_off, lambda: bus.exchange.wait(0.01))
        wait(lambda: subscriber.counter.lost >= 100, publisher.serve, lambda: bus.exchange.wait(0.01))


def test_of_large_commands_few_are_decoded_and_one_is_read_in_a_call(
    context: Context, folder: Path, wait: Wait
) -> None:
    """Twenty of 1 MB: to read and decode them all would keep a stop waiting."""
    publisher = Publisher(context, folder, topics.ARM_TRAJECTORY, "wild")
    subscriber = Subscriber(context, folder, topics.ARM_TRAJECTORY, by_own_clock=True)
    wait(lambda: publisher.subscriptions, publisher.serve, subscriber.receive)
    large = JointTrajectory(id="large", joints=["x" * (2**20 - 1000)])
    begun_s = time.monotonic()
    for _ in range(20):
        publisher.publish(large, SECOND_NS, SECOND_NS)

    def read() -> int:
        return subscriber.counter.messages + subscriber.counter.rejected.total()

    while read() < 20:
        before = read()
        wait(lambda: can_read(subscriber.socket))
        subscriber.receive()
        assert read() == before + 1
    counted = 16 * (subscriber.counter.messages - 1)
    assert counted <= ALLOWANCE * 20 * (time.monotonic() - begun_s)
    assert subscriber.counter.messages + subscriber.counter.rejected[Reason.BUDGET] == 20


def test_a_stop_overtakes_what_waits_and_what_is_handed_out(context: Context, folder: Path, wait: Wait) -> None:
    """Its stamp is the latest of all; it comes before other urgent messages, too."""
    names = ("arm/trajectory", "operator/arm", "operator/stop")
    publishers = {name: Publisher(context, folder, topics.by_name(name), "all") for name in names}
    subscribed = [topics.by_name(name) for name in names]
    with Bus("driver", BusSettings(folder=folder), subscribed) as bus:
        wait(
            lambda: all(one.welcomed for one in bus.exchange.subscribers.values()),
            *(one.serve for one in publishers.values()),
            lambda: bus.exchange.wait(0),
        )
        stamps = iter(range(1, 100))

        def say(name: str) -> None:
            stamp_ns = next(stamps)
            publishers[name].publish(topics.by_name(name).type(), stamp_ns, stamp_ns)

        for name in ("arm/trajectory", "arm/trajectory", "operator/arm", "operator/stop"):
            say(name)
        wait(lambda: all(one.socket.poll(0) for one in bus.exchange.subscribers.values()))
        found = []
        for event in bus.events():
            found.append(event.topic.name)
            if found == ["operator/stop", "operator/arm", "arm/trajectory"]:
                say("operator/stop")
                wait(lambda: bus.exchange.subscribers["operator/stop"].socket.poll(0))
            if len(found) == 5:
                break
    assert found == ["operator/stop", "operator/arm", "arm/trajectory", "operator/stop", "arm/trajectory"]
