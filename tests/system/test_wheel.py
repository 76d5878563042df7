"""The wheel by itself, in an empty folder: it carries the workspace, and its core needs nothing of the extras."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from paramove.cli.main import EXTRAS
from paramove.workspace import PARTS, Workspace

ROOT = Path(__file__).parents[2]
# Says of the extras' modules that they are not installed, which takes the place of an environment without them.
CORE_ONLY = f"""
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {[*EXTRAS, "ezc3d"]!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Absent())
from paramove.cli.main import main
sys.argv[0] = "paramove"
main()
"""


@pytest.fixture
def core(tmp_path):
    """The command without the extras, with the kernels that the clone has compiled."""

    def run(words):
        command = [sys.executable, "-c", CORE_ONLY, *words.split()]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)

    return run


def test_every_file_of_the_workspace_travels_in_it(installed):
    carried = Workspace(installed, (installed / "paramove" / "workspace",)).files()
    tracked = subprocess.run(["git", "ls-files", *PARTS], cwd=ROOT, capture_output=True, text=True, check=True)
    assert {name for name in tracked.stdout.splitlines() if (ROOT / name).is_file()} <= set(carried)
    packages = ["dynamixel_emulator", "paramove"]
    assert sorted(path.name for path in installed.iterdir() if path.suffix != ".dist-info") == ["bin", *packages]
    for package in packages:
        assert (installed / package / "py.typed").is_file()


@pytest.mark.parametrize("name", Workspace.at(ROOT).names("launch"))
def test_an_application_is_found_from_an_empty_folder(installed, tmp_path, name):
    command = [sys.executable, "-m", "paramove.cli.launch", name, "--check"]
    environment = os.environ | {"PYTHONPATH": str(installed)}
    answer = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stderr
    assert f"workspace {tmp_path}, then {installed / 'paramove' / 'workspace'}" in " ".join(answer.stdout.split())


def test_an_application_of_ones_own_runs_and_its_recording_is_played(installed, tmp_path, short_folder):
    def paramove(folder, *words):
        command = [sys.executable, "-m", "paramove.cli.main", *words]
        environment = os.environ | {"PYTHONPATH": str(installed), "XDG_RUNTIME_DIR": str(short_folder)}
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    paramove(tmp_path, "new", "my_robot")
    folder = tmp_path / "my_robot"
    assert "The cart is at" in paramove(folder, "launch", "my_robot")
    recording = "runs/latest/recording.mcap"
    assert "cart/state" in paramove(folder, "bag", "info", recording)
    played = paramove(folder, "bag", "play", recording, "--topics", "cart/state", "--rate", "100", "--wait", "0")
    number = re.search(r"^played (\d+) messages$", played, re.M)
    assert number is not None
    assert int(number[1]) > 0


def test_the_core_trains_recognises_and_synthesises_without_the_extras(core, tmp_path):
    for words in (
        "demos synthesize set --columns 2 --rows 2 --repetitions 2",
        "train set --states 5 --leave-out none",
        "recognize set --model models/reaching.npz",
        "synthesize models/reaching.npz --theta 0.1,-0.2 --out made.csv --plot made.png",
        "models plot models/reaching.npz",
    ):
        answer = core(words)
        assert answer.returncode == 0, answer.stderr
    assert (tmp_path / "made.png").is_file()


@pytest.mark.parametrize(
    "words",
    ["demo --check", "launch pointing", "evaluate rule_learning", "topic list", "doctor", "calibrate board --out b"],
)
def test_without_the_extra_a_command_names_it(core, words):
    answer = core(words)
    assert answer.returncode == 69
    assert "paramove[robot]" in answer.stderr


def test_the_extras_are_those_that_the_message_names():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert set(EXTRAS.values()) <= set(extras)
