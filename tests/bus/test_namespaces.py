"""Nodes of the same kind in several namespaces of one bus."""

from __future__ import annotations

from pathlib import Path

import pytest

from paramove.bus import inspection, topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings
from paramove.documents import InputError
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.safety_state_pb2 import StopRequest
from tests.bus.conftest import Wait

LEFT_AND_RIGHT = ("left", "right")


def in_namespace(folder: Path, namespace: str) -> BusSettings:
    return BusSettings(folder=folder, namespace=namespace, namespaces=LEFT_AND_RIGHT)


def connected(wait: Wait, *buses: Bus) -> None:
    wait(
        lambda: all(one.welcomed for bus in buses for one in bus.exchange.subscribers.values() if one.name != "rules"),
        *(lambda bus=bus: bus.exchange.wait(0) for bus in buses),
    )


def test_a_node_gets_what_is_published_in_its_namespace(folder: Path, wait: Wait) -> None:
    with (
        Bus("left_recognizer", in_namespace(folder, "left"), (), (topics.GESTURES,)) as left,
        Bus("right_recognizer", in_namespace(folder, "right"), (), (topics.GESTURES,)) as right,
        Bus("right_learner", in_namespace(folder, "right"), (topics.GESTURES,), ()) as learner,
    ):
        connected(wait, left, right, learner)
        left.publish(topics.GESTURES, Gesture(object="left"))
        right.publish(topics.GESTURES, Gesture(object="right"))
        received = next(learner.events(topics.GESTURES))
        assert received.message.object == "right"
        assert received.topic is topics.GESTURES, "a node names its topics as without a namespace"


def test_a_node_for_every_namespace_gets_all_by_their_names(folder: Path, wait: Wait) -> None:
    settings = in_namespace(folder, "")
    with (
        Bus("left_recognizer", in_namespace(folder, "left"), (), (topics.GESTURES,)) as left,
        Bus("right_recognizer", in_namespace(folder, "right"), (), (topics.GESTURES,)) as right,
        Bus("recorder", settings, settings.in_every_namespace((topics.GESTURES, topics.CLOCK)), ()) as recorder,
    ):
        assert list(recorder.exchange.subscribers) == ["gestures", "clock", "left/gestures", "right/gestures"]
        wait(
            lambda: all(recorder.exchange.subscribers[f"{name}/gestures"].welcomed for name in LEFT_AND_RIGHT),
            *(lambda bus=bus: bus.exchange.wait(0) for bus in (left, right, recorder)),
        )
        left.publish(topics.GESTURES, Gesture(object="blue"))
        right.publish(topics.GESTURES, Gesture(object="green"))
        events = recorder.events()
        found = {(one.topic.name, one.message.object) for one in (next(events), next(events))}
    assert found == {("left/gestures", "blue"), ("right/gestures", "green")}


def test_a_node_in_a_namespace_is_for_that_alone(folder: Path) -> None:
    assert in_namespace(folder, "left").in_every_namespace((topics.GESTURES,)) == (topics.GESTURES,)


def test_a_namespace_that_the_run_does_not_have_is_rejected_with_those_that_it_has(folder: Path) -> None:
    in_namespace(folder, "").check_namespaces(["right", "left"])
    with pytest.raises(InputError, match="no namespace lift; it has left, right"):
        in_namespace(folder, "").check_namespaces(["lift", "left"])


def test_a_stop_reaches_every_namespace(folder: Path, wait: Wait) -> None:
    stops = (topics.OPERATOR_STOP,)
    with (
        Bus("page", BusSettings(folder=folder), (), stops) as page,
        Bus("left_driver", in_namespace(folder, "left"), stops, ()) as left,
        Bus("right_driver", in_namespace(folder, "right"), stops, ()) as right,
    ):
        connected(wait, page, left, right)
        page.publish(topics.OPERATOR_STOP, StopRequest(source="page"))
        assert [next(driver.events(*stops)).message.source for driver in (left, right)] == ["page", "page"]


def test_a_remap_names_the_topic_on_the_bus(folder: Path) -> None:
    settings = BusSettings(folder=folder, namespace="left", remaps={"objects/tracked": "objects/tracked"})
    assert settings.name_of(topics.OBJECTS_TRACKED) == "objects/tracked"
    assert settings.name_of(topics.GESTURES) == "left/gestures"


@pytest.mark.parametrize("has_gates", [True, False])
def test_topics_and_gates_of_namespaces_are_found_from_outside(folder: Path, has_gates: bool) -> None:
    published = (topics.GESTURES, topics.ARM_SAFETY) if has_gates else (topics.GESTURES,)
    with Bus("left_driver", in_namespace(folder, "left"), (), published):
        alive = {one.topic.name for one in inspection.publishers(folder) if one.alive}
        assert alive == {f"left/{topic.name}" for topic in published} | {"status/left_driver"}
        assert {name: topic.name for name, topic in inspection.gates(folder).items()} == (
            {"left": "left/arm/safety"} if has_gates else {}
        )
