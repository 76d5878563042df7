"""Whatever bytes arrive on a topic: refused, counted by reason, told in the log, and the next message is heard."""

from __future__ import annotations

import random
import re
import resource
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import zmq

from paramove.bus import subscriber, topics
from paramove.bus.envelope import Reason
from paramove.bus.schemas import hash_of, schema_hash
from paramove.bus.subscriber import Received, Subscriber
from paramove.bus.topics import Topic
from paramove.msgs.clock_pb2 import Clock
from paramove.msgs.gesture_pb2 import Gesture
from tests.bus.conftest import RawPublisher, Wait

Context = zmq.Context[Any]
Hear = Callable[[], Received]
EVERY_TOPIC = [*topics.TOPICS, topics.status("camera")]


class Pair:
    """A raw speaker and our subscriber to it."""

    def __init__(self, context: Context, folder: Path, topic: Topic, wait: Wait) -> None:
        self.speaker = RawPublisher(context, folder, topic)
        self.subscriber = Subscriber(context, folder, topic)
        self._wait = wait
        wait(self.speaker.subscribed)

    def rejected(self, reason: Reason, count: int = 1) -> None:
        """Waits until so many messages were refused for that reason; nothing may be heard meanwhile."""
        counts = self.subscriber.counter.rejected
        self._wait(lambda: self.subscriber.receive() is None and counts[reason] >= count)
        assert counts[reason] == count

    def hears_the_next(self, payload: bytes = b"") -> Received:
        """Says a good message and waits for it."""
        self.speaker.say(payload)
        heard: Received = self._wait(self.subscriber.receive)
        assert heard.sequence == self.speaker.sequence
        return heard


@pytest.fixture
def gestures(context: Context, folder: Path, wait: Wait) -> Iterator[Pair]:
    pair = Pair(context, folder, topics.GESTURES, wait)
    yield pair
    pair.subscriber.close()


GOOD = Gesture(object="red").SerializeToString()


def test_random_bytes(gestures: Pair) -> None:
    generator = random.Random(1)
    for _ in range(300):
        payload = generator.randbytes(generator.randrange(200))
        gestures.speaker.socket.send_multipart([b"gestures\0" + generator.randbytes(56), payload])
    gestures.rejected(Reason.MAGIC, 300)
    assert gestures.hears_the_next(GOOD).message.object == "red"


def test_flipped_bits(gestures: Pair) -> None:
    """Every single bit of header and payload."""
    flips = 8 * (56 + len(GOOD))
    for bit in range(flips):
        head, payload = gestures.speaker.frames(GOOD)
        whole = bytearray(head + payload)
        whole[9 + bit // 8] ^= 1 << bit % 8
        gestures.speaker.socket.send_multipart([bytes(whole[: 9 + 56]), bytes(whole[9 + 56 :])])
    heard = gestures.hears_the_next(GOOD)
    assert heard.message.object == "red"
    assert gestures.subscriber.counter.rejected.total() == flips
    assert gestures.subscriber.counter.rejected[Reason.CRC] > flips / 2
    assert gestures.subscriber.counter.messages == 1


def test_truncated_bytes(gestures: Pair, caplog: pytest.LogCaptureFixture) -> None:
    for length in range(len(GOOD)):
        head, payload = gestures.speaker.frames(GOOD)
        gestures.speaker.socket.send_multipart([head, payload[:length]])
    gestures.rejected(Reason.LENGTH, len(GOOD))
    head, payload = gestures.speaker.frames(GOOD)
    gestures.speaker.socket.send_multipart([head[:-1], payload])
    gestures.rejected(Reason.SIZE)
    gestures.speaker.socket.send_multipart([head, payload, b""])
    gestures.rejected(Reason.FRAMES)
    assert gestures.hears_the_next(GOOD)
    assert f"payload has 0 bytes, header says {len(GOOD)}, allowed are 65536" in caplog.text
    assert "header has 55 bytes, expected 56" in caplog.text
    assert "3 frames, expected 2" in caplog.text


def test_another_type(gestures: Pair, caplog: pytest.LogCaptureFixture) -> None:
    gestures.speaker.say(b"", schema=schema_hash(Clock))
    gestures.rejected(Reason.SCHEMA)
    assert re.search(
        r"topic gestures: .*\(paramove\.msgs\.Clock\), the topic carries .*\(paramove\.msgs\.Gesture\); correct",
        caplog.text,
    )


def test_another_generation_of_the_type(gestures: Pair, caplog: pytest.LogCaptureFixture) -> None:
    gestures.speaker.say(b"", schema=hash_of("paramove.msgs.Gesture", 2))
    gestures.rejected(Reason.SCHEMA)
    pair = r"\(paramove\.msgs\.Gesture of generation 2\), the topic carries .*\(paramove\.msgs\.Gesture\)"
    assert re.search(pair, caplog.text)
    assert "run every process from the same installation" in caplog.text


def test_another_version_of_the_envelope(gestures: Pair, caplog: pytest.LogCaptureFixture) -> None:
    head, payload = gestures.speaker.frames(GOOD)
    gestures.speaker.socket.send_multipart([head[:11] + b"\x07" + head[12:], payload])
    gestures.rejected(Reason.VERSION)
    assert "envelope version is 7, this program reads version 1" in caplog.text


def test_a_flood_of_refused_messages_fills_no_log(gestures: Pair, caplog: pytest.LogCaptureFixture) -> None:
    for _ in range(900):
        gestures.speaker.socket.send_multipart([b"gestures\0", b""])
    gestures.rejected(Reason.SIZE, 900)
    assert [record.message.split(":")[1] for record in caplog.records] == [
        " message rejected (size, number 1)",
        " message rejected (size, number 10)",
        " message rejected (size, number 100)",
    ]


def _nested_groups(depth: int) -> bytes:
    """Groups (wire type 3) of an unknown field within each other."""
    return b"\xfb\x7f" * depth


@pytest.mark.parametrize("topic", EVERY_TOPIC, ids=lambda topic: topic.name)
def test_a_nesting_bomb_is_no_message(topic: Topic, context: Context, folder: Path, wait: Wait) -> None:
    pair = Pair(context, folder, topic, wait)
    pair.speaker.say(_nested_groups(topic.max_bytes // 2 if topic.max_bytes < 2**20 else 10_000))
    pair.rejected(Reason.DECODE)
    assert pair.subscriber.counter.messages == 0
    pair.hears_the_next()


@pytest.mark.parametrize("topic", EVERY_TOPIC, ids=lambda topic: topic.name)
def test_a_claim_of_two_gigabytes_within_the_payload_allocates_nothing(
    topic: Topic, context: Context, folder: Path, wait: Wait
) -> None:
    pair = Pair(context, folder, topic, wait)
    before_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in range(1, 16):
        pair.speaker.say(bytes([number << 3 | 2]) + b"\xff\xff\xff\xff\x07" + b"x" * 100)
    pair.rejected(Reason.DECODE, 15)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kib < 50_000
    pair.hears_the_next()


def test_a_million_elements_are_refused_before_they_are_decoded(
    context: Context, folder: Path, wait: Wait, monkeypatch: pytest.MonkeyPatch
) -> None:
    """2 MB of empty elements would become far more as objects; also the longest of topics refuses them."""
    pair = Pair(context, folder, topics.ARM_TRAJECTORY, wait)
    monkeypatch.setattr(subscriber, "decoded", lambda *_: pytest.fail("was decoded"))
    pair.speaker.say(b"\x1a\x00" * 10**6)
    wait(pair.subscriber.revive, pair.subscriber.receive)
    assert pair.subscriber.counter.rejected == {Reason.CONNECTION: 1}
    monkeypatch.undo()
    wait(pair.speaker.subscribed)
    pair.hears_the_next()


def test_a_length_beyond_the_frame_is_refused(gestures: Pair) -> None:
    """The header's own claim of 4 GB."""
    head, payload = gestures.speaker.frames(GOOD)
    gestures.speaker.socket.send_multipart([head[:-8] + b"\xff\xff\xff\xff" + head[-4:], payload])
    gestures.rejected(Reason.LENGTH)


def test_two_speakers_seen_on_the_wire_raise_an_alarm(gestures: Pair, caplog: pytest.LogCaptureFixture) -> None:
    assert gestures.hears_the_next(GOOD)
    gestures.speaker.epoch = 2
    assert gestures.hears_the_next(GOOD)
    gestures.speaker.epoch = 1
    gestures.speaker.say(GOOD)
    gestures.rejected(Reason.EPOCH)
    assert re.search("two publishers: epoch 1 still publishes after epoch 2 .* End the other process", caplog.text)
    gestures.speaker.epoch = 2
    assert gestures.hears_the_next(GOOD)
