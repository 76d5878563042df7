"""A node that tests start as a process: says five sentences at once, before it is ready."""

from __future__ import annotations

from paramove.bus import topics
from paramove.bus.node import Bus, NodeConfig, main
from paramove.msgs.rule_pb2 import Speech

SUBSCRIBES = (topics.GESTURES,)
PUBLISHES = (topics.SPEECH,)


def run(bus: Bus, config: NodeConfig) -> None:
    for number in range(5):
        bus.publish(topics.SPEECH, Speech(text=f"first {number}"))
    bus.ready("has published")
    for _ in bus.events(tick=True):
        pass


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, NodeConfig)
