"""`python -m studies real-images`: what it prints, and its exit codes."""

import json

import pytest
from typer.testing import CliRunner

import paramove.observation
from studies.__main__ import app
from studies.real_images import experiment, replay, scores
from studies.real_images.replay import ReplayedEstimate
from studies.real_images.seated_person import camera
from tests.studies.real_images.synthetic_recording import key_points, true_poses, write_recording


def run(*arguments):
    return CliRunner().invoke(app, ["real-images", *arguments], env={"COLUMNS": "200"})


@pytest.fixture
def data(tmp_path):
    (tmp_path / "data" / "rgbd_pointing").mkdir(parents=True)
    return tmp_path / "data"


def test_missing_recordings_end_with_66(tmp_path):
    answer = run("--data", str(tmp_path / "nowhere"))
    assert answer.exit_code == 66
    assert "no folder with recordings" in answer.stderr
    (tmp_path / "data").mkdir()
    answer = run("--data", str(tmp_path / "data"))
    assert answer.exit_code == 66
    assert "rgbd_pointing" in answer.stderr


def test_a_missing_part_is_named(data):
    answer = run("--data", str(data))
    assert answer.exit_code == 66
    assert "cam_params_realsense.json" in answer.stderr


def test_a_missing_network_ends_with_66(data, monkeypatch, tmp_path):
    write_recording(data / "rgbd_pointing")
    monkeypatch.setattr(paramove.observation.network_files, "default_folder", lambda: tmp_path)
    answer = run("--data", str(data))
    assert answer.exit_code == 66
    assert "paramove webcam setup" in answer.stderr


@pytest.mark.parametrize(("off_m", "exit_code"), [(0.0, 0), (0.5, 3)])
def test_the_verdict_is_the_exit_code(data, tmp_path, monkeypatch, off_m, exit_code):
    folder = data / "rgbd_pointing"
    write_recording(folder)
    true = true_poses(camera(folder))
    poses = true.copy()
    poses[:, [2, 5, 8]] += off_m

    def replayed(folder, key_points, **options):
        return [
            ReplayedEstimate(number, pose, pose[:2][None], 0.5, pose[:2], False) for number, pose in enumerate(poses)
        ]

    monkeypatch.setattr(experiment, "replayed", replayed)
    monkeypatch.setattr(paramove.observation.network_files, "stored_network", lambda: None)
    monkeypatch.setattr(replay, "detected_key_points", lambda folder, network: key_points(camera(folder), true))
    for name in ("frames 32-50", "frames 43-49"):
        monkeypatch.setitem(scores.RANGES, name, (6, 9))
    answer = run("--data", str(data), "--out", str(tmp_path / "out"), "--json", str(tmp_path / "numbers.json"))
    assert answer.exit_code == exit_code, answer.output
    numbers = json.loads((tmp_path / "numbers.json").read_text(encoding="utf-8"))
    assert numbers["met"] == (exit_code == 0)
    assert numbers == json.loads((tmp_path / "out" / "real_images.json").read_text(encoding="utf-8"))
    assert f"goal 6 {'met' if numbers['met'] else 'missed'}" in answer.output
    assert (tmp_path / "out" / "report.html").is_file()
