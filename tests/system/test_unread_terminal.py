"""A servo arm in motion comes to rest within a second where nobody reads what its launcher writes."""

import itertools
import json
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from paramove.bus import topics
from paramove.bus.inspection import BusVisitor
from paramove.recording.parts import PartedRecording
from tests.supervision.conftest import until
from tests.supervision.test_unread_terminal import full_pipe

MOVING = 0.4  # rad/s of the fastest joint that carries the gripper, by its servo
CARRIERS = ("joint1", "joint2", "joint3", "joint4")
AT_REST = 0.005  # m/s of the gripper, by the simulated world
LIMIT_S = 1.0
WORLD = ("judge", "dynamixel_emulator")
"""End with the recorder, in any order."""


def await_motion(launcher):
    """Returns when a joint of the arm is moving."""
    log = launcher.latest / "events.jsonl"
    until(log.exists, "the run begins")
    for node in ("arm_driver", "reacher"):
        started = f'"event": "ready", "node": "{node}"'
        until(lambda started=started: started in log.read_text(), f"{node} is ready")
    with BusVisitor(Path(launcher.environment["XDG_RUNTIME_DIR"]) / "paramove" / "test", "onlooker") as bus:
        states = bus.subscriber(topics.ARM_JOINT_STATES)

        def moving():
            states.revive()
            heard = states.receive()
            if heard is None:
                return False
            return any(joint.name in CARRIERS and abs(joint.velocity) > MOVING for joint in heard.message.joints)

        until(moving, "the arm is moving")


def gripper_speeds(recording):
    """By the simulated world: the time on the bus clock, ns, and m/s since the time before."""
    read = PartedRecording(recording).read((topics.TRUTH_STATE.name,))
    truth = [(one.log_ns, np.array(one.message.gripper)) for one in read]
    return [
        (at_ns, np.linalg.norm(gripper - before) / ((at_ns - before_ns) * 1e-9))
        for (before_ns, before), (at_ns, gripper) in itertools.pairwise(truth)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("make", "code"), [(full_pipe, 130), (os.pipe, 141)], ids=["full", "closed"])
def test_the_arm_rests_within_a_second_and_all_ends_in_order(launcher, make, code):
    reader, writer = make()
    process = launcher.start("dynamixel_arm", stdout=writer, stderr=writer)
    os.close(writer)
    await_motion(launcher)
    asked_ns = time.monotonic_ns()
    if code == 141:
        os.close(reader)
    else:
        process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == code
    folder = launcher.latest.resolve()
    speeds = gripper_speeds(folder / "truth.mcap")
    before = max(speed for at_ns, speed in speeds if asked_ns - 1e9 < at_ns < asked_ns)
    assert before > 2 * AT_REST
    assert max(speed for _, speed in speeds[-2:]) < AT_REST
    assert (max(at_ns for at_ns, speed in speeds if speed > AT_REST) - asked_ns) * 1e-9 < LIMIT_S
    assert list(folder.glob("*.part")) == []
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    ended = [event["node"] for event in events if event["event"] == "ended" and event["node"] not in WORLD]
    assert (ended[0], ended[-1]) == ("arm_driver", "recorder")
    for pid in (event["pid"] for event in events if event["event"] == "started"):
        assert not Path(f"/proc/{pid}").exists()
