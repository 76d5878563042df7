"""Recordings: MCAP files with protobuf schemas, which Foxglove, rerun and the mcap tools open unmodified.

The file has the suffix `.part` until it is finished, and only its owner may read it. A process that is killed loses the
messages after its last `flush`.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
from io import FileIO
from pathlib import Path
from types import TracebackType
from typing import Any

from google.protobuf.descriptor import FileDescriptor  # type: ignore[import-untyped]
from google.protobuf.descriptor_pb2 import FileDescriptorSet  # type: ignore[import-untyped]
from mcap.records import Channel, Message, Schema
from mcap.writer import CompressionType, Writer

from paramove.documents import rename_durably

CHANNELS = "paramove.channels"
"""Metadata that says again which channel is which topic: otherwise losing the chunk with that record loses all. One
record for each channel, with its number behind a dot: readers such as rerun expect names and keys that are unique."""
CHUNK_BYTES = 64 * 1024
CHUNK_NS = 250_000_000
"""Of publication time; damage to a longer chunk would cost more."""


class RecordingExistsError(FileExistsError):
    """A recording never overwrites another."""


class RecordingWriter:
    """An MCAP file being written; finished by `close` or at the end of a `with` block.

    Args:
        path: Of the finished file.
        library: Name of the recording program, for the file's header.

    Attributes:
        path: As given.
        unwritten: Messages since the last `flush` that succeeded; some of them may be in the file.

    Raises:
        RecordingExistsError: There is a file of that name already, finished or not.
        OSError: It cannot be written, as on a full disk. Also `write`, `copy`, `flush` and `close` raise it. Nothing is
            lost then: unwritten messages stay queued for the next `flush` or `close`.
    """

    def __init__(self, path: Path, library: str) -> None:
        self.path = path
        self._part = path.with_name(path.name + ".part")
        for existing in (path, self._part):
            if existing.exists():
                raise RecordingExistsError(f"{existing} exists; recordings are never overwritten: choose another name")
        self._file = FileIO(self._part, "xb", opener=_private)
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # ends with this process, however it ends
        self._stream = _Stream(self._file)
        self._writer = Writer(self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)  # type: ignore[arg-type]
        self._writer.start(profile="", library=library)
        self._finished = False
        self._chunk_begun_ns: int | None = None
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self.unwritten = 0
        try:
            self.flush()
        except OSError:  # a full disk: do not leave an empty file
            self.abandon()
            self._part.unlink()
            raise

    def write(self, topic: str, message: Any, log_ns: int, publish_ns: int, sequence: int) -> None:
        """Append a protobuf message.

        Args:
            topic: Name of its topic.
            message: The message.
            log_ns: Time by which the recording is ordered.
            publish_ns: When it was published.
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

    def flush(self) -> None:
        """Ends the chunk and hands everything to the operating system: it survives the end of this process."""
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._stream.drain()
        self.unwritten = 0

    def sync(self) -> None:
        """Waits until flushed data is on the disk: it survives a power failure. For another thread."""
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Write the index, close the file and give it its name."""
        if self._file.closed:
            return
        if not self._finished:
            self.flush()
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._finished = True
        self._stream.drain()
        self.sync()
        self._file.close()
        rename_durably(self._part, self.path)

    def abandon(self) -> None:
        """Close the file as it is, unfinished, without what was not written."""
        self._file.close()

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        finally:
            self.abandon()

    def _append(self, channel: int, log_ns: int, publish_ns: int, sequence: int, data: bytes) -> None:
        begun_ns = self._chunk_begun_ns
        ends_chunk = begun_ns is None or not 0 <= publish_ns - begun_ns < CHUNK_NS
        if ends_chunk:
            self._writer.flush()  # type: ignore[no-untyped-call]
            self._chunk_begun_ns = publish_ns
        self._writer.add_message(
            channel_id=channel, log_time=log_ns, publish_time=publish_ns, sequence=sequence % 2**32, data=data
        )
        self.unwritten += 1
        if ends_chunk or len(self._stream.waiting) >= CHUNK_BYTES:
            self._stream.drain()

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
            self._note_channel(topic)
        return self._channels[topic]

    def _note_channel(self, topic: str) -> None:
        number = self._channels[topic]
        self.note(f"{CHANNELS}.{number}", {topic: str(number)})


class _Stream:
    """Buffer of the MCAP writer; `drain` writes what is `waiting` to the file and keeps what an error left."""

    def __init__(self, file: FileIO) -> None:
        self._file = file
        self.waiting = bytearray()
        self._begun = 0

    def write(self, data: bytes) -> None:
        self.waiting += data

    def tell(self) -> int:
        return self._begun + len(self.waiting)

    def flush(self) -> None:
        """Does nothing at the end of a chunk: an error here would lose the first message of the next."""

    def drain(self) -> None:
        while self.waiting:
            written = self._file.write(self.waiting)
            del self.waiting[:written]
            self._begun += written


def _private(path: str, flags: int) -> int:
    descriptor = os.open(path, flags, 0o600)
    os.fchmod(descriptor, 0o600)  # whatever the umask
    return descriptor


def schema_of(file: FileDescriptor) -> FileDescriptorSet:
    """The file of a message and every file it imports, imported ones first."""
    files_by_name: dict[str, FileDescriptor] = {}

    def add(one: FileDescriptor) -> None:
        if one.name in files_by_name:
            return
        for needed in one.dependencies:
            add(needed)
        files_by_name[one.name] = one

    add(file)
    files = FileDescriptorSet()
    for one in files_by_name.values():
        one.CopyToProto(files.file.add())
    return files
