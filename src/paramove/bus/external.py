"""Publishing into a run from outside, by a program that is no node of it."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from google.protobuf.json_format import ParseDict, ParseError  # type: ignore[import-untyped]

from paramove.bus.inspection import BusVisitor, publisher_of
from paramove.bus.soundness import unsound
from paramove.bus.topics import CLOCK, Topic
from paramove.documents import InputError, read_value

_POLL_S = 0.01


def message_of(kind: type[Any], content: str | Mapping[str, Any]) -> Any:
    """A message of a type with the fields of a mapping, which may be a text in YAML or JSON.

    Raises InputError that names the wrong field; also for a number that every subscriber would reject.
    """
    fields = read_value(content, "the message") if isinstance(content, str) else content
    if not isinstance(fields, Mapping):
        raise InputError(f"a {kind.DESCRIPTOR.full_name} is written as a mapping, such as '{{x: 1.0}}'")
    try:
        message = ParseDict(fields, kind())
    except ParseError as error:
        raise InputError(f"this is no {kind.DESCRIPTOR.full_name}: {error}") from error
    fault = unsound(message)
    if fault:
        raise InputError(f"every subscriber would reject this {kind.DESCRIPTOR.full_name}: {fault}")
    return message


class ExternalPublisher:
    """The one publisher of a topic, while this is a context, with the time of the run.

    Args:
        folder: Of the run's bus.
        topic: Row of the table.
        name: Who publishes, for others.

    Raises TopicTakenError on entering if a process publishes the topic.
    """

    def __init__(self, folder: Path, topic: Topic, name: str) -> None:
        self._folder, self._topic, self._name = folder, topic, name
        self._now_ns = 0

    def __enter__(self) -> Self:
        with contextlib.ExitStack() as opened:
            visitor = opened.enter_context(BusVisitor(self._folder, self._name))
            self._publisher = visitor.publisher(self._topic)
            is_simulated = publisher_of(self._folder, CLOCK).alive
            self._clock = visitor.subscriber(CLOCK) if is_simulated else None
            self._opened = opened.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()

    def wait_for_subscriber(self, seconds: float) -> bool:
        """Whether somebody subscribes within so long; in simulated time also until the time is known."""
        until_s = time.monotonic() + seconds
        while not self._publisher.subscriptions or (self._clock is not None and not self._now_ns):
            if time.monotonic() > until_s:
                return self._publisher.subscriptions > 0
            self.idle(_POLL_S)
        return True

    def idle(self, seconds: float) -> None:
        """Serves newcomers, and keeps the time of the run, for so long."""
        until_s = time.monotonic() + seconds
        while True:
            self._publisher.serve()
            self._read_clock()
            left_s = until_s - time.monotonic()
            if left_s <= 0.0:
                return
            time.sleep(min(_POLL_S, left_s))

    def publish(self, message: Any) -> None:
        """Publishes a message, captured now; raises as `Publisher.publish` does."""
        self._read_clock()
        now_ns = time.monotonic_ns() if self._clock is None else self._now_ns
        self._publisher.publish(message, now_ns, now_ns)

    def _read_clock(self) -> None:
        while self._clock is not None and (received := self._clock.receive()) is not None:
            self._now_ns = received.message.time_ns
