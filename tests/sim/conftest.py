"""Worlds for the tests of the simulation."""

from __future__ import annotations

from pathlib import Path

import pytest

from paramove.robots.description import RobotDescription
from sim.looks import Looks
from sim.scenes import at_the_tool_box
from sim.simulation import Simulation
from sim.simulator import Config, Scene
from sim.world import World

ROBOT = Path(__file__).resolve().parents[2] / "robot_description" / "hoap3"


@pytest.fixture(scope="session")
def description() -> RobotDescription:
    return RobotDescription.load(ROBOT)


@pytest.fixture
def world(description: RobotDescription) -> World:
    return World(Looks.draw(0), description)


def simulated(scene: Scene, seed: int, camera: bool = False, video: bool = False) -> Simulation:
    """A scene of HOAP-3 at its tool box."""
    return at_the_tool_box(Config(scene=scene, seed=seed, robot=ROBOT, camera=camera, video=video))
