"""Loading robot.yaml: what it gives and how it refuses a wrong one."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from paramove.robots.description import DescriptionError, RobotDescription
from paramove.robots.hoap3.firmware import Firmware
from tests.robots.hoap3.movements import HOAP3, ROBOT_DESCRIPTION
from tests.robots.servo_arms import FOLDER, KOCH, OPEN_MANIPULATOR_X


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
        pose[arm.fingers_index] = arm.fingers_closed + xi * (arm.fingers_open - arm.fingers_closed)
        expected = 120 * (1 - xi) if closed_counts == 120 else 120 * xi
        assert HOAP3.units.to_counts(pose)[arm.fingers_index] == expected


def test_unknown_joint_names_the_nearest() -> None:
    with pytest.raises(DescriptionError, match="'right_elbow'"):
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
        ("name: hoap3", "nam: hoap3", r"name is missing; .*nam: extra inputs are not permitted, found 'hoap3'"),
        ("lower_deg: -91,", "lower_deg: .nan,", r"yaml:8:64: '\.nan' is rejected"),
        ("upper_deg: 31,", "upper_deg: .inf,", r"yaml:8:81: '\.inf' is rejected"),
        ("upper_deg: 31,", "upper_deg: '31 deg',", r"valid number.*found '31 deg'"),
        (
            "upper_deg: 31,",
            "upper_deg: -92,",
            "expected lower_deg below upper_deg, found -91.0 and -92.0",
        ),
        ("counts_per_deg: 209,", "counts_per_deg: 0,", "right_hip_yaw: expected counts_per_deg other than 0"),
        ("margin_deg: 1.0,", "margin_deg: 70.0,", "a margin of 70.0 deg at both ends leaves nothing of -91.0 to 31.0"),
        (
            "torque_average: 1.5",
            "torque_average: -1.5",
            r"type2\.torque_average: input should be greater than 0",
        ),
        (
            "open_deg: -60, closed_deg: 60",
            "open_deg: 60, closed_deg: 60",
            "different angles of the open",
        ),
        ("    joints: [right_shoulder_pitch, ", "    joints: [", r"arms\.right\.joints\.4 is missing"),
        ("holding_openings: [0.36, 0.5]", "holding_openings: [0.5, 0.36]", "found 0.5 and 0.36"),
        ("felt_opening: 0.12", "felt_opening: 1.2", "felt_opening"),
        ("    upper_arm: 0.110\n", "", r"arms\.right\.upper_arm is missing"),
        ("name: right_knee,", "name: right_kn,", "model file .* does not exist"),
    ],
)
def test_wrong_files_are_refused_with_the_reason(tmp_path: Path, old: str, new: str, reason: str) -> None:
    text = (ROBOT_DESCRIPTION / "robot.yaml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "robot.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(DescriptionError, match=reason):
        RobotDescription.load(path)


def test_a_robot_of_servos_has_a_bus_and_a_chain_and_hoap3_has_not() -> None:
    assert (HOAP3.bus, HOAP3.servo_ids, HOAP3.chain) == (None, (), None)
    for robot, number_of_joints in ((OPEN_MANIPULATOR_X, 4), (KOCH, 5)):
        assert robot.firmware is None
        assert robot.arms == {}
        assert robot.bus is not None
        assert robot.bus.baud_rate == 1_000_000
        assert robot.chain is not None
        assert robot.chain.joints == robot.joint_names[:number_of_joints]
        np.testing.assert_array_equal(robot.chain.indices, range(number_of_joints))
        assert robot.joint_names[robot.chain.gripper_index] == robot.chain.gripper == "gripper"
        np.testing.assert_array_equal(robot.chain.kinematics.upper, robot.soft_upper[:number_of_joints])
        assert (robot.soft_lower <= robot.base_pose).all()
        assert (robot.base_pose <= robot.soft_upper).all()
        for angle in (robot.chain.gripper_open, robot.chain.gripper_closed):
            assert robot.soft_lower[-1] <= angle <= robot.soft_upper[-1]
        assert robot.stream.period_us == 10_000


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("servo_id: 12", "servo_id: 11", "servo_id given twice: 11"),
        ("servo_id: 12, ", "", "expected a bus and a servo_id for every joint.* found a bus and 4 of 5 joints"),
        ("bus: {baud_rate: 1000000}", "", "found no bus and 5 of 5"),
        ("servo_id: 12", "servo_id: 254", r"joints\.1\.servo_id: input should be less than or equal to 252, found 254"),
        (
            "lower_deg: -162,",
            "lower_deg: -182,",
            "joint1: expected a range within 0 to 4095 counts.* found -23 to 3891",
        ),
        ("chain:\n  joints: [joint1,", "chain:\n  joints: [joint9,", "the chain names unknown joints: joint9"),
        ("gripper: {joint: gripper,", "gripper: {joint: grip,", "the chain names unknown joints: grip"),
        ("open_deg: -80", "open_deg: 51", "different angles of the open and the closed gripper"),
        ("open_deg: -80", "open_deg: -90", r"gripper: -90.0 deg is outside -87.0 to 52.7 deg of joint gripper"),
        ("hand: [0.126, 0.0, 0.0]", "hand: [0.126, 0.0]", r"chain\.links\.hand\.2 is missing"),
        ("servo_id: 12, motor: xm430_w350", "servo_id: 12, motor: xm430_w355", "motor 'xm430_w355'"),
        ("  xm430_w350: {", "  xm430_w300: {", "motor 'xm430_w350'; known motors are xm430_w300"),
        (
            "operating_velocity_deg_s: 90.0",
            "operating_velocity_deg_s: 1e-9",
            r"operating_velocity_deg_s: input should be greater than or equal to 1",
        ),
        ("baud_rate: 1000000", "baud_rate: 0", r"bus\.baud_rate: input should be greater than 0"),
    ],
)
def test_wrong_files_of_servos_are_refused_with_the_reason(tmp_path: Path, old: str, new: str, reason: str) -> None:
    text = (FOLDER / "open_manipulator_x" / "robot.yaml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "robot.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(DescriptionError, match=reason):
        RobotDescription.load(path)


@pytest.mark.parametrize(
    ("model", "reason"),
    [
        ("xl430_w250", "grip_current_ma.*xl430_w250.*controls no current.*xm430_w350"),
        ("xl430_w300", "'xl430_w300', a servo whose registers are not known.* known are .*xl430_w250"),
    ],
)
def test_servos_that_do_not_exist_or_control_no_current_are_named(tmp_path: Path, model: str, reason: str) -> None:
    text = (FOLDER / "open_manipulator_x" / "robot.yaml").read_text(encoding="utf-8")
    (tmp_path / "robot.yaml").write_text(text.replace("xm430_w350", model), encoding="utf-8")
    with pytest.raises(DescriptionError, match=reason):
        RobotDescription.load(tmp_path)


def test_what_needs_an_arm_like_hoap3_refuses_a_robot_of_servos() -> None:
    assert HOAP3.arm("left") is HOAP3.arms["left"]
    with pytest.raises(DescriptionError, match="hoap3 describes the arms right, left, found side 'middle'"):
        HOAP3.arm("middle")
    with pytest.raises(DescriptionError, match="koch_v1_1 describes no arm of five joints like HOAP-3's"):
        KOCH.arm("right")


def test_the_firmware_of_hoap3_refuses_a_robot_of_servos() -> None:
    with pytest.raises(DescriptionError, match="koch_v1_1 has no firmware"):
        Firmware(KOCH)


@pytest.mark.parametrize("text", ["", "[]", "hoap3", "a: 1", "\x00", "joints: []"])
def test_a_file_without_a_robot_is_refused_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DescriptionError) as rejection:
        RobotDescription.load(path)
    assert str(path) in str(rejection.value)
    assert "\n" not in str(rejection.value)
    assert rejection.value.exit_code == 78


def test_a_file_of_other_bytes_is_refused(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_bytes(b"\xff\xfe name")
    with pytest.raises(DescriptionError, match=r"robot\.yaml"):
        RobotDescription.load(tmp_path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match=r"no robot description .*; name the folder that holds") as rejection:
        RobotDescription.load(tmp_path / "robot.yaml")
    assert rejection.value.exit_code == 66


def test_a_missing_model_file_is_named(tmp_path: Path) -> None:
    shutil.copy(ROBOT_DESCRIPTION / "robot.yaml", tmp_path)
    with pytest.raises(DescriptionError, match=r"the model file .*hoap3\.xml does not exist") as rejection:
        RobotDescription.load(tmp_path)
    assert rejection.value.missing


def test_the_limits_are_those_of_the_description() -> None:
    limits = HOAP3.motion_limits
    assert (limits.names, limits.dt_s) == (HOAP3.joint_names, 0.001)
    for ours, theirs in (
        (limits.lower, HOAP3.soft_lower),
        (limits.upper, HOAP3.soft_upper),
        (limits.motor_velocity, HOAP3.velocity),
        (limits.velocity, HOAP3.operating_velocity),
        (limits.acceleration, HOAP3.operating_acceleration),
        (limits.stop_acceleration, HOAP3.stop_acceleration),
        (limits.jerk, HOAP3.jerk),
    ):
        np.testing.assert_array_equal(ours, theirs)
