"""The robot, the reaching model trained once a session, and what is built on it, for tests."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from paramove.demonstrations.reaching import train_reaching_model
from paramove.motion.arm_pose import ArmPoseSolver
from paramove.motion.clearance import ClearanceChecker
from paramove.motion.conversion import RobotMovement
from paramove.motion.gripper_arm import GripperArm
from paramove.motion.relocation import RelocationPlanner
from paramove.phmm import InterpolativePHMM
from paramove.robots import SurfaceParameters
from paramove.robots.description import Arm, RobotDescription

ROBOT_FOLDER = Path(__file__).parents[2] / "robot_description" / "hoap3"
HOAP3 = RobotDescription.load(ROBOT_FOLDER)
ARM: Arm = HOAP3.arms["right"]
JOINTS = [*ARM.indices, ARM.fingers_index]
SURFACE = SurfaceParameters().of(HOAP3, "right")

# Where the objects stand, where they go and where the robot calibrates; shoulder frame, m.
GRASP_Z = -0.098
OPENINGS = ((0.135, -0.095), (0.135, -0.038), (0.135, 0.019), (0.135, 0.076))
CORNERS = ((0.135, -0.10), (0.135, 0.076), (0.19, 0.076), (0.19, -0.10))


@cache
def reaching_model() -> InterpolativePHMM:
    return train_reaching_model(0)


@cache
def solver() -> ArmPoseSolver:
    return ArmPoseSolver(HOAP3, ARM)


RIGHT = GripperArm.of(HOAP3, "right")


@cache
def movement() -> RobotMovement:
    return RobotMovement(reaching_model(), solver().length)


@cache
def planner() -> RelocationPlanner:
    return RelocationPlanner(movement(), solver(), HOAP3, ARM)


@cache
def checker() -> ClearanceChecker:
    return ClearanceChecker(HOAP3, RIGHT, SURFACE)


def at(place: tuple[float, float], z: float = GRASP_Z) -> np.ndarray:
    """A place on the working plane as a position of the gripper, [3], m."""
    return np.array([*place, z])
