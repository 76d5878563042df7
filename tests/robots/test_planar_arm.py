"""Closed form of the servo arms: equal to MuJoCo's kinematics, exact inverse, and clear refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from paramove.robots.description import RobotDescription
from paramove.robots.planar_arm import OutOfReachError, PlanarArm
from tests.robots.servo_arms import ARMS, KOCH, OPEN_MANIPULATOR_X, ArmModel

each_arm = pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.name)


def arm_of(robot: RobotDescription) -> PlanarArm:
    assert robot.chain is not None
    return robot.chain.kinematics


def postures(arm: PlanarArm, count: int) -> np.ndarray:
    return np.random.default_rng(5).uniform(arm.lower, arm.upper, size=(count, arm.n_joints))


@each_arm
def test_forward_is_the_kinematics_of_the_model(robot: RobotDescription) -> None:
    arm, model = arm_of(robot), ArmModel(robot)
    assert robot.chain is not None
    everything = np.random.default_rng(4).uniform(robot.lower, robot.upper, size=(500, robot.n_joints))
    found = arm.forward(everything[:, robot.chain.indices])
    for i, angles in enumerate(everything):
        model.place(angles)
        site = model.data.site(robot.chain.sites.end_effector)
        np.testing.assert_allclose(found.position[i], site.xpos, rtol=0, atol=1e-9)
        turned = Rotation.from_euler("ZYX", [angles[robot.chain.indices[0]], found.pitch[i], found.roll[i]])
        np.testing.assert_allclose(turned.as_matrix(), site.xmat.reshape(3, 3), rtol=0, atol=1e-9)


@each_arm
def test_the_inverse_gives_a_posture_back_that_it_is_told_to_stay_near(robot: RobotDescription) -> None:
    arm = arm_of(robot)
    for angles in postures(arm, 1000):
        there = arm.forward(angles)
        found = arm.joint_angles(there.position, float(there.pitch), float(there.roll), near=angles)
        np.testing.assert_allclose(found, angles, rtol=0, atol=1e-6)


@each_arm
def test_every_solution_reaches_position_pitch_and_roll_within_the_limits(robot: RobotDescription) -> None:
    arm = arm_of(robot)
    for angles, other in zip(postures(arm, 500), postures(arm, 500)[::-1], strict=True):
        there = arm.forward(angles)
        for near in (None, other):
            found = arm.joint_angles(there.position, float(there.pitch), float(there.roll), near=near)
            assert (found >= arm.lower - 1e-9).all()
            assert (found <= arm.upper + 1e-9).all()
            again = arm.forward(found)
            np.testing.assert_allclose(again.position, there.position, rtol=0, atol=1e-9)
            for name in ("pitch", "roll"):
                turn = getattr(again, name) - getattr(there, name)
                np.testing.assert_allclose(np.remainder(turn + 1, 2 * np.pi), 1.0, rtol=0, atol=1e-9)


@each_arm
def test_both_elbows_are_found_and_the_nearer_one_is_taken(robot: RobotDescription) -> None:
    """Only the nearly stretched arm has both within its limits."""
    arm = arm_of(robot)
    stretched = np.arctan2(arm.forearm[1], arm.forearm[0]) - np.arctan2(arm.upper_arm[1], arm.upper_arm[0])
    below = arm.lower + 0.5 * (arm.upper - arm.lower)
    below[1], below[2] = np.deg2rad(20), stretched - np.deg2rad(4)
    there = arm.forward(below)
    above = arm.joint_angles(there.position, float(there.pitch), float(there.roll))
    np.testing.assert_allclose(above[2], stretched + np.deg2rad(4), rtol=0, atol=1e-9)
    for near in (below, above):
        found = arm.joint_angles(there.position, float(there.pitch), float(there.roll), near=near + 0.01)
        np.testing.assert_allclose(found, near, rtol=0, atol=1e-9)


def test_without_a_posture_the_arm_faces_the_position_with_the_elbow_above() -> None:
    for robot in ARMS:
        arm = arm_of(robot)
        angles = arm.joint_angles((0.15, 0.08, 0.03), np.deg2rad(85))
        np.testing.assert_allclose(angles[0], np.arctan2(0.08, 0.15 - arm.yaw_axis[0]), rtol=0, atol=0.05)
        assert angles[2] + np.arctan2(arm.upper_arm[1], arm.upper_arm[0]) > 0


@each_arm
def test_a_point_too_far_away_is_refused_with_a_reachable_one(robot: RobotDescription) -> None:
    arm = arm_of(robot)
    with pytest.raises(
        OutOfReachError, match=r"wrist .* its links reach 0\.\d+ to .*first reachable point is \(0\."
    ) as rejection:
        arm.joint_angles((0.60, 0.0, 0.20), 0.0)
    nearer = rejection.value.position
    assert nearer is not None
    assert 0.25 < nearer[0] < 0.45
    pitch = arm.nearest_pitch(nearer, 0.0)
    np.testing.assert_allclose(arm.forward(arm.joint_angles(nearer, pitch)).position, nearer, rtol=0, atol=1e-9)


def test_a_joint_at_its_limit_is_named_with_the_nearest_pitch() -> None:
    arm = arm_of(OPEN_MANIPULATOR_X)
    position = (0.20, 0.0, 0.15)
    with pytest.raises(OutOfReachError, match=r"joint\d would have to turn to .* its range is") as rejection:
        arm.joint_angles(position, np.deg2rad(-110))
    assert rejection.value.pitch is not None
    assert f"nearest reachable pitch there is {np.rad2deg(rejection.value.pitch):.1f} deg" in str(rejection.value)
    arm.joint_angles(position, rejection.value.pitch)


@each_arm
def test_the_nearest_pitch_is_reachable_and_no_nearer_one_is(robot: RobotDescription) -> None:
    arm = arm_of(robot)
    rng = np.random.default_rng(6)
    rejected = 0
    for angles in postures(arm, 25):
        position, wanted = arm.forward(angles).position, rng.uniform(-np.pi, np.pi)
        pitch = arm.nearest_pitch(position, wanted)
        arm.joint_angles(position, pitch)
        away = np.remainder(pitch - wanted + np.pi, 2 * np.pi) - np.pi
        for part in np.linspace(0.0, 0.99, 6) if abs(away) > 1e-5 else ():
            rejected += 1
            with pytest.raises(OutOfReachError):
                arm.joint_angles(position, wanted + part * away)
    assert rejected > 50


def test_a_reachable_pitch_is_its_own_nearest() -> None:
    assert arm_of(KOCH).nearest_pitch((0.15, 0.0, 0.02), 1.2) == 1.2


def test_an_arm_without_a_roll_joint_refuses_a_roll() -> None:
    with pytest.raises(OutOfReachError, match="no roll joint"):
        arm_of(OPEN_MANIPULATOR_X).joint_angles((0.2, 0.0, 0.1), 0.0, roll=0.3)
    angles = arm_of(KOCH).joint_angles((0.2, 0.0, 0.1), 0.3, roll=0.3)
    assert angles[4] == pytest.approx(0.3, rel=0, abs=1e-12)


def test_a_point_beside_the_yaw_axis_is_refused_where_the_arm_lies_further_out() -> None:
    with pytest.raises(OutOfReachError, match="nearer to the yaw axis than the plane of the arm"):
        arm_of(KOCH).joint_angles((0.001, 0.0, 0.2), 0.0)


def test_nothing_is_proposed_where_no_point_on_the_way_is_reachable() -> None:
    arm = replace(arm_of(OPEN_MANIPULATOR_X), upper=np.array([-2.5, 0.1, 1.3, 1.9]), lower=np.full(4, -2.7))
    with pytest.raises(OutOfReachError, match="so is every point between it and the shoulder") as rejection:
        arm.joint_angles((0.0, 0.2, 0.1), 0.5)
    assert rejection.value.pitch is None
    assert rejection.value.position is None


@pytest.mark.parametrize("position", [(0.1, 0.0), (0.1, np.nan, 0.1), [(0.1, 0.0, 0.1)]])
def test_what_is_no_position_is_refused(position: object) -> None:
    with pytest.raises(ValueError, match=r"shape|finite") as rejection:
        arm_of(KOCH).joint_angles(position, 0.0)
    assert not isinstance(rejection.value, OutOfReachError)


def test_wrong_numbers_of_angles_are_refused() -> None:
    with pytest.raises(ValueError, match="must hold the arm's 5 joints"):
        arm_of(KOCH).forward(np.zeros(4))
    with pytest.raises(ValueError, match=r"posture has shape \(5,\)"):
        arm_of(KOCH).joint_angles((0.15, 0.0, 0.05), 0.5, near=np.zeros(4))
