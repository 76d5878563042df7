"""What can be read of an MCAP file whose writer was killed or whose bytes are damaged, and where the damage is."""

from __future__ import annotations

import mmap
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from io import BytesIO
from typing import Any

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from paramove.bus import topics
from paramove.recording.chunks import HEAD_BYTES, RECORD_BYTES, WRONG, allowance, begin, records, whole
from paramove.recording.writer import CHANNELS

MAGIC = b"\x89MCAP0\r\n"
CHUNK_HEAD_BYTES = 40  # of a chunk, without the name of its compression
Content = mmap.mmap | bytes

COMPRESSION = re.compile(rb"\x04\x00\x00\x00zstd|\x03\x00\x00\x00lz4")
BEFORE_COMPRESSION = HEAD_BYTES + 28


@dataclass(frozen=True)
class Damage:
    """Bytes that cannot be used.

    Attributes:
        begin: First of them.
        end: One past the last.
        what: In words.
        messages: How many were in them; None if unknown.
    """

    begin: int
    end: int
    what: str
    messages: int | None = None


@dataclass(frozen=True)
class Sound:
    """A chunk, or a message outside chunks, that can be used.

    Attributes:
        begin: First byte of the record.
        messages: How many messages are in it.
        first_ns: Earliest of their log times.
        last_ns: Latest of them.
    """

    begin: int
    messages: int
    first_ns: int
    last_ns: int

    @classmethod
    def of(cls, begin: int, messages: list[Message]) -> Sound:
        """With count and times of `messages`."""
        times = [message.log_time for message in messages] or [0]
        return cls(begin, len(messages), min(times), max(times))


@dataclass
class Survey:
    """A whole file, read once: sound parts, and the records that are needed to decode the rest.

    Attributes:
        parts: Sound chunks, and damages between them, in the order of the file.
        channels: By number.
        schemas: By number.
        notes: Metadata, without those that the writer of recordings makes for itself.
        statistics: Of a file that was finished.
        finished: Whether the file ends as a finished one does.
        indexed: Expected index of the latest chunk, by channel: log time and offset of its messages.
        allowed: Bytes to which further chunks may decompress.
    """

    parts: list[Sound | Damage] = field(default_factory=list)
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    notes: list[Metadata] = field(default_factory=list)
    statistics: Statistics | None = None
    finished: bool = False
    indexed: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    allowed: int = 0

    @property
    def damages(self) -> list[Damage]:
        """Where the file cannot be read."""
        return [part for part in self.parts if isinstance(part, Damage)]

    def take(self, record: object, checked: bool) -> None:
        """Stores a record that is needed to decode others; prefers one from a chunk, which has a checksum."""
        if isinstance(record, Channel):
            self.channels[record.id] = record if checked else self.channels.get(record.id, record)
        elif isinstance(record, Schema):
            self.schemas[record.id] = record if checked else self.schemas.get(record.id, record)
        elif isinstance(record, Statistics):
            self.statistics = record
        elif isinstance(record, Metadata) and f"{record.name}.".startswith(f"{CHANNELS}."):
            self._take_channels(record)  # of the present form, or of the last release's, whose names repeat
        elif isinstance(record, Metadata):
            self.notes.append(record)

    def _take_channels(self, record: Metadata) -> None:
        """Channels whose own records are lost; the topic table has their types."""
        for topic, written in record.metadata.items():
            number = int(written)
            if number in self.channels:
                continue
            schema = -number  # not a number of the file, which may be in use
            name = topics.by_name(topic).type_name  # a KeyError means that the record is damaged
            self.channels[number] = Channel(number, topic, "protobuf", {}, schema)
            self.schemas[schema] = Schema(schema, b"", "protobuf", name)


def survey(content: Content) -> Survey:
    """Reads everything that is sound; never raises for what is in a file."""
    size = len(content)
    result = Survey(allowed=allowance(size))
    at = len(MAGIC) if content[: len(MAGIC)] == MAGIC else 0
    result.finished = size >= 2 * len(MAGIC) and content[size - len(MAGIC) :] == MAGIC
    if at == 0:
        at = _next_chunk(content, 0)
        result.parts.append(Damage(0, at, "not the beginning of a recording"))
    while at < size:
        if result.finished and at == size - len(MAGIC):
            break
        at = _take_record(content, at, result)
    return result


def messages_of(content: Content, sound: Sound) -> Iterator[Message]:
    """The messages of a sound part of the file that was surveyed."""
    yield from (record for _, record in _records_at(content, sound.begin) if isinstance(record, Message))


def _take_record(content: Content, at: int, result: Survey) -> int:
    """Takes the record at `at`, or notes a damage; returns where to continue."""
    if _is_chunk(content, at):
        return _take_chunk(content, at, result)
    end = at + HEAD_BYTES + _length(content, at)
    if at + HEAD_BYTES <= len(content) and end <= min(len(content), at + RECORD_BYTES) and content[at] in _READERS:
        try:
            record = _record(content, at, end)
            if isinstance(record, Footer) and not _summary_is_sound(content, at, record):
                raise ValueError("the checksum of the summary does not match")
            _take_other(record, at, end, result)
            return end
        except WRONG:
            pass
    resume = _next_chunk(content, at + 1)
    cut = resume == len(content) and not result.finished
    result.parts.append(Damage(at, resume, "it ends in the middle of a record" if cut else "a record is damaged"))
    return resume


def _length(content: Content, at: int) -> int:
    """Of the record at `at`, without its head; 0 where the file ends within the head."""
    head = content[at : at + HEAD_BYTES]
    return int.from_bytes(head[1:], "little") if len(head) == HEAD_BYTES else 0


def _record(content: Content, at: int, end: int) -> Any:
    """The record, which is no chunk; raises one of WRONG if its length is wrong."""
    stream, reader = ReadDataStream(BytesIO(content[at + HEAD_BYTES : end])), _READERS[content[at]]
    length = end - at - HEAD_BYTES
    record = Message.read(stream, length) if reader is Message else reader.read(stream)
    if stream.count != length:
        raise ValueError("a record of another length")
    return record


def _summary_is_sound(content: Content, at: int, footer: Footer) -> bool:
    end = at + HEAD_BYTES + 16
    return not footer.summary_crc or zlib.crc32(content[footer.summary_start or at : end]) == footer.summary_crc


def _take_other(record: object, at: int, end: int, result: Survey) -> None:
    last = result.parts[-1] if result.parts else None
    if isinstance(record, Message):
        result.parts.append(Sound.of(at, [record]))
    elif (
        isinstance(record, MessageIndex)
        and not result.indexed
        and isinstance(last, Damage)
        and last.messages is not None
    ):
        # The index of a lost chunk has the number of its messages.
        result.parts[-1] = replace(last, messages=last.messages + len(record.records))
    elif isinstance(record, MessageIndex):
        if result.indexed.get(record.channel_id) != list(record.records):
            result.parts.append(Damage(at, end, "an index is damaged", 0))
    else:
        result.take(record, checked=False)


def _is_chunk(content: Content, at: int) -> bool:
    """Whether there is a chunk, the lengths in whose head agree; it may go beyond the end of the file."""
    head = content[at : at + BEFORE_COMPRESSION + 4]
    if len(head) < BEFORE_COMPRESSION + 4 or head[0] != Opcode.CHUNK:
        return False
    name = int.from_bytes(head[-4:], "little")
    after = at + BEFORE_COMPRESSION + 4 + name
    if name > 8 or after + 8 > len(content):
        return False
    return _length(content, at) == CHUNK_HEAD_BYTES + name + int.from_bytes(content[after : after + 8], "little")


def _next_chunk(content: Content, at: int) -> int:
    """Where the next compressed chunk begins; the end of the file if there is none."""
    for match in COMPRESSION.finditer(content, at):
        begin = match.start() - BEFORE_COMPRESSION
        if begin >= at and _is_chunk(content, begin):
            return begin
    return len(content)


def _take_chunk(content: Content, at: int, result: Survey) -> int:
    """Takes a chunk, or as much of it as was written before the file ends; returns where to continue."""
    end = at + HEAD_BYTES + _length(content, at)
    cut = end > len(content)
    try:
        data = _data_of(content, at, result.allowed)
        result.allowed -= len(data)
        placed = list(records(data, cut))
    except WRONG:
        placed = []
        if not cut:
            result.indexed = {}
            result.parts.append(Damage(at, end, "a chunk is damaged", 0))
            return end
    messages: list[Message] = []
    result.indexed = {}
    for offset, record in placed:
        if isinstance(record, Message):
            messages.append(record)
            result.indexed.setdefault(record.channel_id, []).append((record.log_time, offset))
        else:
            result.take(record, checked=True)
    if messages:
        result.parts.append(Sound.of(at, messages))
    if cut:
        result.parts.append(Damage(at, len(content), "it ends in the middle of a chunk"))
    return min(end, len(content))


def _records_at(content: Content, at: int) -> Iterator[tuple[int, Channel | Schema | Message]]:
    """Records of the chunk, or the message, at `at`, with their offset; of a chunk that is cut off, the whole ones."""
    end = at + HEAD_BYTES + _length(content, at)
    if content[at] == Opcode.MESSAGE:
        yield at, _record(content, at, end)
    else:
        yield from records(_data_of(content, at, RECORD_BYTES), cut=end > len(content))


def _data_of(content: Content, at: int, max_bytes: int) -> bytes:
    """The data of the chunk at `at`; of one that is cut off, as much as its written bytes give."""
    end = at + HEAD_BYTES + _length(content, at)
    if min(end, len(content)) - at > RECORD_BYTES:
        raise ValueError("a chunk that is too large")
    missing = max(0, end - len(content))
    added = bytes(min(missing, 1))  # where nothing of the data was written, the reader would raise an exception
    chunk = Chunk.read(ReadDataStream(BytesIO(content[at + HEAD_BYTES : end] + added)))
    if not missing:
        return whole(chunk, max_bytes)
    return begin(chunk.compression, chunk.data[:-1], min(max_bytes, RECORD_BYTES))


_READERS: dict[int, Any] = {
    Opcode.HEADER: Header,
    Opcode.FOOTER: Footer,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.MESSAGE: Message,
    Opcode.MESSAGE_INDEX: MessageIndex,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.ATTACHMENT: Attachment,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
    Opcode.STATISTICS: Statistics,
    Opcode.METADATA: Metadata,
    Opcode.METADATA_INDEX: MetadataIndex,
    Opcode.SUMMARY_OFFSET: SummaryOffset,
    Opcode.DATA_END: DataEnd,
}
"""Kinds of records outside chunks. Attachments are read and discarded: our recordings have none."""
