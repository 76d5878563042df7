"""A synthetic run for the tests of its evaluation."""

from pathlib import Path

import pytest

from paramove.robots.description import RobotDescription
from paramove.runs.recorded_run import load_run
from paramove.runs.rule_learning.summary import RunEvaluation
from paramove.workspace import Workspace
from tests.runs.synthetic_run import SyntheticRun

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def robot():
    return RobotDescription.load(ROOT / "robot_description" / "hoap3")


@pytest.fixture
def evaluated(tmp_path, robot):
    """Makes a run and evaluates it."""

    def make(after_end=0, name="run", **options):
        folder = tmp_path / name
        folder.mkdir()
        SyntheticRun(folder, robot, **options).write(after_end)
        return RunEvaluation(load_run(folder), robot, Workspace.at(ROOT))

    return make
