"""Reading recordings: messages in order, decoded by the topic table; also files that were never finished."""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from mcap.exceptions import McapError
from mcap.records import Channel, McapRecord, Message
from mcap.stream_reader import StreamReader
from zstandard import ZstdError  # comes with mcap

from paramove.bus import topics

# What mcap and its decompressors raise where a file ends too early or holds something else.
_DAMAGE = (McapError, EOFError, struct.error, ZstdError, ValueError, OverflowError, MemoryError)


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

    A file that ends in the middle of a record (its writer was killed) or is damaged gives all messages before that.

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
        for record in _records(file, path.stat().st_size):
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


def _records(file: IO[bytes], size: int) -> Iterator[McapRecord]:
    """The records up to the first that is cut off or damaged; chunks are compared with their checksums."""
    records = StreamReader(file, validate_crcs=True, record_size_limit=max(size, 1)).records
    while True:
        try:
            record = next(records)
        except (StopIteration, *_DAMAGE):
            return
        yield record


def _decoded(message_type: Any, topic: str, data: bytes) -> Any:
    """The view of the simulator is kept as JPEG; everything else as it was said."""
    if topic == topics.TRUTH_VIEW.name:
        message_type = topics.CAMERA_IMAGE.type
    return message_type.FromString(data)
