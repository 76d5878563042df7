"""Reading recordings: messages in order, decoded by the topic table; also files that were never finished."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader

from paramove.bus import topics
from paramove.documents import InputError
from paramove.recording.chunks import RECORD_BYTES, WRONG, allowance, records, whole
from paramove.recording.recorded_types import known_row, row_of

MESSAGE_BYTES = 2**24
"""Of one message: as much as the largest topic allows."""


@dataclass(frozen=True)
class Recorded:
    """One message of a recording.

    Attributes:
        topic: Name of its topic.
        message: The decoded protobuf message.
        log_ns: Time by which the recording is ordered.
        publish_ns: When it was published.
        sequence: Of the publisher.
    """

    topic: str
    message: Any
    log_ns: int
    publish_ns: int
    sequence: int


def read(path: Path, only: Collection[str] = (), raising: type[InputError] = InputError) -> Iterator[Recorded]:
    """The messages of a recording in the order in which they were written.

    A file that ends in the middle of a record (its writer was killed) or is damaged gives all messages before that.

    Args:
        path: The file.
        only: Names of topics; empty for all. A topic that was renamed has its present name.
        raising: Class of the exception for a message that cannot be decoded.

    Raises:
        FileNotFoundError: There is no such file.
        InputError: A message is not of its topic's type, or too large.
        KeyError: The file has a topic that is not in the topic table.

    A message type of the workspace whose fields have changed since is that of the recording: the fields have the names
    that they had then.
    """
    yield from _read(path, only, raising, must_be_known=True)


def read_any(path: Path, only: Collection[str] = (), raising: type[InputError] = InputError) -> Iterator[Recorded]:
    """As `read`, but a topic that is not in the topic table is decoded by the schema that the recording has of it.

    Channels of other encodings than protobuf are left out.
    """
    yield from _read(path, only, raising, must_be_known=False)


def _read(path: Path, only: Collection[str], raising: type[InputError], must_be_known: bool) -> Iterator[Recorded]:
    channels: dict[int, topics.Topic] = {}
    schemas: dict[int, Schema] = {}
    with path.open("rb") as file:
        for record in _records(file, path.stat().st_size):
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                name = topics.OLD_NAMES.get(record.topic, record.topic)
                if only and name not in only and record.topic not in only:
                    continue
                if must_be_known:
                    topics.by_name(name)
                topic = _row(name, schemas.get(record.schema_id))
                if topic is not None:
                    channels[record.id] = topic
            elif isinstance(record, Message) and record.channel_id in channels:
                topic = channels[record.channel_id]
                message = _decoded(path, topic, record, raising)
                yield Recorded(topic.name, message, record.log_time, record.publish_time, record.sequence)


def _row(name: str, schema: Schema | None) -> topics.Topic | None:
    """The topic's row of the table, or one by its schema in the recording; None if that cannot be read."""
    # What a simulator shows is stored as JPEG. Other names are not looked up: a table of the user's may be wrong.
    if name.startswith("truth/") and topics.split_name(name)[1] == topics.TRUTH_VIEW.name:
        return replace(topics.TRUTH_VIEW, name=name, type=topics.CAMERA_IMAGE.type)
    if schema is None:
        return known_row(name)
    with contextlib.suppress(InputError):
        return row_of(name, schema)
    return None


def _records(file: IO[bytes], size: int) -> Iterator[McapRecord]:
    """The records up to the first that is cut off or damaged; chunks are compared with their checksums."""
    reader = StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=min(max(size, 1), RECORD_BYTES))
    allowed = allowance(size)
    with contextlib.suppress(*WRONG):
        for record in reader.records:
            if isinstance(record, Chunk):
                data = whole(record, allowed)
                allowed -= len(data)
                yield from (one for _, one in records(data, cut=False))
            else:
                yield record


def _decoded(path: Path, topic: topics.Topic, message: Message, raising: type[InputError]) -> Any:
    """Decodes a message."""
    try:
        if len(message.data) > MESSAGE_BYTES:
            raise ValueError(f"{len(message.data)} bytes, at most {MESSAGE_BYTES} are read")
        return topic.type.FromString(message.data)
    except (DecodeError, ValueError) as error:
        raise raising(
            f"{path}: message {message.sequence} on {topic.name} is not a {topic.type_name} "
            f"({error}); another program recorded it, or it is damaged: record it again"
        ) from error
