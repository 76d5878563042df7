"""Relocation by pointing, as a person starts it: judged by what is true."""

import json

import pytest


@pytest.mark.slow
def test_the_object_ends_where_the_person_points(launcher):
    code, shown = launcher.run("relocate_by_pointing", "--seed", "0", "--set", "relocator.places=1", timeout_s=580)
    assert code == 0, shown
    assert "SUCCESS: 1 of 1 times the object ended within 12.6 mm of the place pointed at" in shown
    summary = json.loads((launcher.latest / "run.json").read_text())
    assert summary["success"]
    (one,) = summary["relocations"]
    assert one["error_mm"] <= 12.6
    assert one["placing_error_mm"] < 3.0
    assert summary["unwanted_contacts"] == 0
    report = (launcher.latest / "report.html").read_text()
    assert "<video" in report
    assert "data:image/jpeg;base64" in report
    assert (launcher.latest / "relocations.mp4").stat().st_size > 10_000


@pytest.mark.long
@pytest.mark.parametrize("robot", ["koch_v1_1", "open_manipulator_x"])
def test_a_servo_arm_puts_the_object_where_a_person_points(launcher, robot):
    """By images, joint states and emulated servos; in lockstep."""
    code, shown = launcher.run("relocate_by_pointing", "--robot", robot, "--headless", "--set", "relocator.places=1")
    assert code == 0, shown
    numbers = json.loads((launcher.latest / "run.json").read_text())
    assert numbers["good"] == 1
    assert numbers["unwanted_contacts"] == 0
