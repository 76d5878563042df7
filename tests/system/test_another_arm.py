"""An arm that nobody has seen before works by its folder alone: other lengths and names, the same nodes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from paramove.robots.description import RobotDescription

KOCH = Path("robot_description/koch_v1_1")
MAST = """<body name="mast" pos="-0.1 0.1 0.05">
  <inertial pos="0 0 0" mass="0.05" diaginertia="1e-4 1e-4 1e-4"/>
  <joint name="camera_tilt" axis="0 1 0" range="-1 1"/>
</body>"""
JOINT = (
    "  - {name: camera_tilt, servo_id: 9, motor: xl330_m288, lower_deg: -50, upper_deg: 50, "
    "counts_per_deg: 11.3777778, zero_counts: 2048, base_deg: 10}\n"
)
"""Not of the arm: it stays in its base pose."""
LONGER = {
    "koch_v1_1.xml": {
        'pos="0.0073 0 0.1083"': 'pos="0.0073 0 0.1333"',  # the elbow's servo
        'name="elbow" pos="0.0148 0 0.1083"': 'name="elbow" pos="0.0148 0 0.1333"',
        'name="forearm" pos="0.0148 0 0.1083"': 'name="forearm" pos="0.0148 0 0.1333"',
        'pos="0.002 -0.0215 0.040" size="0.010 0.002 0.040"': 'pos="0.002 -0.0215 0.050" size="0.010 0.002 0.050"',
        'pos="0.002 0.0200 0.040" size="0.010 0.002 0.040"': 'pos="0.002 0.0200 0.050" size="0.010 0.002 0.050"',
        'pos="0.093 0 0.0027"': 'pos="0.111 0 0.0027"',  # the wrist's servo
        'name="wrist" pos="0.10048 0 0.0027"': 'name="wrist" pos="0.11848 0 0.0027"',
        'mass="0.050177"': 'mass="0.060"',
        "</worldbody>": f"{MAST}</worldbody>",
    },
    "robot.yaml": {
        "motors:\n": JOINT + "\nmotors:\n",
        "upper_arm: [0.0148, 0.1083]": "upper_arm: [0.0148, 0.1333]",
        "forearm: [0.10048, 0.0027]": "forearm: [0.11848, 0.0027]",
    },
}
NAMES = {"shoulder_pan": "turn", "elbow_flex": "bend", "koch_v1_1": "long_arm"}


def described(folder: Path) -> Path:
    """A Koch whose upper arm is 25 mm longer and whose forearm is 18 mm longer, with names and a joint of its own."""
    made = folder / "long_arm"
    made.mkdir()
    for file in ("koch_v1_1.xml", "scene.xml", "robot.yaml"):
        text = (KOCH / file).read_text(encoding="utf-8")
        for old, new in LONGER.get(file, {}).items():
            assert old in text, old
            text = text.replace(old, new)
        for old, new in NAMES.items():
            text = text.replace(old, new)
        (made / file.replace("koch_v1_1", "long_arm")).write_text(text, encoding="utf-8")
    return made


@pytest.mark.slow
def test_an_arm_that_is_a_folder_reaches_and_relocates(launcher, tmp_path):
    robot = described(tmp_path)
    joints = RobotDescription.load(robot).joint_names
    assert {"turn", "bend", "camera_tilt"} < set(joints)
    tasks = "reacher.tasks=[{reach: [0.22, 0.06, 0.11]}, {pick: [0.16, 0.0, 0.012], place: [0.21, 0.03, 0.012]}]"
    options = ["--with", "emulated", "--headless", "--robot", str(robot), "--set", tasks]
    code, shown = launcher.run("dynamixel_arm", *options)
    assert code == 0, shown
    results = json.loads((launcher.latest / "run.json").read_text())["tasks"]
    assert [one["task"] for one in results] == ["reach", "place"]
    assert all(one["good"] for one in results), results


@pytest.mark.long
def test_it_calibrates_itself_to_learn_rules(launcher, tmp_path):
    """As far as its own corners; the rest is the same for every arm."""
    ends = ["--headless", "--set", "simulator.max_duration_s=125"]
    _, shown = launcher.run("rule_learning", "--robot", str(described(tmp_path)), *ends)
    assert "Now I know where I see what I can reach" in shown
    assert launcher.truth()["unwanted_contacts"] == 0


@pytest.mark.long
def test_it_puts_the_object_where_a_person_points(launcher, tmp_path):
    options = ["--headless", "--robot", str(described(tmp_path)), "--set", "relocator.places=1"]
    code, shown = launcher.run("relocate_by_pointing", *options)
    assert code == 0, shown
    assert json.loads((launcher.latest / "run.json").read_text())["good"] == 1
