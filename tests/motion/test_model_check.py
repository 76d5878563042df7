"""Descriptions whose lengths, sites or ranges are not those of the model are rejected before an arm moves."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from paramove.motion.model_check import check_model
from paramove.robots import DescriptionError, RobotDescription

FOLDER = Path(__file__).parents[2] / "robot_description"


def check(folder: Path) -> None:
    check_model(RobotDescription.load(folder))


def changed(folder: Path, old: str, new: str) -> Path:
    """A copy of OpenMANIPULATOR-X's folder whose robot.yaml differs."""
    arm = FOLDER / "open_manipulator_x"
    text = (arm / "robot.yaml").read_text(encoding="utf-8")
    assert old in text
    (folder / "robot.yaml").write_text(text.replace(old, new), encoding="utf-8")
    shutil.copy(arm / "open_manipulator_x.xml", folder)
    return folder


@pytest.mark.parametrize("name", ["hoap3", "koch_v1_1", "open_manipulator_x"])
def test_the_descriptions_here_are_those_of_their_models(name: str) -> None:
    check(FOLDER / name)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("hand: [0.126,", "hand: [0.106,", r"lengths in robot\.yaml.*base.*open_manipulator_x\.xml"),
        ("shoulder: [0.0, 0.0, 0.0765]", "shoulder: [0.0, 0.0, 0.0965]", r"lengths in robot\.yaml"),
        ("yaw_axis: [0.012,", "yaw_axis: [0.014,", r"lengths in robot\.yaml"),
        ("end_effector: end_effector", "end_effector: end_efector", "no site 'end_efector'.*'end_effector'"),
        ("joint3,", "joint33,", "no joint 'joint33'.*'joint3'"),
        ("lower_deg: -97.4", "lower_deg: -110", r"joint4.*-110\.0 to 112\.8 deg.*has -97\.\d to 112\.\d"),
    ],
)
def test_what_contradicts_the_model_is_rejected(tmp_path: Path, old: str, new: str, reason: str) -> None:
    with pytest.raises(DescriptionError, match=reason):
        check(changed(tmp_path, old, new))


@pytest.mark.parametrize(
    ("file", "old", "new", "named"),
    [
        ("robot.yaml", "yaw_axis: [0.012,", "yaw_axis: [0.014,", r"joint1: chain\.links\.yaw_axis .*0\.012"),
        ("robot.yaml", "0.0, 0.0765]", "0.0, 0.0965]", r"joint2: chain\.links\.shoulder .*0\.0765"),
        ("robot.yaml", "upper_arm: [0.024,", "upper_arm: [0.034,", r"joint3: chain\.links\.upper_arm .*0\.024"),
        ("robot.yaml", "forearm: [0.124,", "forearm: [0.134,", r"joint4: chain\.links\.forearm .*0\.124"),
        ("robot.yaml", "hand: [0.126,", "hand: [0.106,", r"end_effector: chain\.links\.hand .*0\.126"),
        ("open_manipulator_x.xml", 'name="joint3" axis="0 1 0"', 'name="joint3" axis="0 -1 0"', r"joint3 turns about"),
    ],
)
def test_the_joint_from_which_on_lengths_disagree_is_named(
    tmp_path: Path, file: str, old: str, new: str, named: str
) -> None:
    changed(tmp_path, "name: open_manipulator_x", "name: another")
    text = (tmp_path / file).read_text(encoding="utf-8")
    assert old in text
    (tmp_path / file).write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(DescriptionError, match=named):
        check(tmp_path)


def test_a_millimetre_is_tolerated(tmp_path: Path) -> None:
    check(changed(tmp_path, "hand: [0.126,", "hand: [0.1265,"))


def test_a_model_that_mujoco_rejects_is_named(tmp_path: Path) -> None:
    folder = changed(tmp_path, "name: open_manipulator_x", "name: broken")
    (folder / "open_manipulator_x.xml").write_text("<mujoco><worldbody><geom/></worldbody></mujoco>", encoding="utf-8")
    with pytest.raises(DescriptionError, match=r"open_manipulator_x\.xml"):
        check(folder)
