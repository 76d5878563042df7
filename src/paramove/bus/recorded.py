"""A bus of recorded or synthetic messages that stores the messages of the node. For replay tests of nodes.

bus = RecordedBus([Received(topics.CAMERA_IMAGE, image, 0, 0, 1), Tick(1, 66_666_667)])
run(bus, Config())
assert [published.message for published in bus.published_on(topics.OBJECTS_TRACKED)] == [...]
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from paramove.bus.settings import BusSettings
from paramove.bus.soundness import unsound
from paramove.bus.subscriber import Received
from paramove.bus.ticks import TICK_PERIOD_NS, Tick
from paramove.bus.topics import Topic
from paramove.documents import renamed_attribute


def with_ticks(messages: Iterable[Received], period_ns: int = TICK_PERIOD_NS) -> Iterator[Received | Tick]:
    """Messages in the order of publish time, and a tick at the end of every period up to the last message.

    Args:
        messages: In any order.
        period_ns: Of the ticks; a message published exactly at a tick comes before it.
    """
    number = 0
    for received in sorted(messages, key=lambda item: item.published_ns):
        if number == 0:
            number = -(-received.published_ns // period_ns)
        while received.published_ns > number * period_ns:
            yield Tick(number, number * period_ns)
            number += 1
        yield received
    yield Tick(number, number * period_ns)


class RecordedBus:
    """Has the methods of `Bus` that nodes use, without sockets, processes and real time.

    Args:
        recorded: Messages and ticks, in the order in which the node gets them.
        node: Name of the node.
        run_folder: Where the node may write files.
        protected: Reject messages with unsound numbers, as the bus does; they are listed in `rejected`.

    Attributes:
        published: Everything the node published, in order, as a subscriber receives it.
        states: States and their messages in order, such as ("ready", "tracking 4 colours").
        rejected: Topic and unsound number of each message that was rejected.
        now_ns: Publish time of the latest message or time of the latest tick.
    """

    def __init__(
        self,
        recorded: Iterable[Received | Tick] = (),
        node: str = "node",
        run_folder: Path | None = None,
        protected: bool = True,
    ) -> None:
        self.node = node
        self.run_folder = run_folder or Path()
        self.settings = BusSettings(folder=self.run_folder, clock="simulated")
        self.published: list[Received] = []
        self.states: list[tuple[str, str]] = []
        self.rejected: list[tuple[str, str]] = []
        self.now_ns = 0
        self.stopped = False
        self._protected = protected
        self._waiting = list(recorded)
        self._sequences: Counter[str] = Counter()
        self._idle_work: Callable[[], bool] = lambda: False

    def publish(self, topic: Topic, message: Any, captured_ns: int | None = None) -> None:
        """Stores a copy of the message; raises TypeError if the topic carries another type."""
        if type(message) is not topic.type:
            raise TypeError(f"topic {topic.name} carries {topic.type_name}, not {type(message).__name__}")
        copy = topic.type()
        copy.CopyFrom(message)
        self._sequences[topic.name] += 1
        captured_ns = self.now_ns if captured_ns is None else captured_ns
        self.published.append(Received(topic, copy, captured_ns, self.now_ns, self._sequences[topic.name]))

    def published_on(self, topic: Topic) -> list[Received]:
        """What the node published on one topic."""
        return [one for one in self.published if one.topic.name == topic.name]

    said = renamed_attribute("said", "published")
    said_on = renamed_attribute("said_on", "published_on")

    def events(self, *selected: Topic, tick: bool = False) -> Iterator[Received | Tick]:
        """As `Bus.events`; ends with the recording. Messages of other topics are left for a later loop."""
        return self._events({topic.name for topic in selected}, tick)

    def latest(self, *selected: Topic) -> Iterator[Received]:
        """As `Bus.latest`; the messages between two ticks are one iteration, without ticks each message is its own."""
        names = {topic.name for topic in selected}
        iteration: dict[str, Received] = {}
        has_ticks = any(isinstance(event, Tick) for event in self._waiting)
        for event in self._events(names, tick=True):
            if isinstance(event, Received):
                iteration.pop(event.topic.name, None)
                iteration[event.topic.name] = event
                if has_ticks:
                    continue
            yield from iteration.values()
            iteration.clear()
        yield from iteration.values()

    def rest(self) -> list[Received]:
        """Nothing: a recording waits until its node takes the next message."""
        return []

    def subscribe(self, topic: Topic) -> None:
        """Every topic of the recording is subscribed anyway."""

    def when_readable(self, descriptor: int, call: Callable[[], None]) -> None:
        """There is nothing to wait for in a recording; messages of another thread are fetched at ticks."""

    def when_idle(self, work: Callable[[], bool]) -> None:
        """A recording always waits: the work is done whole before its next message or tick is handed out."""
        self._idle_work = work

    def starting(self, message: str) -> None:
        """Stores the state."""
        self._change("starting", message)

    def ready(self, message: str) -> None:
        """Stores the state."""
        self._change("ready", message)

    def degraded(self, message: str) -> None:
        """Stores the state."""
        self._change("degraded", message)

    def failed(self, message: str) -> None:
        """Stores the state."""
        self._change("failed", message)

    def ended(self, message: str) -> None:
        """Stores the state."""
        self._change("stopped", message)

    def stop(self) -> None:
        """Ends every loop over events."""
        self.stopped = True

    def hands_out(self, received: Received) -> bool:
        """Whether the node gets a message."""
        checked = self._protected and received.topic.has_checked_numbers
        reason = unsound(received.message) if checked else ""
        if reason:
            self.rejected.append((received.topic.name, reason))
        return not reason

    def _change(self, state: str, message: str) -> None:
        if self.states[-1:] != [(state, message)]:  # as a bus does
            self.states.append((state, message))

    def _events(self, names: set[str], tick: bool) -> Iterator[Received | Tick]:
        index = 0
        while not self.stopped and index < len(self._waiting):
            event = self._waiting[index]
            if isinstance(event, Received) and names and event.topic.name not in names:
                index += 1
                continue
            del self._waiting[index]
            while self._idle_work():
                pass
            if isinstance(event, Received) and not self.hands_out(event):
                continue
            self.now_ns = event.now_ns if isinstance(event, Tick) else event.published_ns
            if tick or isinstance(event, Received):
                yield event
