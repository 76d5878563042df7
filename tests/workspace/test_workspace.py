"""The layered workspace: files of the current folder first, each missing one from the installed workspace."""

import json
import os
import pwd
import subprocess
import sys
from pathlib import Path

import pytest

from paramove.robots import RobotDescription
from paramove.supervision import load
from paramove.supervision.environment import node_environment
from paramove.supervision.interfaces import read_interface
from paramove.workspace import PARTS, Workspace
from paramove.workspace.trust import TRUSTED_VARIABLE
from tests.diagnosis.unprivileged import NOBODY, needs_root

ROOT = Path(__file__).parents[2]


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
    return Workspace(tmp_path, (tmp_path, ROOT))


def test_a_clone_is_a_workspace_of_one_layer_from_any_of_its_folders():
    assert Workspace.at(ROOT / "docs" / "how-to") == Workspace(ROOT, (ROOT,))
    assert Workspace.at(ROOT).clone == ROOT


def test_an_empty_folder_comes_before_what_is_installed(tmp_path):
    assert Workspace.at(tmp_path) == Workspace(tmp_path, (tmp_path, ROOT))


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
    command = [sys.executable, "-P", "-c", script]
    answer = subprocess.run(
        command, cwd=own.root, env=node_environment({}, own), capture_output=True, text=True, check=True
    )
    assert json.loads(answer.stdout) == [str(own.find("nodes/camera.py")), str(own.find("sim/scene.py"))]


def test_the_digest_is_of_the_files_that_are_used(own):
    before = Workspace(own.root, own.layers).digest
    assert before != Workspace(ROOT, (ROOT,)).digest
    (own.root / "notes.txt").write_text("not a part of it")
    assert Workspace(own.root, own.layers).digest == before
    (own.root / "nodes" / "camera.py").unlink()
    (own.root / "nodes" / "mine.py").unlink()
    (own.root / "launch" / "overlays" / "slow.yaml").unlink()
    assert Workspace(own.root, own.layers).digest == Workspace(ROOT, (ROOT,)).digest
    assert {name.split("/")[0] for name in own.files()} == set(PARTS)


def test_a_robot_is_found_by_name_or_path_from_anywhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {RobotDescription.load(path).name for path in ("koch_v1_1", "robot_description/koch_v1_1")}
    assert len(names) == 1
    with pytest.raises(ValueError, match=r"koch_v1_1.*open_manipulator_x"):
        RobotDescription.load("koch_v2")


def test_what_an_own_folder_replaces_is_named(own):
    (own.root / "robot_description" / "koch_v1_1").mkdir(parents=True)
    (own.root / "robot_description" / "koch_v1_1" / "robot.yaml").write_text("")
    (own.root / "launch" / "rule_learning.yaml").write_text("")
    assert own.replaced() == ["launch/rule_learning.yaml", "nodes/camera.py", "robot_description/koch_v1_1"]
    assert Workspace.at(ROOT).replaced() == []


@pytest.fixture
def desk(own, monkeypatch):
    """An own workspace with a folder in it, where nothing is trusted by a variable."""
    monkeypatch.delenv(TRUSTED_VARIABLE, raising=False)
    monkeypatch.delenv("SUDO_UID", raising=False)
    (own.root / "mine").mkdir()
    return own.root


def test_a_folder_of_the_user_counts(desk):
    found = Workspace.at(desk / "mine")
    assert (found.root, found.layers, found.left_out) == (desk, (desk, ROOT), ())


@pytest.mark.parametrize("name", [".", "nodes", "nodes/camera.py", "launch/overlays", "launch/overlays/slow.yaml"])
def test_where_everybody_may_write_nothing_is_used(desk, name):
    (desk / name).chmod(0o777)
    found = Workspace.at(desk / "mine")
    assert found.root == desk / "mine"
    assert desk not in found.layers
    assert f"{(desk / name).resolve()} can be written by everybody" in found.left_out[0]
    assert found.find("nodes/camera.py") == ROOT / "nodes" / "camera.py"
    here = Workspace.at(desk)
    assert here.root == desk
    assert here.layers == (ROOT,)
    assert len(here.left_out) == 1


def test_an_untrusted_folder_without_files_of_applications_needs_no_sentence_and_is_not_searched(tmp_path):
    tmp_path.chmod(0o1777)
    (tmp_path / "numpy.py").write_text("raise SystemExit(3)")
    found = Workspace.at(tmp_path)
    assert (found.root, found.layers, found.left_out) == (tmp_path, (ROOT,), ())
    searched = node_environment({"PYTHONPATH": ""}, found)["PYTHONPATH"].split(os.pathsep)
    assert searched == [str(ROOT)]


def test_a_folder_above_whose_folders_everybody_may_rename_makes_the_one_below_untrusted(desk):
    parent = desk / "mine"
    (parent / "own" / "launch").mkdir(parents=True)
    (parent / "own" / "nodes").mkdir()
    parent.chmod(0o1777)
    assert Workspace.at(parent / "own").root == parent / "own"
    parent.chmod(0o777)
    found = Workspace.at(parent / "own")
    assert found.root == desk
    assert f"rename folders in {parent.resolve()}" in found.left_out[0]


def test_a_variable_names_folders_that_count_whoever_may_write_there(desk, monkeypatch):
    desk.chmod(0o777)
    monkeypatch.setenv(TRUSTED_VARIABLE, f"/nowhere{os.pathsep}{desk}")
    assert Workspace.at(desk / "mine").layers == (desk, ROOT)


def test_a_link_to_nothing_such_as_the_lock_of_an_editor_changes_nothing(desk):
    (desk / "nodes" / ".#camera.py").symlink_to("somebody@desk.4711")
    assert Workspace.at(desk).layers == (desk, ROOT)


def test_a_link_to_what_others_may_write_is_as_what_it_names(desk, tmp_path_factory):
    other = tmp_path_factory.mktemp("other") / "camera.py"
    other.write_text("SUBSCRIBES = ()")
    other.chmod(0o666)
    (desk / "nodes" / "linked.py").symlink_to(other)
    assert desk not in Workspace.at(desk).layers


@needs_root
@pytest.mark.parametrize("name", [".", "nodes", "nodes/camera.py"])
def test_files_of_another_user_are_not_used_but_by_root_for_whom_sudo_came(desk, monkeypatch, name):
    os.chown(desk / name, NOBODY, -1)
    assert f"belongs to {pwd.getpwuid(NOBODY).pw_name}" in Workspace.at(desk).left_out[0]
    monkeypatch.setenv("SUDO_UID", str(NOBODY))
    assert Workspace.at(desk).layers == (desk, ROOT)


@needs_root
def test_a_group_of_one_user_counts_as_this_user_and_a_group_with_others_does_not(desk):
    desk.chmod(0o775)
    os.chown(desk, -1, 54321)  # nobody is in it
    assert Workspace.at(desk).layers == (desk, ROOT)
    shared = next(user for user in pwd.getpwall() if user.pw_gid and user.pw_uid)
    os.chown(desk, -1, shared.pw_gid)
    assert f"can be written by {shared.pw_name}" in Workspace.at(desk).left_out[0]
