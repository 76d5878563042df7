"""A word to arm, or a stop, from another process than the run's, and what the gate makes of it."""

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
from paramove.operator.terminal import request_arming, stop_arms
from paramove.safety.gate_io import PERSON_STOP

FAULT = SafetyFault(code="not_calibrated", detail="this one is not calibrated")
OTHER = SafetyFault(code="person_stop", detail="stopped from the page by a person")


@pytest.fixture
def folder():
    with tempfile.TemporaryDirectory(prefix="arming-") as name:
        yield Path(name)


@contextlib.contextmanager
def driver(folder, heard_topics, before, answers_to, namespace=""):
    """An arm's driver in a thread of its own, in a state, and what it says to what it hears; yields what that was."""
    heard, made, ready = [], [], threading.Event()

    def drive():
        settings = BusSettings(folder=folder, namespace=namespace)
        with Bus(f"{namespace}driver", settings, heard_topics, (topics.ARM_SAFETY,)) as bus:
            made.append(bus)
            bus.publish(topics.ARM_SAFETY, before)
            ready.set()
            for event in bus.events(*heard_topics):
                heard.append(event)
                for answer in answers_to(event.message):
                    bus.publish(topics.ARM_SAFETY, answer)

    thread = threading.Thread(target=drive)
    thread.start()
    assert ready.wait(60)
    yield heard
    made[0].stop()
    thread.join()


@contextlib.contextmanager
def gate(folder, before, *answers, namespace=""):
    """A driver that says the same to every word to arm; yields the words that it heard."""
    words = []

    def answers_to(word):
        words.append((word.armed, word.source))
        return answers

    with driver(folder, (topics.OPERATOR_ARM,), before, answers_to, namespace):
        yield words


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


def stopped(request):
    fault = SafetyFault(code=PERSON_STOP, detail=f"stopped from the {request.source} by a person")
    return [state("STOPPING", fault)]


def gate_for_stops(folder, answers_to=stopped, namespace=""):
    return driver(folder, topics.STOPS, state("ARMED"), answers_to, namespace)


def test_the_gate_answers(folder):
    with gate_for_stops(folder) as heard:
        answer = stop_arms(folder, "terminal", 10.0)[""]
    assert answer.state == SafetyState.STATE_STOPPING
    assert answer.faults[0].detail == "stopped from the terminal by a person"
    assert {event.message.source for event in heard} == {"terminal"}


def test_the_live_page_is_no_obstacle(folder):
    with gate_for_stops(folder) as heard, Bus("dashboard", BusSettings(folder=folder), (), (topics.OPERATOR_STOP,)):
        answer = stop_arms(folder, "terminal", 10.0)[""]
    assert answer is not None
    assert {event.topic.name for event in heard} == {"operator/estop"}


def test_the_topics_are_free_again_afterwards(folder):
    with gate_for_stops(folder):
        for _ in range(2):
            assert stop_arms(folder, "terminal", 10.0)[""] is not None


def test_silence_is_no_stop(folder):
    with gate_for_stops(folder, lambda request: []):
        assert stop_arms(folder, "terminal", 0.3) == {"": None}
    assert stop_arms(folder, "terminal", 0.1) == {"": None}


def test_when_others_say_all_stops_it_is_told(folder):
    with (
        Bus("dashboard", BusSettings(folder=folder), (), topics.STOPS),
        pytest.raises(TopicTakenError, match="other programs already publish operator/stop and operator/estop"),
    ):
        stop_arms(folder, "terminal", 0.1)


def test_one_stop_stops_the_arms_of_all_namespaces(folder):
    with gate_for_stops(folder, namespace="left") as left, gate_for_stops(folder, namespace="right") as right:
        answers = stop_arms(folder, "terminal", 10.0)
    assert {name: answer.state for name, answer in answers.items()} == dict.fromkeys(
        ("left", "right"), SafetyState.STATE_STOPPING
    )
    assert {event.message.source for event in (*left, *right)} == {"terminal"}


def test_an_arm_that_does_not_answer_a_stop_is_named(folder):
    with gate_for_stops(folder, namespace="left"), gate_for_stops(folder, lambda request: [], "right"):
        answers = stop_arms(folder, "terminal", 0.5)
    assert answers["left"] is not None
    assert answers["right"] is None


def test_a_request_to_arm_reaches_the_arm_of_its_namespace_alone(folder):
    with (
        gate(folder, state("DISARMED"), state("ARMED"), namespace="left") as left,
        gate(folder, state("DISARMED"), state("ARMED"), namespace="right") as right,
    ):
        answer = request_arming(folder, True, 10.0, "right")
    assert answer.state == SafetyState.STATE_ARMED
    assert (left, right) == ([], [(True, "terminal")])
