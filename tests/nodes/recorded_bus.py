"""A bus that plays what was recorded and keeps what is said."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from paramove.bus.subscriber import Heard
from paramove.bus.topics import Topic
from paramove.bus.turns import Tick

PERIOD_NS = 66_666_667


class RecordedBus:
    """Stands in for `paramove.bus.bus.Bus` in `run(bus, config)`."""

    def __init__(self, recorded: Iterable[tuple[Topic, Any]] = (), ticks: int = 0) -> None:
        self._recorded = [
            Heard(topic, message, (i + 1) * PERIOD_NS, (i + 1) * PERIOD_NS, i)
            for i, (topic, message) in enumerate(recorded)
        ]
        self._ticks = ticks
        self.now_ns = 0
        self.said: list[tuple[Topic, Any, int | None]] = []
        self.states: list[tuple[str, str]] = []

    def publish(self, topic: Topic, message: Any, captured_ns: int | None = None) -> None:
        assert isinstance(message, topic.type)
        self.said.append((topic, message, captured_ns))

    def events(self, *wanted: Topic, tick: bool = False) -> Iterator[Heard | Tick]:
        for heard in self._recorded:
            if heard.topic in wanted:
                self.now_ns = heard.captured_ns
                yield heard
        for number in range(1, self._ticks + 1 if tick else 1):
            self.now_ns = number * PERIOD_NS
            yield Tick(number, self.now_ns)

    def latest(self, *wanted: Topic) -> Iterator[Heard | Tick]:
        return self.events(*wanted)

    def ready(self, sentence: str) -> None:
        self.states.append(("ready", sentence))

    def degraded(self, sentence: str) -> None:
        self.states.append(("degraded", sentence))
