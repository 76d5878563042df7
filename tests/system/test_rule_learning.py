"""The whole demonstration: the robot learns where three objects belong and brings them there."""

import json

import pytest

from tests.docs.markdown import TEACH_RULES, blocks
from tests.docs.terminal import ENVIRONMENT, at_terminal, heard


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


@pytest.mark.long
def test_a_person_rehearses_with_a_servo_arm_in_real_time(launcher):
    """What the tutorial says to type; nothing of the robot knows that arm and camera are simulated."""
    rehearse, enable = [block.commands[0] for block in blocks(TEACH_RULES) if block.remark == "rehearsed by a test"]
    ends = ["--headless", "--set", "simulator.max_duration_s=700"]
    running = launcher.start(*rehearse.replace("--view", "").split()[2:], *ends)
    heard(running, "paramove arm enable")
    code, said = at_terminal(enable, "y\n", launcher.environment | {"PATH": ENVIRONMENT["PATH"]})
    assert "ARMED" in said, (code, said)
    shown, _ = running.communicate(timeout=900)
    assert running.returncode == 0, shown
    assert "SUCCESS: 3 of 3" in shown
    numbers = json.loads((launcher.latest / "run.json").read_text())
    assert numbers["unwanted_contacts"] == 0
    assert all(0.0 <= one["time_s"] <= 900.0 for one in numbers["speech"]), "times count from the begin of the run"
