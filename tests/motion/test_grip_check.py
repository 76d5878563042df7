"""A gripper that would feel nothing in the hand is named before a run, with what to change."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from paramove.motion.grip_check import check_grip
from paramove.robots import DescriptionError, RobotDescription

FOLDER = Path(__file__).parents[2] / "robot_description"
STIFF = ' solref="0.002 1" solimp="0.99 0.9999 0.0001"'


def check(folder: Path) -> None:
    robot = RobotDescription.load(folder)
    check_grip(robot, robot.model_path.parent / "scene.xml")


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """OpenMANIPULATOR-X with light fingers that are coupled as MuJoCo couples by default."""
    folder = tmp_path / "open_manipulator_x"
    shutil.copytree(FOLDER / "open_manipulator_x", folder)
    return folder


def change(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.mark.parametrize("name", ["koch_v1_1", "open_manipulator_x"])
def test_the_arms_here_feel_what_they_hold(name: str) -> None:
    check(FOLDER / name)


def test_a_humanoid_has_no_grip_to_be_checked() -> None:
    check(FOLDER / "hoap3")


def test_fingers_that_are_coupled_softly_are_named_with_what_makes_them_stiff(arm: Path) -> None:
    change(arm / "open_manipulator_x.xml", STIFF, "")
    with pytest.raises(DescriptionError, match=r'equality.*gripper solref="') as rejection:
        check(arm)
    assert "open_manipulator_x.xml" in str(rejection.value)


def test_an_opening_that_no_object_gives_is_named_with_the_object(arm: Path) -> None:
    change(arm / "robot.yaml", "gripper: {", "gripper: {felt_opening: 0.3, ")
    with pytest.raises(DescriptionError, match=r"red_cube, 25 mm wide.*felt_opening is 0\.3"):
        check(arm)


def test_a_scene_that_does_not_have_the_arm_or_names_of_its_things_is_rejected(arm: Path) -> None:
    change(arm / "scene.xml", '<body name="red_cube"', "<body")
    with pytest.raises(DescriptionError, match="no name"):
        check(arm)
    (arm / "scene.xml").write_text("<mujoco/>", encoding="utf-8")
    with pytest.raises(DescriptionError, match=r"include open_manipulator_x\.xml"):
        check(arm)
    (arm / "scene.xml").unlink()
    with pytest.raises(DescriptionError, match=r"scene\.xml"):
        check(arm)


def test_a_gripper_that_would_overload_on_its_object_is_named_with_the_angle_where_it_stops(arm: Path) -> None:
    change(arm / "robot.yaml", ", grip_current_ma: 200", "")
    with pytest.raises(DescriptionError, match=r"overloads.*closed_deg"):
        check(arm)
