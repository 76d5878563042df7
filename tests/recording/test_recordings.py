"""Recordings: what was written is read, whatever happened to the writer."""

from __future__ import annotations

import signal
import subprocess
import sys
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from paramove.bus import topics
from paramove.msgs.rule_pb2 import Speech
from paramove.recording.reader import Recorded, read
from paramove.recording.writer import CHANNELS, CHUNK_BYTES, RecordingExistsError, RecordingWriter
from tests.recording import recordings

ROOT = Path(__file__).parents[2]


def found_in(path: Path, **options) -> list[tuple]:
    return [(r.topic, r.message, r.log_ns, r.publish_ns, r.sequence) for r in read(path, **options)]


@cache
def finished() -> tuple[bytes, list[tuple]]:
    """The bytes of a recording of several chunks, and what was written."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "whole.mcap"
        written = recordings.write(path, 3000)
        return path.read_bytes(), written


def test_what_was_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    written = recordings.write(path, 200)
    assert found_in(path) == written
    assert isinstance(next(read(path)), Recorded)


def test_a_topic_is_read_by_its_present_name_and_found_by_both(tmp_path: Path) -> None:
    path = tmp_path / "old.mcap"
    message = topics.CAMERA_IMAGE_RAW.type(width=1)
    with RecordingWriter(path, "a test") as recording:
        recording.write("camera_1/light", message, 1, 2, 3)
    for only in ([], ["camera_1/light"], ["camera_1/image_raw"]):
        assert found_in(path, only=only) == [("camera_1/image_raw", message, 1, 2, 3)]


def test_only_some_topics(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    written = recordings.write(path, 50)
    assert found_in(path, only=["speech"]) == [one for one in written if one[0] == "speech"]
    assert found_in(path, only=["camera/image"]) == []


def test_every_recorded_topic_can_be_written_and_read(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recorded = [topic for topic in topics.TOPICS if topic.recorded]
    with RecordingWriter(path, "a test") as recording:
        for number, topic in enumerate(recorded):
            recording.write(topic.name, topic.type(), number, number, number)
    assert [one.topic for one in read(path)] == [topic.name for topic in recorded]
    assert [type(one.message) for one in read(path)] == [topic.type for topic in recorded]


@pytest.mark.parametrize("topic", ["truth/view", "truth/left/view"])
def test_the_view_of_a_simulator_is_kept_as_a_picture(tmp_path: Path, topic: str) -> None:
    path = tmp_path / "truth.mcap"
    picture = CompressedImage(format="jpeg", data=b"\xff\xd8 picture")
    with RecordingWriter(path, "a test") as recording:
        recording.write(topic, picture, 0, 0, 0)
    assert [(one.topic, one.message) for one in read(path)] == [(topic, picture)]


def test_other_programs_can_read_it(tmp_path: Path) -> None:
    """Through mcap's own reader, by the index; every schema holds all files that it needs."""
    path = tmp_path / "run.mcap"
    with RecordingWriter(path, "a test") as recording:
        for one in recordings.messages(20):
            recording.write(*one)
        recording.note("run", {"seed": "7"})
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 20
        assert reader.get_header().library == "a test"
        assert {channel.topic for channel in summary.channels.values()} == {"gestures", "speech"}
        assert {channel.message_encoding for channel in summary.channels.values()} == {"protobuf"}
        for schema in summary.schemas.values():
            files = FileDescriptorSet.FromString(schema.data).file
            known = {one.name for one in files}
            assert all(needed in known for one in files for needed in one.dependency)
            assert schema.name.rpartition(".")[2] in {message.name for one in files for message in one.message_type}
        notes = [(one.name, one.metadata) for one in reader.iter_metadata() if not one.name.startswith(CHANNELS)]
        assert notes == [("run", {"seed": "7"})]


def test_no_metadata_repeats_a_name_or_a_key(tmp_path: Path) -> None:
    recordings.write(tmp_path / "run.mcap", 20)
    with (tmp_path / "run.mcap").open("rb") as file:
        notes = list(make_reader(file).iter_metadata())
    names, keys = [note.name for note in notes], [key for note in notes for key in note.metadata]
    assert sorted(set(names)) == sorted(names)
    assert sorted(keys) == ["gestures", "speech"]


def test_a_recording_is_never_written_over_another(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recordings.write(path, 3)
    before = path.read_bytes()
    with pytest.raises(RecordingExistsError, match=r"run\.mcap exists; .*choose another name"):
        RecordingWriter(path, "another")
    assert path.read_bytes() == before


def test_an_unfinished_recording_is_never_written_over_either(tmp_path: Path) -> None:
    """What a killed writer left behind is all there is of its run."""
    path = tmp_path / "run.mcap"
    (tmp_path / "run.mcap.part").write_bytes(b"what is left")
    with pytest.raises(RecordingExistsError, match=r"run\.mcap\.part"):
        RecordingWriter(path, "another")
    assert (tmp_path / "run.mcap.part").read_bytes() == b"what is left"


def test_it_bears_the_ending_part_until_it_is_finished(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recording = RecordingWriter(path, "a test")
    recording.write("speech", Speech(text="hello"), 1, 1, 1)
    assert [file.name for file in tmp_path.iterdir()] == ["run.mcap.part"]
    recording.close()
    recording.close()
    assert [file.name for file in tmp_path.iterdir()] == ["run.mcap"]


def test_an_error_while_recording_still_finishes_the_file(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"

    def fails() -> None:
        with RecordingWriter(path, "a test") as recording:
            recording.write("speech", Speech(text="hello"), 1, 1, 1)
            raise RuntimeError("something else")

    with pytest.raises(RuntimeError, match="something else"):
        fails()
    assert len(found_in(path)) == 1


@settings(deadline=None, max_examples=50, derandomize=True)
@given(share=st.floats(0.0, 1.0))
def test_a_file_cut_anywhere_gives_the_messages_before(tmp_path_factory: pytest.TempPathFactory, share: float) -> None:
    whole, written = finished()
    path = tmp_path_factory.getbasetemp() / "cut.mcap.part"
    cut = round(share * len(whole))
    path.write_bytes(whole[:cut])
    found = found_in(path)
    assert found == written[: len(found)]


def test_all_finished_chunks_before_the_cut_are_there(tmp_path: Path) -> None:
    whole, written = finished()
    path = tmp_path / "cut.mcap"
    lengths = []
    for share in (0.25, 0.5, 0.75, 0.9):
        path.write_bytes(whole[: round(share * len(whole))])
        lengths.append(len(found_in(path)))
    assert lengths == sorted(lengths)
    assert lengths[0] > 0
    assert lengths[-1] > 0.5 * len(written)


@settings(deadline=None, max_examples=40, derandomize=True)
@given(share=st.floats(0.0, 0.95), damage=st.binary(min_size=1, max_size=40))
def test_a_damaged_file_never_crashes_the_reader(
    tmp_path_factory: pytest.TempPathFactory, share: float, damage: bytes
) -> None:
    """As after a power failure: some block holds something else. What is read before is right."""
    whole, written = finished()
    at = round(share * len(whole))
    path = tmp_path_factory.getbasetemp() / "damaged.mcap"
    path.write_bytes(whole[:at] + damage + whole[at + len(damage) :])
    found = found_in(path)
    if at > len(whole) // 2:
        assert found[:100] == written[:100]


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0", b"no recording at all, but some text\n" * 9])
def test_what_is_no_recording_gives_nothing(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other"
    path.write_bytes(content)
    assert found_in(path) == []


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"nothing\.mcap"):
        next(read(tmp_path / "nothing.mcap"))


def test_an_unknown_topic_is_named(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with RecordingWriter(path, "a test") as recording:
        recording.write("gesturez", Speech(), 0, 0, 0)
    with pytest.raises(KeyError, match="no topic 'gesturez'"):
        found_in(path)


def test_a_killed_writer_loses_little(tmp_path: Path) -> None:
    """SIGKILL in the middle: at most the chunk being filled is lost."""
    path = tmp_path / "run.mcap"
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.recording.recordings", str(path)], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    told = 0
    for line in process.stdout:
        told = int(line)
        if told == 6000:
            process.send_signal(signal.SIGKILL)
            break
    told = max([told, *(int(line) for line in process.stdout if line.endswith("\n"))])
    process.stdout.close()
    assert process.wait() == -signal.SIGKILL
    found = found_in(path.with_name("run.mcap.part"))
    written = list(recordings.messages(told))
    assert found[: len(written)] == written[: len(found)]
    lost = written[len(found) :]
    assert sum(len(message.SerializeToString()) + 31 for _, message, *_ in lost) < 1.2 * CHUNK_BYTES
    assert not path.exists()
