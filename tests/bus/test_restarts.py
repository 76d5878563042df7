"""Speakers that are killed and come again, and listeners that come in any order."""

from __future__ import annotations

import itertools
import random
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import zmq

from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings
from paramove.bus.subscriber import Subscriber
from paramove.msgs.rule_pb2 import Rules
from tests.bus.conftest import Wait

_SPEAKER = """
import sys, zmq
from pathlib import Path
from paramove.bus import topics
from paramove.bus.publisher import Publisher
publisher = Publisher(zmq.Context(), Path(sys.argv[1]), topics.GESTURES, "recognizer")
while publisher.subscriptions == 0:
    publisher.socket.poll()
    publisher.serve()
for _ in range(50):
    publisher.publish(topics.GESTURES.type(), 0, 0)
sys.stdin.read()
"""


def test_a_speaker_killed_again_and_again_is_replaced_and_no_loss_is_counted(
    context: zmq.Context[Any], folder: Path, wait: Wait, caplog: pytest.LogCaptureFixture
) -> None:
    subscriber = Subscriber(context, folder, topics.GESTURES)
    for start in range(1, 4):
        command = [sys.executable, "-c", _SPEAKER, str(folder)]
        with subprocess.Popen(command, stdin=subprocess.PIPE) as process:  # takes the stale socket and lock over
            wait(
                lambda start=start: subscriber.receive() is None and subscriber.counter.messages == 50 * start,
                subscriber.revive,
                seconds=120,
            )
            process.kill()
    counter = subscriber.counter
    assert (counter.epochs, counter.lost, counter.repeated, counter.rejected.total()) == (3, 0, 0, 0)
    assert not caplog.records


def test_a_latched_value_reaches_everybody_in_whatever_order_they_start(folder: Path, wait: Wait) -> None:
    generator = random.Random(1)
    for order in itertools.islice(itertools.cycle(itertools.permutations(["speaker", "a", "b", "c"])), 24):
        domain = folder / str(generator.getrandbits(32))
        started: dict[str, Bus] = {}
        try:
            for name in order:
                if name == "speaker":
                    started[name] = Bus(name, BusSettings(folder=domain), (), (topics.RULES,))
                    started[name].publish(topics.RULES, Rules(frame="the newest"))
                else:
                    started[name] = Bus(name, BusSettings(folder=domain), (topics.RULES,))
                for bus in started.values():
                    bus.exchange.wait(0)
            for name in "abc":
                heard = wait(
                    lambda name=name, started=started: started[name].exchange.pop(topics.RULES),
                    *[lambda bus=bus: bus.exchange.wait(0) for bus in started.values()],
                )
                assert heard.message.frame == "the newest"
        finally:
            for bus in started.values():
                bus.close()
