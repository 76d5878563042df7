"""The library's recorded bus, filled with messages a tick apart or with ticks alone."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from paramove.bus.recorded import RecordedBus
from paramove.bus.subscriber import Received
from paramove.bus.ticks import Tick
from paramove.bus.topics import Topic

PERIOD_NS = 66_666_667


def bus_that_heard(messages: Iterable[tuple[Topic, Any]]) -> RecordedBus:
    """One message each tick period, from the first on; no ticks."""
    return RecordedBus(
        Received(topic, message, number * PERIOD_NS, number * PERIOD_NS, number)
        for number, (topic, message) in enumerate(messages, start=1)
    )


def bus_with_ticks(count: int) -> RecordedBus:
    """Nothing but time."""
    return RecordedBus(Tick(number, number * PERIOD_NS) for number in range(1, count + 1))
