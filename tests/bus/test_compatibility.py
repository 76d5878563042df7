"""Peers of different releases on one topic: a newer one with a field more, an older one without it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import zmq

from paramove.bus import topics
from paramove.bus.publisher import Publisher
from paramove.bus.subscriber import Subscriber
from paramove.bus.topics import Topic
from paramove.msgs.gesture_pb2 import Gesture
from tests.bus.conftest import Wait
from tests.msgs.released import classes_of, present_schemas

Context = zmq.Context[Any]


@pytest.fixture(scope="module")
def newer() -> Topic:
    """The topic as a later release has it: Gesture has got a field 900."""
    schemas = present_schemas()
    name = str(Gesture.DESCRIPTOR.full_name)
    (gesture,) = [
        message for file in schemas.file for message in file.message_type if f"{file.package}.{message.name}" == name
    ]
    field = gesture.field.add(name="certainty", number=900)
    field.type, field.label = field.TYPE_DOUBLE, field.LABEL_OPTIONAL
    return replace(topics.GESTURES, type=classes_of(schemas)[name])


def _one_message(context: Context, folder: Path, wait: Wait, publishes: Topic, subscribes: Topic, message: Any) -> Any:
    publisher = Publisher(context, folder, publishes, "recognizer")
    subscriber = Subscriber(context, folder, subscribes)
    wait(lambda: subscriber.receive() is None and subscriber.welcomed, publisher.serve)
    publisher.publish(message, 0, 0)
    return wait(subscriber.receive)


def test_an_older_listener_hears_a_newer_speaker(context: Context, folder: Path, wait: Wait, newer: Topic) -> None:
    said = newer.type(object="red", certainty=0.9)
    heard = _one_message(context, folder, wait, newer, topics.GESTURES, said)
    assert heard.message.object == "red"
    # What the older one does not know is kept when it passes the message on or stores it.
    assert newer.type.FromString(heard.message.SerializeToString()).certainty == 0.9


def test_a_newer_listener_hears_an_older_speaker(context: Context, folder: Path, wait: Wait, newer: Topic) -> None:
    heard = _one_message(context, folder, wait, topics.GESTURES, newer, Gesture(object="red"))
    assert (heard.message.object, heard.message.certainty) == ("red", 0.0)
