"""A stop from another process than the run's: heard and answered by the gate, also while the live page is open."""

from __future__ import annotations

import contextlib
import tempfile
import threading
from pathlib import Path

import pytest

from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.endpoint import TopicTakenError
from paramove.bus.settings import BusSettings
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState
from paramove.operator.terminal_stop import stop_arm
from paramove.safety.gate_io import PERSON_STOP


@pytest.fixture
def folder():
    with tempfile.TemporaryDirectory(prefix="stop-") as name:
        yield Path(name)


@contextlib.contextmanager
def gate(folder, answers=True):
    """An arm's driver in a thread of its own; what it has heard of stops."""
    heard, made, ready = [], [], threading.Event()

    def drive():
        with Bus("driver", BusSettings(folder=folder), topics.STOPS, (topics.ARM_SAFETY,)) as bus:
            made.append(bus)
            bus.publish(topics.ARM_SAFETY, SafetyState(state=SafetyState.STATE_ARMED))
            ready.set()
            for event in bus.events(*topics.STOPS):
                heard.append((event.topic.name, event.message.source))
                if answers:
                    fault = SafetyFault(code=PERSON_STOP, detail=f"stopped from the {event.message.source} by a person")
                    bus.publish(topics.ARM_SAFETY, SafetyState(state=SafetyState.STATE_STOPPING, faults=[fault]))

    thread = threading.Thread(target=drive)
    thread.start()
    assert ready.wait(60)
    yield heard
    made[0].stop()
    thread.join()


def test_the_gate_answers(folder):
    with gate(folder) as heard:
        answer = stop_arm(folder, "terminal", 10.0)
    assert answer.state == SafetyState.STATE_STOPPING
    assert answer.faults[0].detail == "stopped from the terminal by a person"
    assert {source for _, source in heard} == {"terminal"}


def test_the_live_page_is_no_obstacle(folder):
    with gate(folder) as heard, Bus("dashboard", BusSettings(folder=folder), (), (topics.OPERATOR_STOP,)):
        answer = stop_arm(folder, "terminal", 10.0)
    assert answer is not None
    assert {name for name, _ in heard} == {"operator/estop"}


def test_the_topics_are_free_again_afterwards(folder):
    with gate(folder):
        for _ in range(2):
            assert stop_arm(folder, "terminal", 10.0) is not None


def test_silence_is_no_stop(folder):
    with gate(folder, answers=False):
        assert stop_arm(folder, "terminal", 0.3) is None
    assert stop_arm(folder, "terminal", 0.1) is None


def test_when_others_say_all_stops_it_is_told(folder):
    with (
        Bus("dashboard", BusSettings(folder=folder), (), topics.STOPS),
        pytest.raises(TopicTakenError, match="other programs already publish operator/stop and operator/estop"),
    ):
        stop_arm(folder, "terminal", 0.1)
