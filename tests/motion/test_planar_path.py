"""Paths of the hand become paths of the joints: exact, within the limits, with the wanted pitch where that goes."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.motion.planar_path import LARGEST_STEP, NoJointPathError, planar_path
from paramove.robots.planar_arm import PlanarArm
from tests.robots.servo_arms import ARMS

each_arm = pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.name)


def begun(arm: PlanarArm, end: tuple[float, ...], points: int = 30) -> tuple[np.ndarray, np.ndarray]:
    """A posture and a straight line from where its hand is."""
    start = arm.joint_angles((0.16, -0.05, 0.06), 1.0)
    here = arm.forward(start).position
    return start, here + np.linspace(0.0, 1.0, points)[:, None] * (np.array(end) - here)


@each_arm
def test_every_point_is_reached_from_the_start_on_to_the_last_pitch(robot) -> None:
    arm = robot.chain.kinematics
    start, line = begun(arm, (0.12, 0.10, 0.03))
    pitches = np.linspace(1.0, 1.4, 30)
    path = planar_path(arm, line, pitches, start)
    there = arm.forward(path)
    np.testing.assert_allclose(path[0], start, rtol=0, atol=1e-12)
    np.testing.assert_allclose(there.position, line, rtol=0, atol=1e-9)
    np.testing.assert_allclose(there.pitch, pitches, rtol=0, atol=1e-9)


@each_arm
def test_where_the_wanted_pitch_is_out_of_reach_another_is_taken_and_changed_smoothly(robot) -> None:
    arm = robot.chain.kinematics
    start, line = begun(arm, (0.14, 0.05, 0.20))
    share = np.linspace(0.0, 1.0, 30)
    last = arm.nearest_pitch(line[-1], np.pi / 2)
    pitches = 1.0 + share * (last - 1.0) + 0.8 * np.sin(np.pi * share)  # too far down for so high up
    path = planar_path(arm, line, pitches, start)
    there = arm.forward(path)
    np.testing.assert_allclose(there.position, line, rtol=0, atol=1e-9)
    assert there.pitch[-1] == pytest.approx(pitches[-1], rel=0, abs=1e-9)
    assert np.abs(there.pitch - pitches).max() > 0.1
    assert (path >= arm.lower - 1e-9).all()
    assert (path <= arm.upper + 1e-9).all()
    assert np.abs(np.diff(path, axis=0)).max() < LARGEST_STEP


@each_arm
@pytest.mark.parametrize("end", [(0.7, 0.0, 0.1), (0.1, 0.0, -0.6)])
def test_a_point_out_of_reach_is_named(robot, end: tuple[float, ...]) -> None:
    arm = robot.chain.kinematics
    start, line = begun(arm, end)
    with pytest.raises(NoJointPathError, match=r"no posture reaches \(0\.\d+"):
        planar_path(arm, line, np.linspace(1.0, 1.2, 30), start)


@each_arm
def test_jumps_of_the_joints_are_refused(robot) -> None:
    arm = robot.chain.kinematics
    start, line = begun(arm, (0.12, 0.10, 0.03))
    line[15:] = line[15:] * (1.0, -1.0, 1.0) - (0.0, 0.1, 0.0)
    with pytest.raises(NoJointPathError, match="would have to jump near"):
        planar_path(arm, line, np.linspace(1.0, 1.2, 30), start)
