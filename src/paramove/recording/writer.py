"""Recordings: MCAP files with protobuf schemas, which Foxglove, rerun and the mcap tools open unmodified.

Chunks are small, so that a process that is killed loses little; the file bears the ending `.part` until it is finished.
"""

from __future__ import annotations

import contextlib
import fcntl
from pathlib import Path
from types import TracebackType
from typing import Any

from google.protobuf.descriptor import FileDescriptor  # type: ignore[import-untyped]
from google.protobuf.descriptor_pb2 import FileDescriptorSet  # type: ignore[import-untyped]
from mcap.records import Channel, Message, Schema
from mcap.writer import CompressionType, Writer

CHANNELS = "paramove.channels"
"""Metadata that tells again which channel is which topic: with the chunk that tells it first, all would be lost."""
CHUNK_BYTES = 64 * 1024
CHUNK_NS = 250_000_000
"""Of the time of publication; a longer chunk would lose more with a process that is killed."""


class RecordingExistsError(FileExistsError):
    """A recording is never written over another."""


class RecordingWriter:
    """An MCAP file being written; finished by `close` or at the end of a `with` block.

    Args:
        path: Of the finished file.
        library: What wrote it, for people.

    Raises:
        RecordingExistsError: There is a file of that name already, finished or not.
    """

    def __init__(self, path: Path, library: str) -> None:
        self.path = path
        self._part = path.with_name(path.name + ".part")
        for existing in (path, self._part):
            if existing.exists():
                raise RecordingExistsError(f"{existing} exists; recordings are never overwritten: choose another name")
        self._file = self._part.open("xb")
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # ends with this process, however it ends
        self._writer = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library=library)
        self._chunk_begun_ns: int | None = None
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}

    def write(self, topic: str, message: Any, log_ns: int, publish_ns: int, sequence: int) -> None:
        """Append a protobuf message.

        Args:
            topic: Name of its topic.
            message: The message.
            log_ns: Time by which the recording is ordered.
            publish_ns: When it was said.
            sequence: Of the publisher.
        """
        self._append(
            self._channel(topic, message), log_ns, publish_ns, sequence, message.SerializeToString(deterministic=True)
        )

    def copy(self, channel: Channel, schema: Schema, message: Message) -> None:
        """Append a message of another recording as it is there."""
        number = self._registered(channel.topic, channel.message_encoding, schema.name, schema.encoding, schema.data)
        self._append(number, message.log_time, message.publish_time, message.sequence, message.data)

    def note(self, name: str, values: dict[str, str]) -> None:
        """Add a metadata record."""
        self._writer.add_metadata(name, values)

    def close(self) -> None:
        """Write the index, close the file and give it its name."""
        if self._file.closed:
            return
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()
        self._part.rename(self.path)

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _append(self, channel: int, log_ns: int, publish_ns: int, sequence: int, data: bytes) -> None:
        if self._chunk_begun_ns is None:
            self._chunk_begun_ns = publish_ns
        elif not 0 <= publish_ns - self._chunk_begun_ns < CHUNK_NS:
            self._writer.flush()  # type: ignore[no-untyped-call]
            self._chunk_begun_ns = publish_ns
        self._writer.add_message(
            channel_id=channel, log_time=log_ns, publish_time=publish_ns, sequence=sequence % 2**32, data=data
        )

    def _channel(self, topic: str, message: Any) -> int:
        if topic in self._channels:
            return self._channels[topic]
        descriptor = message.DESCRIPTOR
        schema = schema_of(descriptor.file).SerializeToString()
        return self._registered(topic, "protobuf", descriptor.full_name, "protobuf", schema)

    def _registered(self, topic: str, message_encoding: str, schema: str, schema_encoding: str, data: bytes) -> int:
        """Number of the channel of a topic, which is made, with its schema, where there is none yet."""
        if topic not in self._channels:
            if schema not in self._schemas:
                self._schemas[schema] = self._writer.register_schema(name=schema, encoding=schema_encoding, data=data)
            self._channels[topic] = self._writer.register_channel(
                topic=topic, message_encoding=message_encoding, schema_id=self._schemas[schema]
            )
            self.note(CHANNELS, {name: str(number) for name, number in self._channels.items()})
        return self._channels[topic]


def schema_of(file: FileDescriptor) -> FileDescriptorSet:
    """The file of a message and every file it imports, imported ones first."""
    found: dict[str, FileDescriptor] = {}

    def add(one: FileDescriptor) -> None:
        if one.name in found:
            return
        for needed in one.dependencies:
            add(needed)
        found[one.name] = one

    add(file)
    files = FileDescriptorSet()
    for one in found.values():
        one.CopyToProto(files.file.add())
    return files
