"""What is in a recording: topics, their types, numbers of messages and times."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paramove.bus import Topic
from paramove.documents import InputError
from paramove.recording.reader import read_any
from paramove.recording.recorded_types import row_of, unknown_row


@dataclass
class RecordedTopic:
    """Messages of one topic.

    Attributes:
        name: Of the topic.
        type: Class of its messages.
        messages: How many.
        first_ns, last_ns: Times of the first and the last, by the clock of the run.
        bytes_total: Of all messages, encoded again.
    """

    name: str
    type: type[Any]
    messages: int
    first_ns: int
    last_ns: int
    bytes_total: int

    @property
    def type_name(self) -> str:
        """Full name of the message type."""
        return str(self.type.DESCRIPTOR.full_name)

    @property
    def row(self) -> Topic:
        """Of the topic table, or one for a topic that no table here knows."""
        return row_of(self.name, self.type_name) or unknown_row(self.name, self.type)

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
            found[one.topic] = RecordedTopic(one.topic, type(one.message), 1, one.log_ns, one.log_ns, size)
            continue
        topic.messages += 1
        topic.last_ns = one.log_ns
        topic.bytes_total += size
    if not found:
        raise InputError(f"{path}: nothing in it can be read; `paramove recover` rebuilds what can be")
    return list(found.values())
