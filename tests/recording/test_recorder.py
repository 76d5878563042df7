"""The recorder: what was heard reaches the file in silence, beside a slow disk, and around a full one."""

from __future__ import annotations

import itertools
import os
import stat
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.bus.settings import BusSettings
from paramove.bus.subscriber import Received
from paramove.msgs.rule_pb2 import Speech
from paramove.msgs.safety_state_pb2 import StopRequest
from paramove.recording import recorder
from paramove.recording.parts import PartedRecording
from paramove.recording.reader import read
from paramove.recording.recorder import Recorder
from tests.recording.small_disk import fill, small_disk
from tests.supervision.conftest import TIMEOUT_S, until

ROOT = Path(__file__).parents[2]


def speech(number: int, size: int = 0) -> Received:
    """A message that cannot be compressed."""
    return Received(topics.SPEECH, Speech(text=os.urandom(size // 2).hex()), number, number, number)


def numbers_in(path: Path) -> list[int]:
    return [recorded.sequence for recorded in read(path)]


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    with small_disk(tmp_path / "disk", 40) as folder:
        yield folder


def test_a_single_message_is_in_the_file_although_nothing_follows_it(tmp_path: Path) -> None:
    with Recorder(RecordedBus(), tmp_path / "run.mcap", "a test") as recording:
        recording.keep(speech(1))
        until(lambda: numbers_in(tmp_path / "run.mcap.part") == [1], "the message is in the file")
    assert numbers_in(tmp_path / "run.mcap") == [1]


@pytest.mark.parametrize(
    ("published_s", "resent", "recorded_s"),
    [
        (59_000.0, False, 95.0),  # of a terminal, by its monotonic clock, while time is simulated
        (2.0, False, 95.0),  # of a container that was started later
        (94.5, False, 94.5),
        (2.0, True, 2.0),  # latched, from before the recorder was started again
    ],
)
def test_a_request_of_a_sender_with_another_clock_is_recorded_when_it_arrived(
    tmp_path, published_s, resent, recorded_s
):
    bus = RecordedBus()
    bus.now_ns = 95 * 10**9
    published_ns = round(published_s * 1e9)
    request = Received(topics.OPERATOR_STOP, StopRequest(), published_ns, published_ns, 1, resent)
    with Recorder(bus, tmp_path / "run.mcap", "a test") as recording:
        recording.keep(request)
    (one,) = read(tmp_path / "run.mcap")
    assert (one.log_ns, one.publish_ns) == (recorded_s * 1e9, recorded_s * 1e9)


@pytest.mark.parametrize("umask", [0o000, 0o022, 0o277])
def test_only_its_owner_may_read_it(tmp_path: Path, umask: int) -> None:
    before = os.umask(umask)
    try:
        with Recorder(RecordedBus(), tmp_path / "run.mcap", "a test"):
            assert stat.S_IMODE((tmp_path / "run.mcap.part").stat().st_mode) == 0o600
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "run.mcap").stat().st_mode) == 0o600


def test_a_disk_that_is_slow_delays_neither_the_node_nor_the_file(tmp_path, monkeypatch) -> None:
    """While one fsync takes for ever, messages are taken and handed to the system; then all are synced."""
    begins, goes_on, real = threading.Event(), threading.Event(), os.fsync

    def slow(descriptor: int) -> None:
        begins.set()
        assert goes_on.wait(TIMEOUT_S)
        real(descriptor)

    monkeypatch.setattr(os, "fsync", slow)
    with Recorder(RecordedBus(), tmp_path / "run.mcap", "a test") as recording:
        recording.keep(speech(1))
        until(begins.is_set, "the first fsync")
        for number in range(2, 500):
            recording.keep(speech(number, 1000))
        until(lambda: len(numbers_in(tmp_path / "run.mcap.part")) == 499, "all messages are in the file")
        goes_on.set()
    assert numbers_in(tmp_path / "run.mcap") == list(range(1, 500))


def test_what_is_written_is_synced_again_and_again(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(recorder, "SYNC_S", 0.01)
    synced, real = [], os.fsync
    monkeypatch.setattr(os, "fsync", lambda descriptor: (synced.append(descriptor), real(descriptor)))
    with Recorder(RecordedBus(), tmp_path / "run.mcap", "a test") as recording:
        for number in range(1, 4):
            recording.keep(speech(number))
            until(lambda: len(synced) >= number, "a further fsync")  # noqa: B023
    assert len(synced) >= 3 + 2  # at its end the file, and its name in the folder


def test_a_full_disk_is_waited_for_and_the_recording_goes_on_in_a_further_part(disk, monkeypatch, caplog) -> None:
    monkeypatch.setattr(recorder, "WAITING_BYTES", 20_000)
    monkeypatch.setattr(recorder, "SYNC_S", 0.05)
    bus, path, numbers = RecordedBus(), disk / "run.mcap", itertools.count(1)
    with Recorder(bus, path, "a test") as recording:

        def say_until(condition, what: str) -> None:
            def once() -> bool:
                recording.keep(speech(next(numbers), 1000))
                recording.tell("records")
                return condition()

            until(once, what)

        say_until(lambda: len(numbers_in(path.with_name("run.mcap.part"))) > 3, "it records")
        assert bus.states == [
            ("degraded", f"less than 1 GB is free in {disk}: make room there, or recording will stop")
        ]
        filler = fill(disk)
        say_until(lambda: "No space left on device" in bus.states[-1][1], "it says that the disk is full")
        assert bus.states[-1][0] == "degraded"
        for _ in range(50):  # more than may wait
            recording.keep(speech(next(numbers), 1000))
        filler.unlink()
        further = path.with_name("run.2.mcap.part")
        until(lambda: further.exists() and len(numbers_in(further)) > 10, "it goes on with what waits")
        say_until(lambda: "less than 1 GB" in bus.states[-1][1], "it says so")
    parts = PartedRecording(path)
    assert [part.name for part in parts.parts] == ["run.mcap", "run.2.mcap"]  # both are finished
    found = [recorded.sequence for recorded in parts.read()]
    missing = sorted(set(range(1, next(numbers))) - set(found))
    assert found == sorted(found)
    assert missing == list(range(missing[0], missing[-1] + 1))  # one gap
    (gap,) = parts.gaps
    assert (gap.begin_ns, gap.end_ns) == (missing[0] - 1, missing[-1] + 1)
    (told,) = [record.message for record in caplog.records if "continues in" in record.message]
    assert f"continues in run.2.mcap: {len(missing)} messages from" in told


def test_a_recorder_that_is_started_on_a_full_disk_waits_too(disk, monkeypatch) -> None:
    monkeypatch.setattr(recorder, "SYNC_S", 0.05)
    filler, bus = fill(disk), RecordedBus()
    with Recorder(bus, disk / "run.mcap", "a test") as recording:
        recording.keep(speech(1))
        recording.tell("records")
        assert bus.states[-1][0] == "degraded"
        assert [file.name for file in disk.iterdir()] == ["filler"]
        filler.unlink()
        until(lambda: (disk / "run.mcap.part").exists(), "it begins")
    assert numbers_in(disk / "run.mcap") == [1]


def test_a_disk_that_stays_full_ends_nothing_and_the_loss_is_logged(disk, caplog) -> None:
    with Recorder(RecordedBus(), disk / "run.mcap", "a test") as recording:
        recording.keep(speech(1))
        until(lambda: numbers_in(disk / "run.mcap.part") == [1], "it records")
        fill(disk)
        for number in range(2, 10):
            recording.keep(speech(number, 4000))
    assert "8 messages" in caplog.records[-1].message
    assert "are lost: No space left on device" in caplog.records[-1].message
    assert numbers_in(disk / "run.mcap.part") == [1]


def test_a_file_that_may_not_grow_further_is_left_and_a_further_one_begun(tmp_path: Path) -> None:
    """As on file systems whose files have a greatest size, and without being root."""
    program = """
import resource, sys
from pathlib import Path
from paramove.bus.recorded import RecordedBus
from paramove.recording import recorder
from tests.recording.test_recorder import speech
from tests.supervision.conftest import until
resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))
recorder.SYNC_S = recorder.FLUSH_S = 0.005
folder = Path(sys.argv[1])
bus = RecordedBus()

def is_writing():
    recording.tell("records")
    return not recording._waiting and "File too large" not in bus.states[-1][1]

with recorder.Recorder(bus, folder / "run.mcap", "a test") as recording:
    for number in range(1, 10_000):
        recording.keep(speech(number, 5000))
        until(is_writing, "it goes on")
        if (folder / "run.3.mcap.part").exists():
            break
"""
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    parts = PartedRecording(tmp_path / "run.mcap")
    assert [part.name for part in parts.parts] == ["run.mcap.part", "run.2.mcap.part", "run.3.mcap"]
    found = [recorded.sequence for recorded in parts.read()]
    assert found == sorted(found)
    assert len(found) > 12


def test_what_waiting_would_not_mend_is_an_error_at_once(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        Recorder(RecordedBus(), tmp_path / "none" / "run.mcap", "a test")


def test_in_lockstep_time_waits_for_a_disk_that_does_not_keep_up(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(recorder, "WAITING_BYTES", 5000)
    bus = RecordedBus()
    bus.settings = BusSettings(folder=tmp_path, clock="simulated", lockstep=True)
    with Recorder(bus, tmp_path / "run.mcap", "a test") as recording:
        for number in range(1, 50):
            recording.keep(speech(number, 1000))
    assert numbers_in(tmp_path / "run.mcap") == list(range(1, 50))


def test_what_goes_wrong_in_the_thread_that_writes_is_raised_in_the_node(tmp_path: Path) -> None:
    recording = Recorder(RecordedBus(), tmp_path / "run.mcap", "a test")
    recording.keep(speech(1), message=Unwritable())
    until(recording._running.done, "the thread has ended")
    with pytest.raises(AttributeError):
        recording.keep(speech(2))
    with pytest.raises(AttributeError):
        recording.close()


class Unwritable:
    """Stands for a message that cannot be written."""

    def ByteSize(self) -> int:  # noqa: N802
        return 1
