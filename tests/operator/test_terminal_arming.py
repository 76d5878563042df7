"""A word to arm from another process than the run's, and what the gate makes of it."""

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
from paramove.operator.terminal_arming import request_arming

FAULT = SafetyFault(code="not_calibrated", detail="this one is not calibrated")
OTHER = SafetyFault(code="person_stop", detail="stopped from the page by a person")


@pytest.fixture
def folder():
    with tempfile.TemporaryDirectory(prefix="arming-") as name:
        yield Path(name)


@contextlib.contextmanager
def gate(folder, before, *answers):
    """An arm's driver in a thread of its own, in a state, and what it says to a word; the words that it heard."""
    heard, made, ready = [], [], threading.Event()

    def drive():
        with Bus("driver", BusSettings(folder=folder), (topics.OPERATOR_ARM,), (topics.ARM_SAFETY,)) as bus:
            made.append(bus)
            bus.publish(topics.ARM_SAFETY, before)
            ready.set()
            for event in bus.events(topics.OPERATOR_ARM):
                heard.append((event.message.armed, event.message.source))
                for answer in answers:
                    bus.publish(topics.ARM_SAFETY, answer)

    thread = threading.Thread(target=drive)
    thread.start()
    assert ready.wait(60)
    yield heard
    made[0].stop()
    thread.join()


def state(name, *faults):
    return SafetyState(state=getattr(SafetyState, f"STATE_{name}"), faults=faults)


@pytest.mark.parametrize(
    ("armed", "before", "answers"),
    [
        (True, state("DISARMED"), [state("DISARMED"), state("ARMED")]),
        (True, state("HOLD", OTHER), [state("HOLD", OTHER), state("ARMED")]),
        (False, state("ARMED"), [state("STOPPING"), state("DISARMED")]),
        (False, state("HOLD", OTHER), [state("DISARMED", OTHER)]),
    ],
)
def test_it_waits_until_the_gate_is_as_asked(folder, armed, before, answers):
    with gate(folder, before, *answers) as heard:
        assert request_arming(folder, armed, 10.0) == answers[-1]
    assert heard == [(armed, "terminal")]


def test_a_refusal_is_an_answer(folder):
    with gate(folder, state("HOLD", OTHER), state("HOLD", OTHER), state("HOLD", FAULT)) as heard:
        assert request_arming(folder, True, 10.0) == state("HOLD", FAULT)
    assert heard == [(True, "terminal")]


def test_what_is_as_wanted_hears_no_word(folder):
    with gate(folder, state("ARMED")) as heard:
        assert request_arming(folder, True, 10.0) == state("ARMED")
    assert heard == []


def test_a_word_that_changes_nothing_is_said_once(folder):
    with gate(folder, state("HOLD", FAULT)) as heard:
        assert request_arming(folder, True, 0.3) == state("HOLD", FAULT)
    assert heard == [(True, "terminal")]


def test_without_a_gate_there_is_no_answer(folder):
    assert request_arming(folder, True, 0.1) is None


def test_an_operator_that_arms_already_is_told(folder):
    with (
        Bus("operator", BusSettings(folder=folder), (), (topics.OPERATOR_ARM,)),
        pytest.raises(TopicTakenError, match="operator"),
    ):
        request_arming(folder, True, 0.1)
