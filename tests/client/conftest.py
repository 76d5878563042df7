"""A node that answers, in a domain of its own."""

import threading

import pytest

from paramove.bus import Bus, BusSettings, topics
from paramove.msgs.relocation_pb2 import RelocationStatus
from paramove.msgs.rule_pb2 import Rule, Rules

SUBSCRIBES = (topics.SPEECH, topics.RELOCATION_GOAL)
PUBLISHES = (topics.RULES, topics.RELOCATION_STATUS)
STATUS = RelocationStatus


@pytest.fixture
def folder(short_folder, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(short_folder))
    monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)
    return short_folder / "paramove" / "default"


@pytest.fixture
def node(folder):
    """Publishes rules and a sentence about each sentence, and answers goals, in a thread as if it were a process."""
    made, ready = [], threading.Event()

    def answer(bus, goal):
        states = [STATUS.STATE_ACCEPTED, STATUS.STATE_SUCCEEDED if goal.object == "blue" else STATUS.STATE_REJECTED]
        for state in states if goal.object else states[:1]:
            bus.publish(topics.RELOCATION_STATUS, STATUS(goal_id=goal.id, state=state, reason=goal.object))

    def run():
        with Bus("node", BusSettings(folder=folder), SUBSCRIBES, PUBLISHES) as bus:
            made.append(bus)
            bus.publish(topics.RULES, Rules(frame="table"))
            bus.ready("answers")
            ready.set()
            for received in bus.events():
                if received.topic is topics.RELOCATION_GOAL:
                    answer(bus, received.message)
                else:
                    bus.publish(topics.RULES, Rules(rules=[Rule(text=received.message.text)]))

    thread = threading.Thread(target=run)
    thread.start()
    assert ready.wait(60)
    yield made[0]
    made[0].stop()
    thread.join()
