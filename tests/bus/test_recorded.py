"""The recorded bus hands out what it was given and keeps what is said."""

from __future__ import annotations

import pytest

from paramove.bus import topics
from paramove.bus.recorded import RecordedBus, with_ticks
from paramove.bus.subscriber import Received
from paramove.bus.ticks import Tick
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import Rules, Speech


def _gesture(time_ns: int, name: str = "") -> Received:
    return Received(topics.GESTURES, Gesture(object=name), time_ns, time_ns, time_ns)


def test_events_in_order_and_time_follows_them() -> None:
    bus = RecordedBus([_gesture(3), Tick(1, 5), _gesture(7), Tick(2, 10)])
    seen = []
    for event in bus.events(topics.GESTURES, tick=True):
        seen.append((type(event).__name__, bus.now_ns))
        bus.publish(topics.SPEECH, Speech(text=str(bus.now_ns)))
    assert seen == [("Received", 3), ("Tick", 5), ("Received", 7), ("Tick", 10)]
    assert bus.published[1] == Received(topics.SPEECH, Speech(text="5"), 5, 5, 2)
    assert len(bus.published_on(topics.SPEECH)) == 4
    assert bus.published_on(topics.GESTURES) == []


def test_latest_conflates_between_ticks() -> None:
    bus = RecordedBus([_gesture(1, "a"), _gesture(2, "b"), Tick(1, 5), _gesture(6, "c")])
    assert [heard.message.object for heard in bus.latest(topics.GESTURES)] == ["b", "c"]
    bus = RecordedBus([_gesture(1, "a"), _gesture(2, "b")])
    assert [heard.message.object for heard in bus.latest(topics.GESTURES)] == ["a", "b"]


def test_other_topics_wait_for_a_later_loop() -> None:
    bus = RecordedBus([_gesture(1), Received(topics.RULES, Rules(), 2, 2, 1), _gesture(3)])
    for heard in bus.events(topics.RULES):
        assert heard.topic is topics.RULES
        break
    assert [heard.sequence for heard in bus.events(topics.GESTURES)] == [1, 3]


def test_ticks_are_laid_between_messages() -> None:
    events = list(with_ticks([_gesture(25), _gesture(10), _gesture(11)], period_ns=10))
    assert events == [_gesture(10), Tick(1, 10), _gesture(11), Tick(2, 20), _gesture(25), Tick(3, 30)]


def test_stop_and_wrong_type() -> None:
    bus = RecordedBus([_gesture(1), _gesture(2)])
    for _ in bus.events():
        bus.stop()
    assert len(list(bus.events())) == 0
    with pytest.raises(TypeError, match="gestures carries"):
        bus.publish(topics.GESTURES, Rules())
    bus.ready("done")
    assert bus.states == [("ready", "done")]
