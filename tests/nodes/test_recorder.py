"""The recorder's node keeps what it hears, in the order of hearing."""

from pathlib import Path

from nodes import recorder
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.bus.subscriber import Heard
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import Speech
from paramove.recording.parts import PartedRecording
from paramove.recording.reader import read

HEARD = [
    Heard(topics.GESTURES, Gesture(object="blue"), 100, 110, 1),
    Heard(topics.SPEECH, Speech(sentence="hello"), 90, 120, 1),
    Heard(topics.GESTURES, Gesture(object="green"), 130, 140, 2),
]


def test_keeps_every_message_with_its_times(tmp_path: Path) -> None:
    bus = RecordedBus(HEARD, run_folder=tmp_path)
    recorder.run(bus, recorder.Config())
    found = [(r.topic, r.message, r.log_ns, r.publish_ns, r.sequence) for r in read(tmp_path / "recording.mcap")]
    assert found == [(h.topic.name, h.message, h.captured_ns, h.published_ns, h.sequence) for h in HEARD]
    assert bus.said == []
    assert bus.states == [("ready", "recording to recording.mcap")]


def test_hears_all_that_is_marked_and_no_truth() -> None:
    assert {topic.name for topic in recorder.HEARS} == {topic.name for topic in topics.TOPICS if topic.recorded}
    assert not any(topic.truth for topic in recorder.HEARS)


def test_tells_now_and_then_how_much_it_has(tmp_path: Path) -> None:
    many = [Heard(topics.SPEECH, Speech(), n, n, n) for n in range(2 * recorder.REPORT_EVERY + 5)]
    bus = RecordedBus(many, run_folder=tmp_path)
    recorder.run(bus, recorder.Config(file="other.mcap"))
    assert [sentence for _, sentence in bus.states] == [
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
