"""The launch files that come with the project: their nodes exist and fit together."""

from pathlib import Path

import pytest

from paramove.documents import DocumentError
from paramove.supervision import application
from paramove.supervision.launch_file import load
from paramove.workspace import Workspace

ROOT = Path(__file__).parents[2]
LAUNCH_FILES = sorted(path.stem for path in (ROOT / "launch").glob("*.yaml"))
SIMULATED = {"dynamixel_arm": ["emulated"], "hand_over": ["emulated"], "two_arms": ["lockstep"]}
"""The overlays that stand for the hardware, where they are not `sim`."""


@pytest.mark.parametrize(
    ("name", "overlays"), [(name, one) for name in LAUNCH_FILES for one in (SIMULATED.get(name, ["sim"]), ["real"])]
)
def test_nodes_fit_together(name, overlays):
    launch = load(Workspace.at(ROOT), name, overlays)
    application.check(launch, Workspace.at(ROOT))


def test_an_arm_that_is_tracked_fits_on_top_of_the_simulation():
    launch = load(Workspace.at(ROOT), "rule_learning", ["sim", "action_space"])
    application.check(launch, Workspace.at(ROOT))
    assert launch.file.nodes["rule_learner"].parameters["pointing"] == "action_space"
    assert launch.file.nodes["simulator"].parameters["video"]  # what the overlay sim sets stays


@pytest.mark.parametrize("overlays", [["sim"], ["sim", "action_space"]])
def test_only_simulator_and_judge_get_the_truth(overlays):
    launch = load(Workspace.at(ROOT), "rule_learning", overlays)
    assert {name for name, node in launch.file.nodes.items() if node.truth} == {"simulator", "judge"}


def test_truth_is_nowhere_with_a_real_robot():
    launch = load(Workspace.at(ROOT), "rule_learning", ["real"])
    assert not any(node.truth for node in launch.file.nodes.values())


def test_recorder_ends_last_and_arm_first():
    launch = load(Workspace.at(ROOT), "rule_learning", ["sim"])
    assert [name for name, node in launch.file.nodes.items() if node.stop == "first"] == ["arm_driver"]
    assert launch.file.nodes["recorder"].stop == "last"


def test_seed_goes_to_the_simulator_alone():
    launch = load(Workspace.at(ROOT), "rule_learning", ["sim"], seed=4711)
    seeded = [name for name, node in launch.file.nodes.items() if node.parameters.get("seed") == 4711]
    assert seeded == ["simulator"]


@pytest.mark.parametrize("name", ["rule_learning", "relocate_by_pointing"])
def test_every_described_robot_can_be_named(name):
    workspace = Workspace.at(ROOT)
    for robot in workspace.robots():
        application.check(load(workspace, name, robot=robot), workspace)
    with pytest.raises(DocumentError, match="koch_v1_1, open_manipulator_x"):
        application.check(load(workspace, name, robot="koch_v2"), workspace)
