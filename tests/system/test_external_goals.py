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
EMULATED = ("dynamixel_arm", "--with", "emulated", "--with", "external_goals")
TWO = ("two_arms", "--with", "external_goals")
REACH = {"kind": "KIND_OFFER_HAND", "frame": "arm_base", "from": {"x": 0.18, "y": 0.05, "z": 0.10}}


@pytest.fixture(params=[EMULATED, pytest.param(TWO, marks=pytest.mark.long)], ids=["one", "left of two"])
def run(request, short_folder, tmp_path, monkeypatch):
    """An arm, armed, with nobody in the run who sends goals."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(short_folder))
    monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)
    command = [PARAMOVE, "launch", *request.param, "--runs", str(tmp_path)]
    with (tmp_path / "log").open("w") as log:
        launch = subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=log)
    try:
        until((short_folder / "paramove" / "default").is_dir, "the run has a bus")
        with paramove.connect(namespace="left" if request.param == TWO else "") as connection:
            states = (received.message.state for received in connection.listen("arm/safety", seconds=120.0))
            assert SafetyState.STATE_ARMED in states, (tmp_path / "log").read_text()
            yield connection
    finally:
        launch.terminate()
        launch.wait(60)


@pytest.mark.slow
def test_an_arm_does_what_is_sent_and_stops_on_request(run):
    assert run.send_goal(REACH, 120.0).state == RelocationStatus.STATE_SUCCEEDED
    assert run.send_goal({"kind": "KIND_REST", "frame": "arm_base"}, 120.0).state == RelocationStatus.STATE_SUCCEEDED
    rejected = run.send_goal({"kind": "KIND_REST", "frame": "nowhere"}, 60.0)
    assert rejected.state == RelocationStatus.STATE_REJECTED
    assert "arm_base" in rejected.reason
    command = [PARAMOVE, "goal", "send", "{kind: KIND_REST, frame: arm_base}"]
    if run.namespace:
        command += ["--namespace", run.namespace]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (75, ""), done.stderr  # this program sends goals
    stopped = run.stop()
    assert stopped.state in (SafetyState.STATE_HOLD, SafetyState.STATE_STOPPING)
    assert stopped.faults[0].detail == "stopped from the program client"
