"""The recorder's node keeps what it hears, in the order of hearing."""

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from nodes import recorder
from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.recorded import RecordedBus
from paramove.bus.settings import BusSettings
from paramove.bus.subscriber import Received
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import Speech
from paramove.recording.parts import PartedRecording
from paramove.recording.reader import read
from tests.supervision.conftest import until

ROOT = Path(__file__).parents[2]
HEARD = [
    Received(topics.GESTURES, Gesture(object="blue"), 100, 110, 1),
    Received(topics.SPEECH, Speech(text="hello"), 90, 120, 1),
    Received(topics.GESTURES, Gesture(object="green"), 130, 140, 2),
]


def test_keeps_every_message_with_its_times(tmp_path: Path) -> None:
    bus = RecordedBus(HEARD, run_folder=tmp_path)
    recorder.run(bus, recorder.Config())
    found = [(r.topic, r.message, r.log_ns, r.publish_ns, r.sequence) for r in read(tmp_path / "recording.mcap")]
    assert found == [(h.topic.name, h.message, h.captured_ns, h.published_ns, h.sequence) for h in HEARD]
    assert bus.published == []
    assert bus.states == [("ready", "recording to recording.mcap")]


def test_hears_all_that_is_marked_and_no_truth() -> None:
    assert {topic.name for topic in recorder.SUBSCRIBES} == {topic.name for topic in topics.TOPICS if topic.recorded}
    assert not any(topic.truth for topic in recorder.SUBSCRIBES)


def test_tells_now_and_then_how_much_it_has(tmp_path: Path) -> None:
    many = [Received(topics.SPEECH, Speech(), n, n, n) for n in range(2 * recorder.REPORT_EVERY + 5)]
    bus = RecordedBus(many, run_folder=tmp_path)
    recorder.run(bus, recorder.Config(file="other.mcap"))
    assert [detail for _, detail in bus.states] == [
        "recording to other.mcap",
        "1500 messages recorded",
        "3000 messages recorded",
    ]
    assert sum(1 for _ in read(tmp_path / "other.mcap")) == len(many)


def test_goes_on_in_a_further_file_and_never_writes_over_one(tmp_path: Path) -> None:
    recorder.run(RecordedBus(HEARD[:2], run_folder=tmp_path), recorder.Config())
    first = (tmp_path / "recording.mcap").read_bytes()
    recorder.run(RecordedBus(HEARD[2:], run_folder=tmp_path), recorder.Config())
    assert (tmp_path / "recording.mcap").read_bytes() == first
    recording = PartedRecording(tmp_path / "recording.mcap")
    assert [part.name for part in recording.parts] == ["recording.mcap", "recording.2.mcap"]
    assert [found.message for found in recording.read()] == [heard.message for heard in HEARD]


@contextlib.contextmanager
def recording_in(folder: Path, log: Path) -> Iterator[tuple[subprocess.Popen, Bus]]:
    """The real recorder as a process, and a bus that says gestures to it."""
    with (
        TemporaryDirectory(prefix="pm-", dir="/tmp") as runtime,  # paths of sockets are short
        Bus("speaker", BusSettings(folder=Path(runtime) / "bus"), (), (topics.GESTURES,)) as bus,
        log.open("wb") as output,
    ):
        settings = {"node": "recorder", "bus": {"folder": f"{runtime}/bus"}, "run_folder": str(folder)}
        (folder / "recorder.yaml").write_text(json.dumps(settings))
        command = [sys.executable, "-m", "nodes.recorder", "--config", str(folder / "recorder.yaml")]
        environment = os.environ | {"PYTHONUNBUFFERED": "1"}
        process = subprocess.Popen(command, cwd=ROOT, stdout=output, stderr=subprocess.STDOUT, env=environment)
        try:
            publisher = bus.exchange.publishers[topics.GESTURES.name]
            until(lambda: (bus.exchange.wait(0.1), publisher.subscriptions)[1], "the recorder hears")
            yield process, bus
        finally:
            process.kill()
            process.wait()


def test_killed_in_silence_it_has_everything_that_was_said_before(tmp_path: Path) -> None:
    """Nothing follows that would push it to the disk, and the process gets no chance to do so at its end."""
    part = tmp_path / "recording.mcap.part"
    with recording_in(tmp_path, tmp_path / "log") as (_, bus):
        for number in range(20):
            bus.publish(topics.GESTURES, Gesture(object=f"object {number}"))
        until(lambda: part.exists() and len(list(read(part))) == 20, "all messages are in the file")
    assert [recorded.message.object for recorded in read(part)] == [f"object {number}" for number in range(20)]


def test_a_log_without_room_ends_no_node(tmp_path: Path) -> None:
    """All that it logs fails, as on a full disk."""
    with recording_in(tmp_path, Path("/dev/full")) as (process, bus):
        bus.publish(topics.GESTURES, Gesture(object="blue"))
        part = tmp_path / "recording.mcap.part"
        until(lambda: part.exists() and len(list(read(part))) == 1, "it records")
        process.terminate()
        assert process.wait(120) == 0
    assert len(list(read(tmp_path / "recording.mcap"))) == 1


def test_what_was_published_before_the_request_to_end_is_recorded(tmp_path: Path) -> None:
    """The process stands still while messages and the request arrive, as when a run ends with its last tick."""
    with recording_in(tmp_path, tmp_path / "log") as (process, bus):
        until((tmp_path / "recording.mcap.part").exists, "it records")
        process.send_signal(signal.SIGSTOP)
        for number in range(20):
            bus.publish(topics.GESTURES, Gesture(object=f"object {number}"))
        process.send_signal(signal.SIGTERM)
        process.send_signal(signal.SIGCONT)
        assert process.wait(60) == 0
    recorded = [one.message.object for one in read(tmp_path / "recording.mcap")]
    assert recorded == [f"object {number}" for number in range(20)]
