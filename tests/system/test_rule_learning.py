"""The whole demonstration: the robot learns where three objects belong and brings them there."""

import pytest

from paramove.supervision.launch_file import load
from tests.system.conftest import ROOT
from tests.system.test_launch_files import missing_modules


@pytest.mark.slow
def test_robot_learns_the_rules_and_applies_them(launcher):
    if missing := missing_modules(load(ROOT / "launch", "rule_learning", ["sim"])):
        pytest.skip(f"to be written: {', '.join(missing)}")
    code, shown = launcher.run("rule_learning", "--seed", "1", "--headless", timeout_s=900)
    assert code == 0, shown
    assert launcher.truth()["success"]
