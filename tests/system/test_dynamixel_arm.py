"""The servo arm's application: real processes, real bytes on an emulated bus, objects moved by friction alone."""

import json

import pytest


@pytest.mark.slow
def test_an_arm_reaches_and_carries_an_object(launcher):
    code, shown = launcher.run("dynamixel_arm", timeout_s=300)
    assert code == 0, shown
    assert "SUCCESS: 2 of 2 tasks done" in shown
    summary = json.loads((launcher.latest / "run.json").read_text())
    assert [one["task"] for one in summary["tasks"]] == ["reach", "place"]
    assert (launcher.latest / "tasks.png").stat().st_size > 10_000
