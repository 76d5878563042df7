"""Packets of Dynamixel servos as bytes: Protocol 2.0 (ROBOTIS e-Manual, "Protocol 2.0").

A packet is FF FF FD 00, an id, the length of what follows, an instruction, parameters and a checksum. Within it
FF FF FD is written FF FF FD FD ("byte stuffing"), so that this header begins packets only.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

HEADER = b"\xff\xff\xfd"
BEFORE_LENGTH = 5
"""Header, a zero and the id."""
BEFORE_INSTRUCTION = BEFORE_LENGTH + 2
BROADCAST = 254
LONGEST_LENGTH = 1024
"""Maximum of what follows the length; a larger one is noise. The SDK has the same maximum."""
POLYNOMIAL = 0x8005


class Instruction(IntEnum):
    """What a packet requests; `STATUS` is the reply."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    FACTORY_RESET = 0x06
    REBOOT = 0x08
    CLEAR = 0x10
    BACKUP = 0x20
    STATUS = 0x55
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83
    FAST_SYNC_READ = 0x8A
    BULK_READ = 0x92
    BULK_WRITE = 0x93
    FAST_BULK_READ = 0x9A


class StatusError(IntEnum):
    """Error number of a status packet, its bits 0 to 6; bit 7 is `ALERT`."""

    NONE = 0
    RESULT_FAIL = 1
    INSTRUCTION = 2
    CHECKSUM = 3
    DATA_RANGE = 4
    DATA_LENGTH = 5
    DATA_LIMIT = 6
    ACCESS = 7


ALERT = 0x80
"""Bit of the error: the servo's Hardware Error Status (70) is not 0."""


@dataclass(frozen=True)
class Packet:
    """A packet without what the wire adds.

    Attributes:
        id: Of the servo that is asked or that replies, or `BROADCAST`.
        instruction: One of `Instruction`, or a number that no servo knows.
        parameters: Without stuffing.
    """

    id: int
    instruction: int
    parameters: bytes = b""


@dataclass(frozen=True)
class DamagedPacket:
    """A packet whose checksum is wrong; its id may be wrong too."""

    id: int


def _checksums() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        value = byte << 8
        for _ in range(8):
            value = (value << 1) ^ (POLYNOMIAL if value & 0x8000 else 0)
        table.append(value & 0xFFFF)
    return tuple(table)


_CHECKSUMS = _checksums()


def checksum(data: bytes) -> int:
    """CRC-16 with polynomial 0x8005, most significant bit first, from 0."""
    value = 0
    for byte in data:
        value = (value << 8) & 0xFFFF ^ _CHECKSUMS[value >> 8 ^ byte]
    return value


def encoded(packet: Packet) -> bytes:
    """The bytes on the wire."""
    content = bytes([packet.instruction, *packet.parameters]).replace(HEADER, HEADER + b"\xfd")
    data = HEADER + bytes([0, packet.id]) + (len(content) + 2).to_bytes(2, "little") + content
    return data + checksum(data).to_bytes(2, "little")


def decoded(data: bytes) -> Packet:
    """The packet of its bytes on the wire, from the header on; the checksum is not looked at."""
    content = data[BEFORE_INSTRUCTION:-2].replace(HEADER + b"\xfd", HEADER)
    return Packet(data[BEFORE_LENGTH - 1], content[0], content[1:])


class PacketReader:
    """Finds packets in received bytes, in pieces of any size; other bytes are skipped."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, data: bytes) -> Iterator[Packet | DamagedPacket]:
        """The packets that these bytes complete."""
        self._bytes += data
        while (packet := self._next()) is not None:
            yield packet

    def _next(self) -> Packet | DamagedPacket | None:
        while self._to_header():
            size = BEFORE_INSTRUCTION + int.from_bytes(self._bytes[BEFORE_LENGTH:BEFORE_INSTRUCTION], "little")
            if not BEFORE_INSTRUCTION + 3 <= size <= BEFORE_INSTRUCTION + LONGEST_LENGTH:
                del self._bytes[0]
                continue
            if len(self._bytes) < size:
                return None
            data = bytes(self._bytes[:size])
            if checksum(data[:-2]) != int.from_bytes(data[-2:], "little"):
                del self._bytes[: len(HEADER)]  # a packet may begin within what only seemed to be one
                return DamagedPacket(data[BEFORE_LENGTH - 1])
            del self._bytes[:size]
            return decoded(data)
        return None

    def _to_header(self) -> bool:
        """Drop the bytes before the next header; whether header, id and length are there."""
        while True:
            start = self._bytes.find(HEADER)
            if start < 0:
                n_begun = next((n for n in (2, 1) if self._bytes.endswith(HEADER[:n])), 0)
                del self._bytes[: len(self._bytes) - n_begun]
                return False
            del self._bytes[:start]
            if len(self._bytes) < BEFORE_INSTRUCTION:
                return False
            if self._bytes[3] != 0xFD:  # else it is stuffed: not a header
                return True
            del self._bytes[0]
