"""The bus as a node sees it, in real time, and the status it says."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings, default_folder
from paramove.bus.ticks import Tick
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.msgs.rule_pb2 import Rules
from tests.bus.conftest import Wait


@pytest.fixture
def speaker(folder: Path) -> Iterator[Bus]:
    with Bus("recognizer", BusSettings(folder=folder), (), (topics.GESTURES, topics.RULES)) as bus:
        yield bus


@pytest.fixture
def listener(folder: Path, speaker: Bus, wait: Wait) -> Iterator[Bus]:
    subscribes = (topics.GESTURES, topics.RULES, topics.status("recognizer"))
    with Bus("rule_learner", BusSettings(folder=folder), subscribes, ()) as bus:
        heard = bus.exchange.subscribers
        wait(
            lambda: all(item.welcomed for item in heard.values()),
            lambda: speaker.exchange.wait(0),
            lambda: bus.exchange.wait(0),
        )
        yield bus


def test_every_message_in_order_with_its_capture_time(speaker: Bus, listener: Bus) -> None:
    for number in range(20):
        speaker.publish(topics.GESTURES, Gesture(object=str(number)), captured_ns=number)
    seen = []
    for heard in listener.events(topics.GESTURES):
        seen.append((heard.message.object, heard.captured_ns))
        if len(seen) == 20:
            listener.stop()
    assert seen == [(str(number), number) for number in range(20)]


def test_latest_gives_the_newest_of_each_topic(speaker: Bus, listener: Bus, wait: Wait) -> None:
    for number in range(20):
        speaker.publish(topics.GESTURES, Gesture(object=str(number)))
    speaker.publish(topics.RULES, Rules(frame="x"))
    wait(lambda: listener.exchange.subscribers["rules"].counter.messages, lambda: listener.exchange.wait(0.01))
    wait(lambda: listener.exchange.subscribers["gestures"].counter.messages == 20, lambda: listener.exchange.wait(0.01))
    latest = listener.latest(topics.GESTURES, topics.RULES)
    assert next(latest).message.object == "19"
    assert next(latest).message.frame == "x"


def test_a_second_loop_gets_what_the_first_did_not_ask_for(speaker: Bus, listener: Bus) -> None:
    speaker.publish(topics.GESTURES, Gesture(object="kept"))
    speaker.publish(topics.RULES, Rules(frame="asked for first"))
    for heard in listener.events(topics.RULES):
        assert heard.message.frame == "asked for first"
        break
    assert next(listener.events(topics.GESTURES)).message.object == "kept"


def test_what_no_loop_asks_for_is_bounded_and_counted(speaker: Bus, listener: Bus, wait: Wait) -> None:
    for batch in range(3):
        for _ in range(500):
            speaker.publish(topics.GESTURES, Gesture())
        wanted = 500 * (batch + 1)
        gestures = listener.exchange.subscribers["gestures"].counter
        wait(lambda wanted=wanted, gestures=gestures: gestures.messages == wanted, lambda: listener.exchange.wait(0.01))
        speaker.publish(topics.RULES, Rules())
        next(listener.events(topics.RULES))
    list(itertools.islice(listener.events(topics.RULES, tick=True), 2))
    assert listener.dropped == {"gestures": 500}


def test_the_rest_is_all_that_no_loop_has_taken_also_what_arrives_after_the_stop(speaker: Bus, listener: Bus) -> None:
    speaker.publish(topics.GESTURES, Gesture(object="left by the loop"))
    speaker.publish(topics.RULES, Rules(frame="taken"))
    assert next(listener.events(topics.RULES)).message.frame == "taken"
    listener.stop()
    speaker.publish(topics.GESTURES, Gesture(object="after the stop"))
    assert list(listener.events()) == []
    rest = [one.message.object for one in listener.rest() if one.topic is topics.GESTURES]
    assert rest == ["left by the loop", "after the stop"]
    assert listener.rest() == []


def test_ticks_come_without_messages(listener: Bus) -> None:
    ticks = list(itertools.islice(listener.events(topics.RULES, tick=True), 3))
    assert all(isinstance(tick, Tick) for tick in ticks)
    assert [tick.number for tick in ticks] == sorted({tick.number for tick in ticks})
    assert ticks[-1].now_ns > ticks[0].now_ns


def test_an_unknown_topic_is_refused_with_what_to_do(speaker: Bus, listener: Bus) -> None:
    with pytest.raises(KeyError, match=r"recognizer does not publish speech; add the topic to PUBLISHES"):
        speaker.publish(topics.SPEECH, topics.SPEECH.type())
    with pytest.raises(KeyError, match="add the topic to SUBSCRIBES"):
        next(listener.events(topics.SPEECH))


def test_status_is_said_at_once_and_carries_exact_counts(speaker: Bus, listener: Bus) -> None:
    speaker.publish(topics.GESTURES, Gesture())
    speaker.ready("recognising")
    status = topics.status("recognizer")
    heard = next(item for item in listener.events(status) if item.message.state == NodeStatus.STATE_READY)
    assert (heard.message.detail, heard.message.pid) == ("recognising", os.getpid())
    assert {count.topic: count.messages for count in heard.message.published}["gestures"] == 1


def test_status_is_said_every_second_while_waiting(speaker: Bus, listener: Bus, wait: Wait) -> None:
    status = topics.status("recognizer")
    before = listener.exchange.subscribers[status.name].counter.sequence
    wait(
        lambda: listener.exchange.subscribers[status.name].counter.sequence >= before + 2,
        lambda: speaker.exchange.wait(0.1),
        lambda: listener.exchange.wait(0.1),
    )


def test_processing_time_is_that_between_message_and_return(speaker: Bus, listener: Bus) -> None:
    speaker.publish(topics.GESTURES, Gesture())
    speaker.publish(topics.GESTURES, Gesture())
    events = listener.events(topics.GESTURES)
    next(events)
    next(events)
    events.close()
    assert listener._status.processed == 2
    assert listener._status.processing_ns > 0


def test_idling_ends_no_earlier_than_asked_although_messages_arrive(speaker: Bus, listener: Bus) -> None:
    for _ in range(10):
        speaker.publish(topics.GESTURES, Gesture())
    started_s = time.monotonic()
    listener.idle(0.1)
    assert time.monotonic() - started_s >= 0.1
    assert len(list(itertools.islice(listener.events(topics.GESTURES), 10))) == 10


def test_remaps_change_the_name_on_the_bus(folder: Path, wait: Wait) -> None:
    settings = BusSettings(folder=folder, remaps={"gestures": "left/gestures"})
    with (
        Bus("left", settings, (), (topics.GESTURES,)) as speaker,
        Bus("listener", settings, (topics.GESTURES,)) as listener,
    ):
        assert (folder / "left.gestures").is_socket()
        counter = listener.exchange.subscribers["gestures"]
        wait(lambda: counter.welcomed, lambda: speaker.exchange.wait(0), lambda: listener.exchange.wait(0))
        speaker.publish(topics.GESTURES, Gesture(object="red"))
        assert next(listener.events(topics.GESTURES)).topic is topics.GESTURES


def test_truth_needs_its_folder(folder: Path) -> None:
    with pytest.raises(ValueError, match="only the simulator and evaluators are given"):
        Bus("spy", BusSettings(folder=folder), (topics.TRUTH_STATE,))
    truth = folder / "truth"
    settings = BusSettings(folder=folder, truth_folder=truth)
    with Bus("judge", settings, (), (topics.TRUTH_STATE,)):
        assert (truth / "truth.state").is_socket()
        assert not (folder / "truth.state").exists()


def test_a_fork_cannot_say(speaker: Bus, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("paramove.bus.exchange.os.getpid", lambda: 1)
    with pytest.raises(RuntimeError, match="cannot be used after a fork"):
        speaker.publish(topics.GESTURES, Gesture())


def test_a_message_said_just_before_closing_arrives(folder: Path, listener: Bus, speaker: Bus) -> None:
    for _ in range(100):
        speaker.publish(topics.GESTURES, Gesture())
    speaker.close()
    heard = list(itertools.islice(listener.events(topics.GESTURES), 100))
    assert len(heard) == 100


def test_closing_twice_and_waiting_after(speaker: Bus) -> None:
    speaker.close()
    speaker.close()
    assert speaker.stopped
    assert list(speaker.events(tick=True)) == []


def test_default_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)
    assert default_folder() == tmp_path / "paramove" / "default"
    monkeypatch.setenv("PARAMOVE_DOMAIN", "lab")
    assert default_folder() == tmp_path / "paramove" / "lab"
    monkeypatch.setenv("XDG_RUNTIME_DIR", "relative")
    assert default_folder("x").parts[-2:] == (f"paramove-{os.getuid()}", "x")
