"""A disk that is full while the arm moves ends nothing, and is seen afterwards."""

import json

import pytest

from paramove.recording.parts import PartedRecording
from tests.recording.small_disk import fill, small_disk
from tests.system.test_connect_your_arm import EMULATED, heard


@pytest.mark.long
def test_a_run_goes_on_over_a_full_disk_and_the_recording_after_it(launcher, tmp_path):
    with small_disk(tmp_path / "disk", 200) as launcher.folder:
        process = launcher.start(*EMULATED.split()[2:], "--headless")
        heard(process, "task 1 of 2")
        filler = fill(launcher.folder)
        heard(process, "task 2 of 2")
        filler.unlink()
        shown = process.communicate(timeout=300)[0]
        assert process.returncode == 0, shown
        assert "SUCCESS: 2 of 2 tasks done" in shown
        events = [json.loads(line) for line in (launcher.latest / "events.jsonl").read_text().splitlines()]
        told = [one["sentence"] for one in events if (one.get("node"), one["event"]) == ("recorder", "degraded")]
        assert "less than 1 GB is free" in told[0]
        parts = PartedRecording(launcher.latest / "recording.mcap")
        assert [part.name for part in parts.parts] == ["recording.mcap", "recording.2.mcap"]
        sequences = {}
        for one in parts.read():  # all of it had room in memory
            assert one.sequence == sequences.get(one.topic, one.sequence - 1) + 1
            sequences[one.topic] = one.sequence
        assert {gap["recording"] for gap in json.loads((launcher.latest / "run.json").read_text())["gaps"]} >= {
            "recording"
        }
        assert "continues in recording.2.mcap: 0 messages" in (launcher.latest / "logs" / "recorder.log").read_text()
