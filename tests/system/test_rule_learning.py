"""The whole demonstration: the robot learns where three objects belong and brings them there."""

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
