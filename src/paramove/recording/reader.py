"""Reading recordings: messages in order, decoded by the topic table; also files that were never finished."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

from paramove.bus import topics


@dataclass(frozen=True)
class Recorded:
    """One message of a recording.

    Attributes:
        topic: Name of its topic.
        message: The decoded protobuf message.
        log_ns: Time by which the recording is ordered.
        publish_ns: When it was said.
        sequence: Of the publisher.
    """

    topic: str
    message: Any
    log_ns: int
    publish_ns: int
    sequence: int


def read(path: Path, only: Collection[str] = ()) -> Iterator[Recorded]:
    """The messages of a recording in the order in which they were written.

    A file that ends in the middle of a record (its writer was killed) gives all messages before that.

    Args:
        path: The file.
        only: Names of topics; empty for all.

    Raises:
        FileNotFoundError: There is no such file.
        KeyError: The file holds a topic that the topic table does not know.
    """
    types: dict[int, Any] = {}
    names: dict[int, str] = {}
    with path.open("rb") as file:
        try:
            for record in StreamReader(file).records:
                if isinstance(record, Channel):
                    if not only or record.topic in only:
                        types[record.id], names[record.id] = topics.by_name(record.topic).type, record.topic
                elif isinstance(record, Message) and record.channel_id in types:
                    yield Recorded(
                        names[record.channel_id],
                        _decoded(types[record.channel_id], names[record.channel_id], record.data),
                        record.log_time,
                        record.publish_time,
                        record.sequence,
                    )
        except (McapError, EOFError):
            return


def _decoded(message_type: Any, topic: str, data: bytes) -> Any:
    """The view of the simulator is kept as JPEG; everything else as it was said."""
    if topic == topics.TRUTH_VIEW.name:
        message_type = topics.CAMERA_IMAGE.type
    return message_type.FromString(data)
