"""Recordings in several files, as a recorder leaves them that was killed and started again."""

from pathlib import Path

from paramove.msgs.rule_pb2 import Speech
from paramove.recording.parts import Gap, PartedRecording, next_part
from paramove.recording.writer import CHUNK_NS, RecordingWriter


def write(path: Path, numbers, killed=False):
    """Messages number n, said at n seconds; what is `killed` is left as its writer's death would leave it."""
    recording = RecordingWriter(next_part(path), "a test")
    for n in numbers:
        recording.write("speech", Speech(text=f"number {n}"), n * 10**9, n * 10**9, n)
    if killed:
        recording._file.close()
    else:
        recording.close()


def said(recording: PartedRecording, *only: str):
    return [recorded.sequence for recorded in recording.read(only)]


def test_parts_are_read_in_order_and_the_gaps_are_known(tmp_path):
    path = tmp_path / "run.mcap"
    write(path, range(1, 4))
    write(path, range(6, 8))
    write(path, range(8, 10))
    recording = PartedRecording(path)
    assert [part.name for part in recording.parts] == ["run.mcap", "run.2.mcap", "run.3.mcap"]
    assert said(recording) == [1, 2, 3, 6, 7, 8, 9]
    assert recording.gaps == [Gap(3 * 10**9, 6 * 10**9), Gap(7 * 10**9, 8 * 10**9)]
    assert said(recording, "gestures") == []
    assert recording.gaps == []


def test_killed_part_is_read_to_its_last_chunk_and_left_alone(tmp_path):
    path = tmp_path / "run.mcap"
    write(path, range(1, 6), killed=True)
    left = (tmp_path / "run.mcap.part").read_bytes()
    write(path, range(7, 9))
    recording = PartedRecording(path)
    assert [part.name for part in recording.parts] == ["run.mcap.part", "run.2.mcap"]
    assert said(recording) == [1, 2, 3, 4, 7, 8]  # a chunk ends when a message comes that is later by CHUNK_NS
    assert recording.gaps == [Gap(4 * 10**9, 7 * 10**9)]
    assert (tmp_path / "run.mcap.part").read_bytes() == left
    assert CHUNK_NS < 10**9


def test_value_that_was_told_again_counts_once(tmp_path):
    path = tmp_path / "run.mcap"
    write(path, [1, 2])
    write(path, [2, 5])
    recording = PartedRecording(path)
    assert said(recording) == [1, 2, 5]
    assert recording.gaps == [Gap(2 * 10**9, 5 * 10**9)]


def test_what_does_not_exist_has_no_parts(tmp_path):
    assert PartedRecording(tmp_path / "run.mcap").parts == []
    assert next_part(tmp_path / "run.mcap") == tmp_path / "run.mcap"
