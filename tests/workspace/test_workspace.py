"""The layered workspace: files of the current folder first, each missing one from the installed workspace."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from paramove.robots import RobotDescription
from paramove.supervision import load
from paramove.supervision.environment import node_environment
from paramove.supervision.interfaces import read_interface
from paramove.workspace import PARTS, Workspace

ROOT = Path(__file__).parents[1]


@pytest.fixture
def own(tmp_path):
    """An overlay, a node, a node in place of an installed one, and a robot, in a folder that has nothing else."""
    for name, text in {
        "launch/overlays/slow.yaml": "nodes: {camera: {parameters: {rate_hz: 5}}}\n",
        "nodes/mine.py": "SUBSCRIBES = ()\nPUBLISHES = ()\n",
        "nodes/camera.py": "SUBSCRIBES = ()\nPUBLISHES = ()\n",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return Workspace((tmp_path, ROOT))


def test_a_clone_is_a_workspace_of_one_layer_from_any_of_its_folders():
    assert Workspace.at(ROOT / "docs" / "how-to") == Workspace((ROOT,))
    assert Workspace.at(ROOT).clone == ROOT


def test_an_empty_folder_comes_before_what_is_installed(tmp_path):
    assert Workspace.at(tmp_path) == Workspace((tmp_path, ROOT))


def test_own_files_come_first_and_missing_ones_from_the_installed_workspace(own):
    assert own.find("nodes/camera.py") == own.root / "nodes" / "camera.py"
    assert own.find("nodes/recorder.py") == ROOT / "nodes" / "recorder.py"
    assert own.find("nodes/nowhere.py") == own.root / "nodes" / "nowhere.py"
    assert {"slow", "sim"} <= set(own.names("launch/overlays"))


def test_an_own_overlay_lies_over_an_installed_launch_file(own):
    launch = load(own, "rule_learning", ["sim", "slow"])
    assert launch.file.nodes["camera"].parameters["rate_hz"] == 5


def test_the_checked_source_is_that_of_the_first_layer(own):
    assert read_interface("nodes.camera", own).path == own.root / "nodes" / "camera.py"
    assert read_interface("nodes.recorder", own).path == ROOT / "nodes" / "recorder.py"


def test_a_process_of_a_node_imports_from_the_same_files_as_were_checked(own):
    script = (
        "import json, nodes.camera, nodes.mine, sim.scene as s; print(json.dumps([nodes.camera.__file__, s.__file__]))"
    )
    command = [sys.executable, "-c", script]
    answer = subprocess.run(
        command, cwd=own.root, env=node_environment({}, own), capture_output=True, text=True, check=True
    )
    assert json.loads(answer.stdout) == [str(own.find("nodes/camera.py")), str(own.find("sim/scene.py"))]


def test_the_digest_is_of_the_files_that_are_used(own):
    before = Workspace(own.folders).digest
    assert before != Workspace((ROOT,)).digest
    (own.root / "notes.txt").write_text("not a part of it")
    assert Workspace(own.folders).digest == before
    (own.root / "nodes" / "camera.py").unlink()
    (own.root / "nodes" / "mine.py").unlink()
    (own.root / "launch" / "overlays" / "slow.yaml").unlink()
    assert Workspace(own.folders).digest == Workspace((ROOT,)).digest
    assert {name.split("/")[0] for name in own.files()} == set(PARTS)


def test_a_robot_is_found_by_name_or_path_from_anywhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {RobotDescription.load(path).name for path in ("koch_v1_1", "robot_description/koch_v1_1")}
    assert len(names) == 1
    with pytest.raises(ValueError, match=r"koch_v1_1.*open_manipulator_x"):
        RobotDescription.load("koch_v2")
