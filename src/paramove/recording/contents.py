"""What is in a recording: topics, their types, numbers of messages and times."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paramove.bus import Topic
from paramove.documents import InputError
from paramove.recording.damage import MAGIC
from paramove.recording.reader import read_any
from paramove.recording.recorded_types import change_of, known_row, recorded_row


@dataclass
class RecordedTopic:
    """Messages of one topic.

    Attributes:
        name: Of the topic.
        type: Class of its messages.
        messages: How many.
        first_ns, last_ns: Times of the first and the last, by the clock of the run.
        bytes_total, most_bytes: Of all messages, and of the largest, encoded again.
    """

    name: str
    type: type[Any]
    messages: int
    first_ns: int
    last_ns: int
    bytes_total: int
    most_bytes: int

    @property
    def type_name(self) -> str:
        """Full name of the message type."""
        return str(self.type.DESCRIPTOR.full_name)

    @property
    def row(self) -> Topic:
        """Of the topic table, if it has the topic with this type; otherwise one of this name and type."""
        known = known_row(self.name)
        return known if known is not None and known.type is self.type else recorded_row(self.name, self.type)

    @property
    def change(self) -> str:
        """What the topic table has another now, so that these messages are none of the topic's; "" if nothing."""
        known = known_row(self.name)
        return "" if known is None else change_of(known, self.type)

    @property
    def rate_hz(self) -> float:
        """Messages per second between the first and the last; 0 with fewer than two."""
        duration_ns = self.last_ns - self.first_ns
        return 1e9 * (self.messages - 1) / duration_ns if duration_ns > 0 else 0.0


def contents(path: Path) -> list[RecordedTopic]:
    """Topics of a recording, in the order of their first messages.

    Raises InputError if there is no such file, or no message can be read.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such recording; a run's recording.mcap expected", missing=True)
    found: dict[str, RecordedTopic] = {}
    for one in read_any(path):
        size = one.message.ByteSize()
        topic = found.get(one.topic)
        if topic is None:
            found[one.topic] = RecordedTopic(one.topic, type(one.message), 1, one.log_ns, one.log_ns, size, size)
            continue
        topic.messages += 1
        topic.last_ns = one.log_ns
        topic.bytes_total += size
        topic.most_bytes = max(topic.most_bytes, size)
    if not found:
        with path.open("rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - len(MAGIC)))
            is_whole = size > len(MAGIC) and file.read() == MAGIC
        why = "it has no messages" if is_whole else "nothing in it can be read; `paramove recover` rebuilds what can be"
        raise InputError(f"{path}: {why}")
    return list(found.values())
