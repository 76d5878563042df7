"""The fixed header of every message on the bus.

A message is two frames: the topic's name ending in `\\0` with this header behind it, and the payload (protobuf). The
header has 56 bytes, little-endian:

    offset  size  field
    0       2     magic, 0x4D50
    2       1     version of this layout, 1
    3       1     flags
    4       8     schema hash of the message type
    12      8     publisher id, from the node's name
    20      4     epoch, new at each start of the publisher
    24      8     sequence within the epoch, from 1
    32      8     publish time, ns of the bus clock, signed
    40      8     capture time, ns of the bus clock, signed
    48      4     payload length
    52      4     CRC-32 of the payload and of the 52 bytes above

Checked in the order size, magic, version, schema, length, CRC; the subscriber then checks the sequence and the
times and decodes last. Protobuf alone would accept most damaged messages.
"""

from __future__ import annotations

import enum
import hashlib
import struct
import zlib
from typing import NamedTuple

from paramove.bus.schemas import type_of_hash
from paramove.bus.soundness import LATEST_NS

MAGIC = 0x4D50
VERSION = 1
_LAYOUT = struct.Struct("<HBBQQIQqqI")
_CRC = struct.Struct("<I")
_WHOLE = struct.Struct("<HBBQQIQqqII")
SIZE = _WHOLE.size

FLAG_WELCOME = 1
"""Sent because somebody subscribed; the sequence is that of the latest message published so far."""
FLAG_LAST_VALUE = 2
"""With FLAG_WELCOME: the payload is the latest message, sent again. Without: a welcome has no message in it."""
FLAG_RING = 4
"""The payload is a handle; the message lies in the publisher's ring (see `paramove.bus.image_ring`)."""


class Reason(enum.Enum):
    """Why a message was rejected.

    NUMBER: it holds NaN, infinity, a number above 1e12, an impossible time, or an enumeration's value without a name.
    """

    CONNECTION = "connection"
    FRAMES = "frames"
    SIZE = "size"
    MAGIC = "magic"
    VERSION = "version"
    SCHEMA = "schema"
    LENGTH = "length"
    CRC = "crc"
    EPOCH = "epoch"
    BUDGET = "budget"
    DECODE = "decode"
    NUMBER = "number"
    RING = "ring"


class RejectedError(Exception):
    """A message that its topic cannot carry. `reason` is counted, the text has the values found and expected."""

    def __init__(self, reason: Reason, message: str) -> None:
        super().__init__(message)
        self.reason = reason


class Envelope(NamedTuple):
    """The header's fields; times in ns of the bus clock."""

    schema: int
    publisher: int
    epoch: int
    sequence: int
    published_ns: int
    captured_ns: int
    flags: int = 0
    length: int = 0

    @property
    def is_welcome(self) -> bool:
        """Whether it was sent because of a new subscription."""
        return bool(self.flags & FLAG_WELCOME)

    @property
    def has_possible_times(self) -> bool:
        """Whether a clock can have shown its times; what was measured before simulated time began is negative."""
        return abs(self.published_ns) <= LATEST_NS and abs(self.captured_ns) <= LATEST_NS

    @property
    def has_message(self) -> bool:
        """Whether the payload is a message (of a welcome: the last value of a latched topic)."""
        return not self.is_welcome or bool(self.flags & FLAG_LAST_VALUE)


def publisher_id(node: str) -> int:
    """64-bit number of a node, from its name."""
    return int.from_bytes(hashlib.sha256(node.encode()).digest()[:8], "little")


def pack(envelope: Envelope, payload: bytes) -> bytes:
    """Header bytes for `payload`; the envelope's own `length` is ignored."""
    schema, publisher, epoch, sequence, published_ns, captured_ns, flags, _ = envelope
    head = _LAYOUT.pack(
        MAGIC, VERSION, flags, schema, publisher, epoch, sequence, published_ns, captured_ns, len(payload)
    )
    return head + _CRC.pack(zlib.crc32(payload, zlib.crc32(head)))


def unpack(header: bytes, payload: bytes, schema: int, max_bytes: int) -> Envelope:
    """Checks and reads a header.

    Args:
        header: The 56 bytes.
        payload: The frame after it.
        schema: Hash of the type that the topic carries.
        max_bytes: Largest payload of the topic.

    Raises:
        RejectedError: with the first check that fails.
    """
    if len(header) != SIZE:
        raise RejectedError(Reason.SIZE, f"header has {len(header)} bytes, expected {SIZE}")
    magic, version, flags, header_schema, publisher, epoch, sequence, published_ns, captured_ns, length, crc = (
        _WHOLE.unpack(header)
    )
    if magic != MAGIC:
        raise RejectedError(Reason.MAGIC, f"magic is {magic:#06x}, expected {MAGIC:#06x}: not a message of this bus")
    if version != VERSION:
        raise RejectedError(Reason.VERSION, f"envelope version is {version}, this program reads version {VERSION}")
    if header_schema != schema:
        raise RejectedError(Reason.SCHEMA, _schema_message(header_schema, schema))
    if length != len(payload) or length > max_bytes:
        raise RejectedError(
            Reason.LENGTH, f"payload has {len(payload)} bytes, header says {length}, allowed are {max_bytes}"
        )
    if crc != zlib.crc32(payload, zlib.crc32(header[: _LAYOUT.size])):
        raise RejectedError(Reason.CRC, f"CRC of sequence {sequence} is wrong: the bytes were damaged on their way")
    return Envelope(schema, publisher, epoch, sequence, published_ns, captured_ns, flags, length)


def _schema_message(received: int, expected: int) -> str:
    """Names both sides of a schema mismatch."""
    unknown = "unknown here, or defined otherwise when the publisher was started"
    names = [type_of_hash(value) or unknown for value in (received, expected)]
    return (
        f"schema hash is {received:#018x} ({names[0]}), the topic carries {expected:#018x} ({names[1]}); "
        "correct the publisher, run every process from the same installation, and start all of them again after a "
        "change of a message"
    )
