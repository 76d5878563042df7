"""Images by shared memory: the same bytes, and exact counts whatever happens to either side."""

from __future__ import annotations

import errno
import gc
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import zmq
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.bus import image_ring, topics
from paramove.bus.envelope import FLAG_RING, Envelope, Reason, RejectedError
from paramove.bus.image_ring import SLOTS, SMALLEST, OverwrittenError, RingReader, RingWriter
from paramove.bus.publisher import Publisher
from paramove.bus.schemas import schema_hash
from paramove.bus.subscriber import Subscriber
from paramove.bus.topics import Topic
from tests.bus.conftest import RawPublisher, Wait

Context = zmq.Context[Any]
TOPIC = topics.CAMERA_IMAGE_RAW


def image(number: int, size: int = 300_000) -> RawImage:
    return RawImage(data=number.to_bytes(4, "little") * (size // 4), frame_id="camera_optical")


def envelope(sequence: int, epoch: int = 7) -> Envelope:
    return Envelope(schema_hash(RawImage), 1, epoch, sequence, 0, 0, FLAG_RING)


@pytest.fixture
def pair(
    context: Context, folder: Path, wait: Wait, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Publisher, Subscriber]]:
    monkeypatch.setattr(Topic, "publisher_high_water_mark", 0)  # the socket drops nothing where the machine is busy
    publisher, subscriber = Publisher(context, folder, TOPIC, "camera"), Subscriber(context, folder, TOPIC)

    def welcomed() -> bool:
        assert subscriber.receive() is None
        return subscriber.welcomed

    wait(welcomed, publisher.serve)
    yield publisher, subscriber
    publisher.close()
    subscriber.close()


def sent(publisher: Publisher) -> RawImage:
    message = image(publisher.sequence + 1)
    publisher.publish(message, 0, publisher.sequence * 66_000_000)
    return message


def test_the_same_bytes_arrive(pair: tuple[Publisher, Subscriber], wait: Wait) -> None:
    publisher, subscriber = pair
    for size in (300_000, 300_004, 120_000, 2_000_000, SMALLEST - 2000, 300_000):
        message = image(publisher.sequence + 1, size)
        publisher.publish(message, 5, publisher.sequence * 66_000_000)
        received = wait(subscriber.receive)
        assert received.message.SerializeToString(deterministic=True) == message.SerializeToString(deterministic=True)
        assert received.message == message
        assert received.sequence == publisher.sequence
    assert (subscriber.counter.messages, subscriber.counter.lost) == (6, 0)


def test_every_subscriber_gets_each_image(pair: tuple[Publisher, Subscriber], context: Context, wait: Wait) -> None:
    publisher, first = pair
    second = Subscriber(context, publisher.ownership.path.parent, TOPIC)
    wait(lambda: second.receive() is None and second.welcomed, publisher.serve)
    for _ in range(SLOTS):
        sent(publisher)
    for subscriber in (first, second):
        assert [wait(subscriber.receive).sequence for _ in range(SLOTS)] == list(range(1, SLOTS + 1))
    second.close()


def test_a_slow_subscriber_loses_what_was_overwritten_and_counts_it(
    pair: tuple[Publisher, Subscriber], wait: Wait
) -> None:
    publisher, subscriber = pair
    published = SLOTS + 5
    for _ in range(published):
        sent(publisher)
    first = wait(subscriber.receive)
    assert first.sequence == published - SLOTS + 1
    assert first.message == image(first.sequence)
    for _ in range(SLOTS - 1):
        wait(subscriber.receive)
    assert (subscriber.counter.messages, subscriber.counter.lost) == (SLOTS, published - SLOTS)
    assert not subscriber.counter.rejected


def test_what_is_recorded_or_small_goes_by_the_socket(pair: tuple[Publisher, Subscriber]) -> None:
    assert [topic.by_ring for topic in (TOPIC, topics.CAMERA_IMAGE, topics.GESTURES)] == [True, False, False]
    publisher, _ = pair
    before = rings_here()
    publisher.publish(image(1, SMALLEST // 2), 0, 0)
    assert rings_here() == before


def rings_here() -> int:
    """How many rings this process has open; a test that failed before may have left some."""
    gc.collect()
    return sum(image_ring._NAME in name for name in descriptors(os.getpid()))


def descriptors(process: int) -> list[str]:
    found = []
    for one in Path(f"/proc/{process}/fd").iterdir():
        try:
            found.append(os.readlink(one))
        except FileNotFoundError:  # of the listing itself
            continue
    return found


def test_nothing_is_left_when_both_have_closed(pair: tuple[Publisher, Subscriber], wait: Wait) -> None:
    publisher, subscriber = pair
    before = rings_here()
    sent(publisher)
    wait(subscriber.receive)
    assert rings_here() == before + 2
    publisher.close()
    subscriber.close()
    assert rings_here() == before


def test_without_memory_images_go_by_the_socket(
    pair: tuple[Publisher, Subscriber], wait: Wait, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "no space left")

    publisher, subscriber = pair
    before = rings_here()
    monkeypatch.setattr(os, "posix_fallocate", full)
    message = sent(publisher)
    assert wait(subscriber.receive).message == message
    assert rings_here() == before


def test_a_larger_image_takes_a_new_ring_and_a_reader_of_the_old_one_is_not_confused() -> None:
    writer, reader = RingWriter(), RingReader()
    old = writer.write(b"a" * 1000, envelope(1))
    assert reader.read(old, envelope(1), 2**20) == b"a" * 1000
    new = writer.write(b"b" * 9000, envelope(2))
    assert reader.read(new, envelope(2), 2**20) == b"b" * 9000
    writer.close()
    assert reader.read(new, envelope(2), 2**20) == b"b" * 9000, "a reader keeps what it has open"
    for handle, sequence in ((old, 1), (new, 2)):
        with pytest.raises(OverwrittenError):
            reader.read(handle, envelope(sequence), 2**20)
    reader.close()


def test_a_slot_that_is_being_written_is_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    writer, reader = RingWriter(), RingReader()
    handle = writer.write(b"a" * 1000, envelope(1))
    for number in range(2, SLOTS + 1):
        writer.write(b"a" * 1000, envelope(number))
    read = os.pread

    def overtaken(file: int, size: int, offset: int) -> bytes:
        payload = read(file, size, offset)
        monkeypatch.setattr(os, "pread", read)
        writer.write(b"b" * 1000, envelope(SLOTS + 1))
        return payload

    monkeypatch.setattr(os, "pread", overtaken)
    with pytest.raises(OverwrittenError):
        reader.read(handle, envelope(1), 2**20)
    writer.close()
    reader.close()


@pytest.mark.parametrize(
    ("handle", "reason"),
    [
        (b"", Reason.LENGTH),
        (b"x" * 39, Reason.LENGTH),
        (image_ring._HANDLE.pack(image_ring._pid_namespace(), 1, 0, 1, 0, 2**40), Reason.LENGTH),
        (image_ring._HANDLE.pack(12, 1, 0, 1, 0, 10), Reason.RING),
    ],
)
def test_a_damaged_or_unreachable_handle_is_rejected(handle: bytes, reason: Reason) -> None:
    with pytest.raises(RejectedError) as refused:
        RingReader().read(handle, envelope(1), 2**20)
    assert refused.value.reason is reason


OFFSETS = [0, 4096 * 99, 2**31, 2**62, 2**63 - 17, 2**63 - 16, 2**63 - 1, 2**63, 2**64 - 16, 2**64 - 1]


def test_a_handle_of_any_offset_and_length_is_rejected_and_counted(context: Context, folder: Path, wait: Wait) -> None:
    writer = RingWriter()
    namespace, process, descriptor, number, _, _ = image_ring._HANDLE.unpack(writer.write(b"a" * 4000, envelope(1, 1)))
    other, subscriber = RawPublisher(context, folder, TOPIC), Subscriber(context, folder, TOPIC)
    wait(other.subscribed)
    other.say(b"")
    assert wait(subscriber.receive).sequence == 1
    for offset in OFFSETS:
        for length in (0, 10, TOPIC.max_bytes, 2**64 - 1):
            fits = offset + length < 2**16
            handle = image_ring._HANDLE.pack(namespace, process, descriptor, number, offset, length)
            before = subscriber.counter.rejected.total()
            other.say(handle, other.sequence * 10**9, flags=FLAG_RING)
            other.say(b"", other.sequence * 10**9)
            assert wait(subscriber.receive).sequence == other.sequence
            assert subscriber.counter.rejected.total() == before + (not fits), (offset, length)
    subscriber.close()
    writer.close()


def test_any_other_file_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "secret").open("wb") as other:
        handle = image_ring._HANDLE.pack(image_ring._pid_namespace(), os.getpid(), other.fileno(), 1, 0, 10)
        with pytest.raises(OverwrittenError):
            RingReader().read(handle, envelope(1), 2**20)


def test_a_handle_of_a_process_that_has_ended_is_a_lost_message(context: Context, folder: Path, wait: Wait) -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        ended.wait()
    handle = image_ring._HANDLE.pack(image_ring._pid_namespace(), ended.pid, 5, 1, 0, 10)
    other, subscriber = RawPublisher(context, folder, TOPIC), Subscriber(context, folder, TOPIC)
    wait(other.subscribed)
    other.say(b"")
    other.say(handle, flags=FLAG_RING)
    other.say(b"")
    assert [wait(subscriber.receive).sequence for _ in range(2)] == [1, 3]
    assert (subscriber.counter.lost, not subscriber.counter.rejected) == (1, True)
    subscriber.close()


PUBLISHER = """
import sys, zmq
from pathlib import Path
from paramove.bus import Publisher, topics
from tests.bus.test_image_ring import sent
publisher = Publisher(zmq.Context(), Path(sys.argv[1]), topics.CAMERA_IMAGE_RAW, "camera")
while publisher.subscriptions == 0:
    publisher.socket.poll()
    publisher.serve()
while True:
    sent(publisher)
"""


def test_a_publisher_killed_in_the_middle_of_images_and_started_again(
    context: Context, folder: Path, wait: Wait
) -> None:
    subscriber = Subscriber(context, folder, TOPIC)
    for _ in range(3):
        with subprocess.Popen([sys.executable, "-c", PUBLISHER, str(folder)]) as publisher:
            epochs = subscriber.counter.epochs
            wait(lambda before=epochs: subscriber.receive_raw() and subscriber.counter.epochs > before)
            end_s = time.monotonic() + 0.3
            while time.monotonic() < end_s:
                raw = subscriber.receive_raw()
                assert raw is None or RawImage.FromString(raw[1]) == image(raw[0].sequence)
            publisher.send_signal(signal.SIGKILL)
    assert (subscriber.counter.epochs, not subscriber.counter.rejected) == (3, True)
    subscriber.close()
