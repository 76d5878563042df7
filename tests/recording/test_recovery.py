"""Recovery: everything readable of a damaged recording is kept, in order, and the original is left alone."""

from __future__ import annotations

import random
import signal
import struct
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from mcap.reader import make_reader

from paramove.recording.damage import Sound, survey
from paramove.recording.reader import read
from paramove.recording.recovery import RecoveryError, StillWrittenError, recover, recovered_path
from paramove.recording.writer import CHANNELS, CHUNK_BYTES, RecordingExistsError, RecordingWriter
from tests.recording import recordings

ROOT = Path(__file__).parents[2]


def found_in(path: Path) -> list[tuple]:
    return [(r.topic, r.message, r.log_ns, r.publish_ns, r.sequence) for r in read(path)]


def is_whole(path: Path) -> bool:
    """Through mcap's own reader, with its index and all checksums."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        counted = sum(1 for _ in reader.iter_messages())
        return counted == reader.get_summary().statistics.message_count


@cache
def finished() -> tuple[bytes, list[tuple], list[tuple[int, int, int]]]:
    """A recording of several chunks; what was written; each chunk's first byte, the byte after it, first message."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "whole.mcap"
        written = recordings.write(path, 700)
        content = path.read_bytes()
    chunks, before = [], 0
    for part in survey(content).parts:
        assert isinstance(part, Sound)
        end = part.begin + 9 + struct.unpack("<Q", content[part.begin + 1 : part.begin + 9])[0]
        chunks.append((part.begin, end, before))
        before += part.messages
    assert before == len(written)
    assert len(chunks) > 100
    return content, written, chunks


def recovered(folder: Path, content: bytes, name: str = "run.mcap.part"):
    source = folder / name
    source.write_bytes(content)
    result = recover(source)
    assert source.read_bytes() == content
    return result, found_in(result.destination or source)


def test_a_killed_writer(tmp_path: Path) -> None:
    """A process that writes is killed; what its file holds becomes a recording that other programs open."""
    path = tmp_path / "run.mcap"
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.recording.recordings", str(path)], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    told = 0
    for line in process.stdout:
        told = int(line)
        if told == 3000:
            with pytest.raises(StillWrittenError, match="is being written by a process that is alive"):
                recover(tmp_path / "run.mcap.part")
            process.send_signal(signal.SIGKILL)
            break
    told = max([told, *(int(line) for line in process.stdout if line.endswith("\n"))])
    process.stdout.close()
    assert process.wait() == -signal.SIGKILL
    before = (tmp_path / "run.mcap.part").read_bytes()
    result = recover(tmp_path / "run.mcap.part")
    assert result.destination == path
    assert (tmp_path / "run.mcap.part").read_bytes() == before
    found = found_in(path)
    written = list(recordings.messages(told))
    assert found[: len(written)] == written[: len(found)]
    assert sum(len(message.SerializeToString()) + 31 for _, message, *_ in written[len(found) :]) < 1.2 * CHUNK_BYTES
    assert result.kept == len(found)
    assert result.seconds_kept == pytest.approx((found[-1][2] - found[0][2]) * 1e-9)
    assert is_whole(path)


@pytest.mark.long
def test_cut_at_every_thousandth_byte(tmp_path: Path) -> None:
    """All chunks before the cut are there, and nothing that was not written."""
    content, written, chunks = finished()
    for at in range(-(-chunks[0][1] // 1000) * 1000, len(content), 1000):
        folder = tmp_path / str(at)
        folder.mkdir()
        result, found = recovered(folder, content[:at])
        whole = [first for _, end, first in chunks if end > at]
        assert len(found) >= (whole[0] if whole else len(written))
        assert found == written[: len(found)]
        assert result.kept == len(found)
        assert is_whole(result.destination)


def test_flipped_bytes_cost_the_chunks_they_are_in(tmp_path: Path) -> None:
    content, written, chunks = finished()
    rng = random.Random(7)
    for trial in range(15):
        places = sorted(rng.randrange(8, chunks[-1][1]) for _ in range(3))
        damaged = bytearray(content)
        for place in places:
            damaged[place] ^= 1 << rng.randrange(8)
        folder = tmp_path / str(trial)
        folder.mkdir()
        result, found = recovered(folder, bytes(damaged), "run.mcap")
        hit = {n for n, (begin, end, _) in enumerate(chunks) if any(begin <= place < end for place in places)}
        bounds = [first for _, _, first in chunks] + [len(written)]
        sound = [one for n in range(len(chunks)) if n not in hit for one in written[bounds[n] : bounds[n + 1]]]
        missing = [one for one in sound if one not in found]
        assert missing == [], f"trial {trial}, bytes {places}"
        assert all(one in written for one in found)
        assert result.kept == len(found)
        if result.destination:
            assert result.lost == len(written) - len(found)
            assert result.lost_is_exact
            assert is_whole(result.destination)


def _as_in_the_last_release(recording: RecordingWriter, topic: str) -> None:
    recording.note(CHANNELS, {name: str(number) for name, number in recording._channels.items()})


@pytest.mark.parametrize("form", [None, _as_in_the_last_release])
def test_the_chunk_that_names_the_topics_is_lost(
    tmp_path: Path, form: Callable[[RecordingWriter, str], None] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Topics are told again outside it, and their types are in the topic table."""
    if form is not None:
        monkeypatch.setattr(RecordingWriter, "_note_channel", form)
    content, written, chunks = finished.__wrapped__()
    begin, end, _ = chunks[0]
    middle = (begin + end) // 2
    damaged = content[:middle] + bytes(8) + content[middle + 8 : chunks[-1][1]]
    result, found = recovered(tmp_path, damaged)
    assert found == written[chunks[1][2] :]
    assert result.lost == chunks[1][2]
    assert is_whole(result.destination)


def test_lost_time_is_told(tmp_path: Path) -> None:
    content, written, chunks = finished()
    first, last = chunks[50], chunks[60]
    damaged = content[: first[0]] + bytes(last[0] - first[0]) + content[last[0] :]
    result, _ = recovered(tmp_path, damaged, "run.mcap")
    gap = (written[last[2]][2] - written[first[2] - 1][2]) * 1e-9
    whole = (written[-1][2] - written[0][2]) * 1e-9
    assert result.seconds_lost == pytest.approx(gap)
    assert result.seconds_kept == pytest.approx(whole - gap)
    assert result.lost == last[2] - first[2]


def test_notes_are_kept(tmp_path: Path) -> None:
    recording = RecordingWriter(tmp_path / "run.mcap", "a test")
    recording.note("run", {"seed": "7"})
    for one in recordings.messages(20):
        recording.write(*one)
    recording._file.close()
    result = recover(tmp_path / "run.mcap.part")
    with result.destination.open("rb") as file:
        notes = {note.name: note.metadata for note in make_reader(file).iter_metadata()}
    assert notes["run"] == {"seed": "7"}
    assert int(notes["paramove.recovery"]["kept"]) == result.kept


def test_a_whole_recording_needs_nothing(tmp_path: Path) -> None:
    content, written, _ = finished()
    result, _ = recovered(tmp_path, content, "run.mcap")
    assert result.destination is None
    assert (result.kept, result.lost, result.damages) == (len(written), 0, ())
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


def test_nothing_is_written_over(tmp_path: Path) -> None:
    content, _, _ = finished()
    (tmp_path / "run.mcap").write_bytes(b"another")
    (tmp_path / "run.mcap.part").write_bytes(content[:5000])
    with pytest.raises(RecordingExistsError, match=r"run\.mcap exists"):
        recover(tmp_path / "run.mcap.part")
    assert (tmp_path / "run.mcap").read_bytes() == b"another"


def test_where_it_goes() -> None:
    assert recovered_path(Path("a/run.2.mcap.part")) == Path("a/run.2.mcap")
    assert recovered_path(Path("a/run.mcap")) == Path("a/run.recovered.mcap")


@pytest.mark.parametrize(
    ("content", "detail"),
    [(b"", "is empty"), (b"\x89MCAP0\r\n", "no readable message"), (b"text\n" * 99, "no readable message")],
)
def test_what_holds_nothing_is_refused_and_nothing_is_written(tmp_path: Path, content: bytes, detail: str) -> None:
    source = tmp_path / "run.mcap.part"
    source.write_bytes(content)
    with pytest.raises(RecoveryError, match=detail) as rejected:
        recover(source)
    assert rejected.value.exit_code == 78
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap.part"]


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecoveryError, match=r"there is no recording .*run\.mcap") as rejected:
        recover(tmp_path / "run.mcap")
    assert rejected.value.exit_code == 66


def test_whatever_happens_to_a_file_nothing_foreign_is_kept(tmp_path: Path) -> None:
    """Blocks are overwritten, bytes fall out, the end is missing: a subset of what was written, or a refusal."""
    content, written, _ = finished()
    rng = random.Random(1)
    kept = 0
    for trial in range(30):
        damaged = bytearray(content)
        at, many = rng.randrange(len(damaged)), rng.randrange(1, 2000)
        if trial % 3 == 0:
            damaged[at : at + many] = rng.randbytes(many)
        elif trial % 3 == 1:
            del damaged[at : at + many]
        else:
            for _ in range(many % 30):
                damaged[rng.randrange(at + 1)] = rng.randrange(256)
            del damaged[at + 1 :]
        folder = tmp_path / str(trial)
        folder.mkdir()
        try:
            _, found = recovered(folder, bytes(damaged))
        except RecoveryError:
            continue
        kept += len(found)
        places = [written.index(one) for one in found]
        assert places == sorted(set(places)), f"trial {trial}"
    assert kept > 15 * len(written)
