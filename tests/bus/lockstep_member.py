"""A member of the lockstep that tests start as a process: hears, computes for a while, says, writes down what it heard.

python -m tests.bus.lockstep_member NODE FOLDER LOG SEED ROLE
"""

from __future__ import annotations

import random
import signal
import sys
import time
from pathlib import Path

from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings
from paramove.bus.ticks import Tick
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import Speech

ROLES = {
    "gesture": ((topics.OBJECTS_TRACKED, topics.SPEECH), (topics.GESTURES,)),
    "speech": ((topics.GESTURES, topics.OBJECTS_TRACKED), (topics.SPEECH,)),
    "idle": ((topics.OBJECTS_TRACKED,), ()),
}


def _compute(seconds: float) -> None:
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        pass


def main(node: str, folder: str, log: str, seed: str, role: str) -> None:
    subscribes, publishes = ROLES[role]
    pace = random.Random(seed)
    settings = BusSettings(folder=Path(folder), clock="simulated", lockstep=True)
    with Bus(node, settings, subscribes, publishes) as bus, Path(log).open("w", encoding="utf-8") as written:
        signal.signal(signal.SIGTERM, lambda *_: bus.stop())
        _compute(pace.uniform(0.0, 0.2))
        if role == "speech":
            bus.publish(topics.SPEECH, Speech(text="said before the first tick"))
        bus.ready("in lockstep")
        for event in bus.events(tick=True):
            if isinstance(event, Tick):
                written.write(f"tick {event.number} {event.now_ns}\n")
                if role == "speech":
                    bus.publish(topics.SPEECH, Speech(text=f"tick {event.number}"))
            else:
                text = str(event.message).replace("\n", " ")
                written.write(f"{event.topic.name} {event.sequence} {event.published_ns} {text}\n")
                if role == "gesture" and event.topic is topics.OBJECTS_TRACKED:
                    for _ in range(2):
                        bus.publish(topics.GESTURES, Gesture(object=f"{event.message.width_px}"))
            written.flush()
            _compute(pace.uniform(0.0, 0.003))


if __name__ == "__main__":
    main(*sys.argv[1:])
