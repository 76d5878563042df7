"""The robot's description and a fast movement of its right arm, for tests."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from paramove.robots.description import RobotDescription

ROBOT_DESCRIPTION = Path(__file__).parents[3] / "robot_description" / "hoap3"

# Tests start with the right forearm folded up and the hand open, wherever the description's own base pose is.
FOLDED_DEG = {
    "right_shoulder_pitch": 90.0,
    "right_shoulder_roll": -10.0,
    "right_shoulder_torsion": 0.0,
    "right_elbow": -110.0,
    "right_wrist": 0.0,
    "right_fingers": -60.0,
}


def _folded(robot: RobotDescription) -> RobotDescription:
    pose = robot.base_pose.copy()
    for joint, degrees in FOLDED_DEG.items():
        pose[robot.index(joint)] = np.deg2rad(degrees)
    return replace(robot, base_pose=pose)


HOAP3 = _folded(RobotDescription.load(ROBOT_DESCRIPTION))

SWING_DEG = {
    "right_shoulder_pitch": -75.0,
    "right_shoulder_roll": -40.0,
    "right_shoulder_torsion": 50.0,
    "right_elbow": 80.0,
    "right_wrist": 60.0,
    "right_fingers": 100.0,
}


def swing(robot: RobotDescription, duration_s: float) -> np.ndarray:
    """From the base pose out and rest: rows [N, 28] in rad, 1 ms apart."""
    u = np.linspace(0.0, 1.0, round(duration_s * 1000) + 1)[:, None]
    rise = 10 * u**3 - 15 * u**4 + 6 * u**5
    step = np.zeros(robot.n_joints)
    for joint, degrees in SWING_DEG.items():
        step[robot.index(joint)] = np.deg2rad(degrees)
    return np.asarray(robot.base_pose + rise * step)
