"""`paramove evaluate` as it is typed."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from paramove.cli.evaluate import app
from paramove.robots.description import RobotDescription
from paramove.runs.batch import result_file
from tests.runs.synthetic_run import SyntheticRun

ROOT = Path(__file__).parents[2]


@pytest.fixture
def called(monkeypatch):
    monkeypatch.chdir(ROOT)
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_lists_what_it_can_do(called):
    shown = called("--help").output
    assert "rule_learning" in shown
    assert "homography" in shown


def test_kept_results_are_shown_without_running(called, tmp_path):
    for seed in (0, 1):
        kept = {"seed": seed, "success": seed == 0, "objects_placed": 3, "run_folder": "", "settings": []}
        result_file(tmp_path, seed).write_text(json.dumps(kept))
    found = called("rule_learning", "--seeds", "0-1", "--runs", tmp_path, "--json", tmp_path / "numbers.json")
    assert found.exit_code == 3, found.output
    assert "1/2" in found.output
    assert json.loads((tmp_path / "numbers.json").read_text())["totals"]["succeeded"] == 1


def test_wrong_seeds_are_refused(called):
    found = called("rule_learning", "--seeds", "ten")
    assert found.exit_code == 2
    assert "names no seeds" in found.output


def test_homography_of_a_run(called, tmp_path):
    robot = RobotDescription.load(ROOT / "robot_description" / "hoap3")
    for name, off, code in (("good", (0.0, 0.0), 0), ("bad", (0.01, 0.0), 3)):
        folder = tmp_path / name
        folder.mkdir()
        SyntheticRun(folder, robot, calibration_off=off).write()
        found = called("homography", folder, "--json", tmp_path / "numbers.json")
        assert found.exit_code == code, found.output
        (row,) = json.loads((tmp_path / "numbers.json").read_text())
        assert row["seed"] == 42


def test_homography_needs_a_run(called, tmp_path):
    assert called("homography").exit_code == 2
    assert called("homography", tmp_path).exit_code == 66
