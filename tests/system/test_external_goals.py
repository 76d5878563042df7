"""Goals from outside of a run: an emulated arm does what a program and a command send it."""

import subprocess
import sys
from pathlib import Path

import pytest

import paramove
from paramove.msgs.relocation_pb2 import RelocationStatus
from paramove.msgs.safety_state_pb2 import SafetyState
from tests.supervision.conftest import until

ROOT = Path(__file__).parents[2]
PARAMOVE = Path(sys.executable).parent / "paramove"
LAUNCH = [PARAMOVE, "launch", "dynamixel_arm", "--with", "emulated", "--with", "external_goals"]


@pytest.fixture
def run(short_folder, tmp_path, monkeypatch):
    """The arm, armed, with nobody in the run who sends goals."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(short_folder))
    monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)
    with (tmp_path / "log").open("w") as log:
        launch = subprocess.Popen([*LAUNCH, "--runs", str(tmp_path)], cwd=ROOT, stdout=log, stderr=log)
    try:
        until((short_folder / "paramove" / "default").is_dir, "the run has a bus")
        with paramove.connect() as connection:
            for received in connection.listen("arm/safety", seconds=120.0):
                if received.message.state == SafetyState.STATE_ARMED:
                    break
            yield connection
    finally:
        launch.terminate()
        launch.wait(60)


@pytest.mark.slow
def test_an_arm_does_what_is_sent_and_stops_on_request(run):
    assert run.send_goal({"kind": "KIND_REST", "frame": "arm_base"}, 120.0).state == RelocationStatus.STATE_SUCCEEDED
    rejected = run.send_goal({"kind": "KIND_REST", "frame": "nowhere"}, 60.0)
    assert rejected.state == RelocationStatus.STATE_REJECTED
    assert "arm_base" in rejected.reason
    command = [PARAMOVE, "goal", "send", "{kind: KIND_REST, frame: arm_base}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (75, ""), done.stderr  # this program sends goals
    assert run.stop().state in (SafetyState.STATE_HOLD, SafetyState.STATE_STOPPING)
