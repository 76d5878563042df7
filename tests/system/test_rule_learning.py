"""The whole demonstration: the robot learns where three objects belong and brings them there."""

import json

import pytest


@pytest.mark.slow
def test_robot_learns_the_rules_and_applies_them(launcher):
    """Judged by what really happened in the world, which no node of the robot knows."""
    code, shown = launcher.run("rule_learning", "--seed", "0", "--headless", timeout_s=900)
    assert code == 0, shown
    truth = launcher.truth()
    assert truth["success"], truth
    assert truth["placed"] == 3, truth
    assert truth["unwanted_contacts"] == 0, truth
    assert truth["deepest_penetration_mm"] <= 0.7, truth


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "overlays"), [("koch_v1_1", []), ("open_manipulator_x", ["--with", "sim", "--with", "wall_clock"])]
)
def test_a_servo_arm_calibrates_itself_and_begins_to_learn(launcher, robot, overlays):
    """As far as its own corners, in lockstep or in real time; `test_another_arm.py` follows the story to its end."""
    ends = ["--set", "simulator.max_duration_s=125", "--headless"]
    code, shown = launcher.run("rule_learning", "--robot", robot, *overlays, *ends)
    assert code != 0
    assert "Now I know where I see what I can reach" in shown
    numbers = json.loads((launcher.latest / "run.json").read_text())
    assert numbers["unwanted_contacts"] == 0
    assert all(0.0 <= one["time_s"] <= 130.0 for one in numbers["speech"]), "times count from the begin of the run"
