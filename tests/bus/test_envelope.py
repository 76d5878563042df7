"""The envelope: what goes in comes out, what was damaged is refused."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.bus.envelope import MAGIC, SIZE, Envelope, Reason, RejectedError, pack, publisher_id, unpack
from paramove.bus.schemas import schema_hash
from paramove.msgs.clock_pb2 import Clock
from paramove.msgs.gesture_pb2 import Gesture

UNSIGNED_64 = st.integers(0, 2**64 - 1)
TIME = st.integers(-(2**63), 2**63 - 1)
ENVELOPES = st.builds(
    Envelope, UNSIGNED_64, UNSIGNED_64, st.integers(0, 2**32 - 1), UNSIGNED_64, TIME, TIME, st.integers(0, 255)
)
CLOCK = Envelope(schema_hash(Clock), publisher_id("simulator"), 7, 3, 10, 20)


@settings(deadline=None, derandomize=True, max_examples=100)
@given(ENVELOPES, st.binary(max_size=300))
def test_round_trip(envelope: Envelope, payload: bytes) -> None:
    header = pack(envelope, payload)
    assert len(header) == SIZE == 56
    assert unpack(header, payload, envelope.schema, 300) == envelope._replace(length=len(payload))


@settings(deadline=None, derandomize=True, max_examples=20)
@given(ENVELOPES, st.binary(min_size=1, max_size=20))
def test_every_single_bit_flip_is_refused(envelope: Envelope, payload: bytes) -> None:
    whole = pack(envelope, payload) + payload
    for bit in range(8 * len(whole)):
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << bit % 8
        with pytest.raises(RejectedError):
            unpack(bytes(damaged[:SIZE]), bytes(damaged[SIZE:]), envelope.schema, 300)


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.binary(max_size=120), st.binary(max_size=50))
def test_foreign_bytes_are_refused(header: bytes, payload: bytes) -> None:
    with pytest.raises(RejectedError):
        unpack(header, payload, CLOCK.schema, 300)


def _altered(index: int, value: int) -> bytes:
    header = bytearray(pack(CLOCK, b"ab"))
    header[index] = value
    return bytes(header)


@pytest.mark.parametrize(
    ("header", "payload", "limit", "reason"),
    [
        (b"", b"ab", 9, Reason.SIZE),
        (pack(CLOCK, b"ab") + b"\0", b"ab", 9, Reason.SIZE),
        (_altered(0, 0), b"ab", 9, Reason.MAGIC),
        (_altered(2, 9), b"ab", 9, Reason.VERSION),
        (_altered(4, 0), b"ab", 9, Reason.SCHEMA),
        (pack(CLOCK, b"ab"), b"abc", 9, Reason.LENGTH),
        (pack(CLOCK, b"ab"), b"ab", 1, Reason.LENGTH),
        (pack(CLOCK, b"ab"), b"ax", 9, Reason.CRC),
        (_altered(20, 99), b"ab", 9, Reason.CRC),
    ],
)
def test_the_first_failing_check_is_the_reason(header: bytes, payload: bytes, limit: int, reason: Reason) -> None:
    with pytest.raises(RejectedError) as rejected:
        unpack(header, payload, CLOCK.schema, limit)
    assert rejected.value.reason is reason


def test_a_schema_mismatch_names_both_types() -> None:
    with pytest.raises(RejectedError, match=r"paramove\.msgs\.Clock.*paramove\.msgs\.Gesture.*same installation"):
        unpack(pack(CLOCK, b""), b"", schema_hash(Gesture), 9)


def test_the_layout_is_little_endian_and_fixed() -> None:
    header = pack(CLOCK, b"ab")
    assert header[:4] == MAGIC.to_bytes(2, "little") + b"\x01\x00"
    assert header[20:32] == (7).to_bytes(4, "little") + (3).to_bytes(8, "little")
    assert header[48:52] == (2).to_bytes(4, "little")
