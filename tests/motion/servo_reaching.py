"""The servo arms with the learned reaching, for tests."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from paramove.motion.clear_plans import joined
from paramove.motion.plans import Grasp, PlannedMotion
from paramove.motion.servo_arm_reaching import ServoArmReaching
from paramove.robots.description import RobotDescription
from tests.motion.reaching import reaching_model
from tests.robots.servo_arms import ARMS

FARTHEST = {"open_manipulator_x": 0.34, "koch_v1_1": 0.27}
GRASP_Z = 0.016


@cache
def reaching(name: str) -> ServoArmReaching:
    return ServoArmReaching(description(name), reaching_model())


def pick_and_place(name: str, source: ArrayLike, place: ArrayLike) -> PlannedMotion:
    """Both motions of a relocation."""
    fetch = reaching(name).fetch(source, grasp=Grasp(np.asarray(place)))
    return joined(fetch, reaching(name).deliver(fetch.end, place))


def description(name: str) -> RobotDescription:
    (found,) = (robot for robot in ARMS if robot.name == name)
    return found


def places(name: str, count: int, heights: tuple[float, float], seed: int, farthest: float = 1.0) -> np.ndarray:
    """Random ones around an arm, [count, 3], m."""
    rng = np.random.default_rng(seed)
    azimuth, radius = np.deg2rad(rng.uniform(-90, 90, count)), rng.uniform(0.12, farthest * FARTHEST[name], count)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), rng.uniform(*heights, count)], axis=1)
