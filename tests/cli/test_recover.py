"""`paramove recover`: what it says, and its exit codes."""

import datetime
import json

import pytest
from typer.testing import CliRunner

from paramove.cli.main import build
from paramove.recording.reader import read
from paramove.recording.writer import RecordingWriter
from tests.recording import recordings


def run(*arguments):
    return CliRunner().invoke(build("recover"), ["recover", *map(str, arguments)])


@pytest.fixture
def killed(tmp_path):
    """A recording as its writer's death leaves it."""
    recording = RecordingWriter(tmp_path / "run.mcap", "a test")
    for one in recordings.messages(100):
        recording.write(*one)
    recording._file.close()
    return tmp_path / "run.mcap.part"


def test_it_says_what_was_kept(killed):
    done = run(killed)
    assert done.exit_code == 0, done.output
    kept = len(list(read(killed)))
    assert f"run.mcap: recovered {kept} messages" in done.stdout
    last = list(read(killed))[-1]
    assert f"unknown: whether messages followed that of {last.log_ns * 1e-9:.3f} s" in done.stdout
    assert "never finished" in done.stdout
    assert len(list(read(killed.with_name("run.mcap")))) == kept
    again = run(killed)
    assert again.exit_code == 2
    assert again.stdout == ""
    assert "exists; recordings are never overwritten: choose another name with --output" in again.stderr
    assert run(killed, "--output", killed.with_name("other.mcap")).exit_code == 0


def test_as_json(killed):
    killed.write_bytes(killed.read_bytes()[:-20])
    facts = json.loads(run(killed, "--json").stdout)
    assert facts["messages_kept"] == len(list(read(killed.with_name("run.mcap"))))
    assert facts["damages"][-1]["end"] == killed.stat().st_size
    assert facts["known_until_s"] == pytest.approx(list(read(killed.with_name("run.mcap")))[-1].log_ns * 1e-9)
    written = datetime.datetime.fromisoformat(facts["last_written"]).timestamp()
    assert written == pytest.approx(killed.stat().st_mtime)


def test_a_whole_one_needs_nothing(tmp_path):
    recordings.write(tmp_path / "run.mcap", 20)
    done = run(tmp_path / "run.mcap")
    assert done.exit_code == 0
    assert "is whole (20 messages" in done.stdout
    assert "not known" not in done.stdout


def test_what_cannot_be_recovered(tmp_path):
    done = run(tmp_path / "no.mcap")
    assert (done.exit_code, done.stdout) == (66, "")
    assert "there is no recording" in done.stderr
    (tmp_path / "text.mcap").write_text("no recording")
    done = run(tmp_path / "text.mcap")
    assert (done.exit_code, done.stdout) == (78, "")
    with RecordingWriter(tmp_path / "run.mcap", "a test"):
        done = run(tmp_path / "run.mcap.part")
        assert done.exit_code == 75
        assert "is being written by a process that is alive" in done.stderr
