"""Loading robot.yaml: what it gives and how it refuses a wrong one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from paramove.robots.description import DescriptionError, RobotDescription
from tests.robots.hoap3.movements import HOAP3, ROBOT_DESCRIPTION


def test_order_is_that_of_the_state_vector() -> None:
    names = HOAP3.joint_names
    assert len(names) == 28
    assert names[0] == "right_hip_yaw"
    assert names[6:10] == ("right_shoulder_pitch", "right_shoulder_roll", "right_shoulder_torsion", "right_elbow")
    assert names[10] == "left_hip_yaw"
    assert names[20:24] == ("waist_pitch", "head_pan", "head_tilt", "head_roll")
    assert names[24:] == ("right_wrist", "right_fingers", "left_wrist", "left_fingers")


def test_commands_stay_one_degree_inside_the_geared_joints() -> None:
    geared = HOAP3.velocity_loop
    assert geared.sum() == 21
    np.testing.assert_allclose((HOAP3.soft_lower - HOAP3.lower)[geared], np.deg2rad(1), rtol=0, atol=1e-12)
    np.testing.assert_allclose((HOAP3.upper - HOAP3.soft_upper)[geared], np.deg2rad(1), rtol=0, atol=1e-12)
    assert (HOAP3.soft_lower <= HOAP3.base_pose).all()
    assert (HOAP3.base_pose <= HOAP3.soft_upper).all()


def test_operating_limits_leave_room_for_a_stop_and_for_the_motor() -> None:
    assert (HOAP3.operating_velocity < HOAP3.velocity).all()
    assert (HOAP3.operating_acceleration < HOAP3.stop_acceleration).all()
    np.testing.assert_allclose(HOAP3.velocity[HOAP3.velocity_loop], 57 / 0.209 * np.pi / 180, rtol=2e-4, atol=0)


@pytest.mark.parametrize(("side", "closed_counts"), [("right", 120), ("left", 0)])
def test_open_is_xi_one_and_the_hands_count_in_opposite_directions(side: str, closed_counts: int) -> None:
    arm = HOAP3.arms[side]
    for xi in (0.0, 0.25, 1.0):
        pose = HOAP3.base_pose.copy()
        pose[arm.fingers_index] = arm.fingers_angle(xi)
        expected = 120 * (1 - xi) if closed_counts == 120 else 120 * xi
        assert HOAP3.units.to_counts(pose)[arm.fingers_index] == expected
    with pytest.raises(ValueError, match="outside 0"):
        arm.fingers_angle(1.1)


def test_unknown_joint_names_the_nearest() -> None:
    with pytest.raises(DescriptionError, match="nearest is 'right_elbow'"):
        HOAP3.index("right_elbo")


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("motor: type3,  ", "motor: type9,  ", "type9"),
        ("name: right_knee,", "name: right_hip_yaw,", "named twice: right_hip_yaw"),
        ("base_deg: 90", "base_deg: 190", "base pose 190.0 deg is outside"),
        ("kpp: 12", "kpq: 12", "kpq"),
        ("kpp: 12", "kpp: [", "robot.yaml"),
        ("joint: right_fingers", "joint: right_finger", "unknown joints: right_finger"),
    ],
)
def test_wrong_files_are_refused_with_the_reason(tmp_path: Path, old: str, new: str, reason: str) -> None:
    text = (ROBOT_DESCRIPTION / "robot.yaml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "robot.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(DescriptionError, match=reason):
        RobotDescription.load(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match="no robot description at"):
        RobotDescription.load(tmp_path / "robot.yaml")
