"""An arm in ROS 2: a program that knows ROS and not paramove reads its joints, sends it a goal and stops it."""

import importlib.util
import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.terminal import heard

COMMAND = [sys.executable, Path(__file__).with_name("ros2_program.py"), "arm_base", "0.18", "0.05", "0.10"]
REACHING = ("dynamixel_arm", "--with", "emulated", "--with", "external_goals", "--with", "ros2", "--headless")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        importlib.util.find_spec("rclpy") is None, reason="not installed: rclpy (pip install 'paramove[ros2]')"
    ),
]


def exit_code_of(node, launcher):
    events = [json.loads(line) for line in (launcher.latest / "events.jsonl").read_text().splitlines()]
    (ended,) = [event for event in events if event["event"] == "ended" and event.get("node") == node]
    return ended["exit_code"]


def test_a_program_of_ros_reads_the_joints_sends_a_goal_and_stops_the_arm(launcher):
    launcher.environment["ROS_DOMAIN_ID"] = "83"
    run = launcher.start(*REACHING)
    program = subprocess.run(
        COMMAND, env=launcher.environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert program.returncode == 0, program.stderr
    joints, goal, stopped, _ = map(json.loads, program.stdout.splitlines())
    assert joints["joints"] == ["joint1", "joint2", "joint3", "joint4", "gripper"]
    assert len(joints["positions"]) == 5
    assert -0.1 < joints["age_s"] < 5.0, "the stamp is of the system's clock"
    assert goal == {"state": "SUCCEEDED", "reason": ""}
    assert stopped["faults"] == {"person_stop": "stopped from the program paramove of ROS 2"}
    run.send_signal(signal.SIGINT)
    heard(run, "stopped by Ctrl-C")
    assert run.wait(60) == 130
    assert exit_code_of("ros2", launcher) == 0


def test_a_goal_under_way_holds_up_no_end(launcher):
    """The program sends a goal and leaves; the run is ended while the arm moves."""
    launcher.environment["ROS_DOMAIN_ID"] = "84"
    run = launcher.start(*REACHING)
    program = subprocess.run(
        [*COMMAND, "--leave"], env=launcher.environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert program.returncode == 0, program.stderr
    run.send_signal(signal.SIGINT)
    assert run.wait(60) == 130
    assert exit_code_of("ros2", launcher) == 0
