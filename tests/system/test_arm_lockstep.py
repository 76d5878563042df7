"""A servo arm in simulated time: the same driver, protocol and servos, and the same run again.

Two such arms in one run are in test_two_arms.py, among the tests of every day.
"""

from __future__ import annotations

import json

import pytest

from paramove.recording import read

pytestmark = pytest.mark.long
TOPICS = (
    "arm/joint_states",
    "arm/trajectory",
    "arm/trajectory_status",
    "relocation/goal",
    "relocation/status",
    "speech",
)


def run(launcher, name, *arguments):
    launcher.folder = launcher.folder.parent / name
    launcher.folder.mkdir()
    code, shown = launcher.run("dynamixel_arm", "--with", "emulated", *arguments, "--headless")
    assert code == 0, shown
    assert all(one["good"] for one in json.loads((launcher.latest / "run.json").read_text())["tasks"])
    published = [
        (one.topic, one.message.SerializeToString(deterministic=True))
        for one in read(launcher.latest / "recording.mcap", TOPICS)
    ]
    done_ns = list(read(launcher.latest / "recording.mcap", ("speech",)))[-1].message.captured.ToNanoseconds()
    truth = [one.message for one in read(launcher.latest / "truth.mcap", ("truth/state",))]
    return published, [one.joint_positions[:] for one in truth if one.time_ns < done_ns]


@pytest.mark.parametrize(
    "arm",
    [("--with", "lockstep"), ("--with", "koch", "--with", "lockstep", "--robot", "koch_v1_1")],
    ids=["open_manipulator_x", "koch_v1_1"],
)
def test_a_run_in_lockstep_is_repeatable(launcher, tmp_path, arm):
    launcher.folder = tmp_path / "runs"
    (published, joints), (again, joints_again) = (run(launcher, name, *arm) for name in ("one", "two"))
    both = min(len(published), len(again))
    assert both > 200
    assert published[:both] == again[:both]
    assert len(joints) > 200
    assert joints == joints_again, "until all tasks are done; the processes end as the machine lets them"
