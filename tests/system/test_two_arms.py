"""Two arms of different kinds in one run: each has its driver, its gate and its tasks, and one stop stops both."""

import json
import socket
from pathlib import Path

import pytest

from paramove.client import Run
from paramove.msgs.safety_state_pb2 import SafetyState
from paramove.recording import read
from tests.supervision.conftest import until

pytestmark = pytest.mark.slow
LEFT_MAY_FAIL = str(Path(__file__).parent / "overlays" / "left_may_fail.yaml")
LEFT, RIGHT = "[0.18, 0.05, 0.10]", "[0.20, 0.08, 0.10]"
SAME = (
    "left/arm/joint_states",
    "left/arm/trajectory",
    "left/relocation/status",
    "right/arm/joint_states",
    "right/arm/trajectory",
    "right/relocation/status",
)


def reaching(times=1):
    """Settings with which each arm reaches for a place, and comes back, so many times."""
    for side, place in (("left", LEFT), ("right", RIGHT)):
        steps = ", ".join(f"{{reach: {place}}}" for _ in range(times))
        yield from ("--set", f"{side}_reacher.tasks=[{steps}]")


def published(launcher, name, overlay):
    """What both arms published in a run in lockstep, by topic, and the joints that they really had."""
    launcher.folder = launcher.folder.parent / name
    launcher.folder.mkdir()
    code, shown = launcher.run("two_arms", "--with", overlay, "--headless", *reaching())
    assert code == 0, shown
    speech = read(launcher.latest / "recording.mcap", ("left/speech", "right/speech"))
    done_ns = max(one.message.captured.ToNanoseconds() for one in speech)  # then processes end as the machine lets them
    messages = {topic: [] for topic in SAME}
    for one in read(launcher.latest / "recording.mcap", SAME):
        if one.publish_ns <= done_ns:
            messages[one.topic].append(one.message.SerializeToString(deterministic=True))
    for side in ("left", "right"):
        results = json.loads((launcher.latest / side / "run.json").read_text())["tasks"]
        assert [one["good"] for one in results] == [True]
        truth = [one.message for one in read(launcher.latest / side / "truth.mcap", ("truth/state",))]
        messages[f"truth of {side}"] = [list(one.joint_positions) for one in truth if one.time_ns < done_ns]
    return messages


@pytest.mark.parametrize("overlay", ["lockstep", pytest.param("koch_lockstep", marks=pytest.mark.long)])
def test_two_arms_in_lockstep_do_the_same_in_every_run(launcher, tmp_path, overlay):
    launcher.folder = tmp_path / "runs"
    once, again = (published(launcher, name, overlay) for name in ("one", "two"))
    for topic, messages in once.items():
        assert len(messages) > (50 if "joint" in topic or "truth" in topic else 0), topic
        assert messages == again[topic], topic


def send(path, command):
    with socket.socket(socket.AF_UNIX) as control:
        control.connect(str(path))
        control.sendall(f"{command}\n".encode())
        return control.recv(4096).decode()


def gate_of(run, side):
    return run.latest(f"{side}/arm/safety", 30.0).state


def test_what_happens_to_one_arm_neither_stops_nor_moves_the_other_and_a_stop_stops_both(launcher, short_folder):
    control = short_folder / "control"
    launcher.start(
        *("two_arms", "--with", LEFT_MAY_FAIL, "--headless", "--set", f"left_dynamixel_emulator.control={control}"),
        *reaching(30),
    )
    folder = Path(launcher.environment["XDG_RUNTIME_DIR"]) / "paramove" / "test"
    until(folder.is_dir, "the run has a bus")
    with Run(folder) as run:
        until(lambda: (folder / "left.arm.safety").exists() and (folder / "right.arm.safety").exists(), "two gates")
        for side in ("left", "right"):
            until(lambda side=side: gate_of(run, side) == SafetyState.STATE_ARMED, f"{side} is armed")
        assert send(control, "unplug").startswith("ok")
        states, angles = set(), []
        for received in run.listen("left/arm/safety", "right/arm/safety", "right/arm/joint_states", seconds=60.0):
            if received.topic.name == "right/arm/safety":
                states.add(received.message.state)
            elif received.topic.name == "right/arm/joint_states":
                angles.append(received.message.joints[0].position)
            elif received.message.state != SafetyState.STATE_ARMED and max(angles, default=0.0) > 0.1:
                break
        assert states == {SafetyState.STATE_ARMED}
        assert max(angles) - min(angles) > 0.1, "the right arm goes on"
        assert send(control, "plug_in").startswith("ok")
        until(lambda: gate_of(run, "left") == SafetyState.STATE_DISARMED, "the left arm is back")
        assert gate_of(run, "right") == SafetyState.STATE_ARMED
        run.stop(10.0)
        for side in ("left", "right"):
            faults = [fault.code for fault in run.latest(f"{side}/arm/safety").faults]
            assert "person_stop" in faults, side
        until(lambda: gate_of(run, "right") == SafetyState.STATE_HOLD, "the right arm is at rest")
        assert gate_of(run, "left") != SafetyState.STATE_ARMED


@pytest.mark.long
@pytest.mark.parametrize("overlay", [(), ("--with", "koch")], ids=["Koch and OpenMANIPULATOR-X", "two Koch"])
def test_two_arms_in_real_time_do_their_tasks(launcher, overlay):
    code, shown = launcher.run("two_arms", *overlay, "--headless")
    assert code == 0, shown
    for side in ("left", "right"):
        tasks = json.loads((launcher.latest / side / "run.json").read_text())["tasks"]
        assert [one["good"] for one in tasks] == [True, True]


@pytest.mark.long
def test_two_arms_at_one_table_hand_over_what_belongs_to_the_other_side(launcher):
    code, shown = launcher.run("hand_over", "--headless", timeout_s=600)
    assert code == 0, shown
    tasks = json.loads((launcher.latest / "run.json").read_text())["tasks"]
    assert {one["thing"]: one["good"] for one in tasks} == {"red_cube": True, "blue_cube": True}
