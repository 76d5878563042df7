"""Keeps the truth of a run in an MCAP file with protobuf schemas, which viewers open as they open any recording."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Any

from google.protobuf.descriptor import FileDescriptor  # type: ignore[import-untyped]
from google.protobuf.descriptor_pb2 import FileDescriptorSet  # type: ignore[import-untyped]
from mcap.writer import CompressionType, Writer


class TruthRecording:
    """An MCAP file being written; closed by `close` or at the end of a `with` block."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb")
        self._writer = Writer(self._file, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library="paramove judge")
        self._channels: dict[str, int] = {}
        self._sequence: dict[str, int] = {}

    def write(self, topic: str, message: Any, time_ns: int) -> None:
        """Append a protobuf message at a simulated time."""
        if topic not in self._channels:
            descriptor = message.DESCRIPTOR
            schema = self._writer.register_schema(
                name=descriptor.full_name, encoding="protobuf", data=_schema_of(descriptor.file).SerializeToString()
            )
            self._channels[topic] = self._writer.register_channel(
                topic=topic, message_encoding="protobuf", schema_id=schema
            )
        self._sequence[topic] = self._sequence.get(topic, 0) + 1
        self._writer.add_message(
            channel_id=self._channels[topic],
            log_time=time_ns,
            publish_time=time_ns,
            sequence=self._sequence[topic],
            data=message.SerializeToString(deterministic=True),
        )

    def close(self) -> None:
        """Writes the index and closes the file."""
        if not self._file.closed:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()

    def __enter__(self) -> TruthRecording:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _schema_of(file: FileDescriptor) -> FileDescriptorSet:
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
