"""Decompresses chunks of MCAP files, within limits whatever size they claim."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO

import lz4.frame  # type: ignore[import-untyped]  # comes with mcap, as zstandard does
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Message, Schema
from zstandard import ZstdDecompressor, ZstdError

HEAD_BYTES = 9  # opcode and length of a record
MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Of a message's record: channel, sequence, log time, publish time; the rest is the message (MCAP specification)."""
RECORD_BYTES = 128 * 2**20
"""Of one record in a file, and of a chunk decompressed. Our chunks have 64 KiB, those of other writers some MiB."""
ALWAYS_BYTES = 16 * 2**20
MAX_RATIO = 100
"""All chunks together may be so many times as large as their file; measured: 2 to 20."""
WRONG = (McapError, ValueError, EOFError, struct.error, ZstdError, OverflowError, MemoryError, KeyError, RuntimeError)
"""Exceptions that a reader raises for a damaged record."""


def allowance(file_bytes: int) -> int:
    """Bytes to which all chunks of a file of that size may decompress together."""
    return ALWAYS_BYTES + MAX_RATIO * file_bytes


def whole(chunk: Chunk, max_bytes: int) -> bytes:
    """The records in a chunk; raises one of WRONG if it is damaged, or larger than `max_bytes`."""
    if chunk.uncompressed_size > min(max_bytes, RECORD_BYTES):
        raise ValueError(f"it claims {chunk.uncompressed_size} bytes")
    data = begin(chunk.compression, chunk.data, chunk.uncompressed_size + 1)
    if len(data) != chunk.uncompressed_size:
        raise ValueError(f"it claims {chunk.uncompressed_size} bytes and has {len(data)}")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("its checksum does not match")
    return data


def begin(compression: str, data: bytes, max_bytes: int) -> bytes:
    """The first decompressed bytes of `data`, at most `max_bytes`; raises one of WRONG."""
    if compression == "zstd":
        return bytes(ZstdDecompressor().stream_reader(data).read(max_bytes))
    if compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=max_bytes))
    if compression:
        raise ValueError(f"compressed with {compression}, which is not read")
    return data[:max_bytes]


def records(data: bytes, cut: bool) -> Iterator[tuple[int, Channel | Schema | Message]]:
    """The records in a chunk's data, with their offsets; raises one of WRONG if the last is not whole and not `cut`."""
    at = 0
    while at + HEAD_BYTES <= len(data):
        length = struct.unpack_from("<Q", data, at + 1)[0]
        end = at + HEAD_BYTES + length
        if end > len(data):
            break
        if data[at] == Opcode.MESSAGE:  # most are; five times as fast as a stream
            if length < MESSAGE_HEAD.size:
                raise ValueError("a message is shorter than its head")
            channel, sequence, log_ns, publish_ns = MESSAGE_HEAD.unpack_from(data, at + HEAD_BYTES)
            yield at, Message(channel, log_ns, data[at + HEAD_BYTES + MESSAGE_HEAD.size : end], publish_ns, sequence)
        elif data[at] == Opcode.CHANNEL:
            yield at, Channel.read(ReadDataStream(BytesIO(data[at + HEAD_BYTES : end])))
        elif data[at] == Opcode.SCHEMA:
            yield at, Schema.read(ReadDataStream(BytesIO(data[at + HEAD_BYTES : end])))
        elif not data[at]:
            break  # there is no record of kind 0
        at = end
    if at < len(data) and not cut:
        raise ValueError("a record is invalid or longer than its chunk")
