"""`paramove teach webcam` with the key points of a recording."""

import itertools

import numpy as np
import pytest
from typer.testing import CliRunner

from paramove.bus import topics
from paramove.cameras import Board, write_cameras
from paramove.cli.teach import app
from paramove.demonstrations import DemonstrationSet
from paramove.observation import board_targets, key_points_message
from paramove.recording import RecordingWriter
from studies.teaching.experiment import cameras
from studies.teaching.simulated_person import RATE_HZ, key_points, movement


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Two corners touched before two cameras."""
    folder = tmp_path_factory.mktemp("recording")
    write_cameras(folder / "cameras.yaml", cameras(2))
    rng, frame = np.random.default_rng(4), itertools.count(1)
    with RecordingWriter(folder / "recording.mcap", "a test") as writer:
        for target in list(board_targets(Board(0.03).corners()).values())[:2]:
            poses = movement(target, rng)
            tracks = [key_points(poses, camera, rng) for camera in cameras(2)]
            for row in zip(*tracks, strict=True):
                at_ns = round(next(frame) * 1e9 / RATE_HZ)
                for number in (1, 0):
                    message = key_points_message(row[number], at_ns)
                    writer.write(topics.CAMERA_KEY_POINTS[number].name, message, at_ns, at_ns, 1)
    return folder


def teach(recording, folder, *more):
    source = f"recording:{recording / 'recording.mcap'}"
    arguments = ["webcam", str(folder), "--action", "reach", "--square", "30mm", "--source", source]
    return CliRunner().invoke(app, [*arguments, "--cameras", str(recording / "cameras.yaml"), *more])


def test_movements_of_a_recording_become_a_set(recording, tmp_path):
    answer = teach(recording, tmp_path / "set", "--subject", "ann")
    assert answer.exit_code == 1, "seven corners were not touched"
    assert "taught_002.mcap" in answer.output
    assert "3 of 9" in answer.output
    assert len(DemonstrationSet.load(tmp_path / "set")) == 2
    again = teach(recording, tmp_path / "set")
    assert again.exit_code == 78
    assert "--append" in again.stderr


def test_another_board_than_that_of_the_calibration_is_an_error(recording, tmp_path):
    write_cameras(tmp_path / "cameras.yaml", cameras(2), 0.045)
    answer = teach(recording, tmp_path / "set", "--cameras", str(tmp_path / "cameras.yaml"))
    assert answer.exit_code == 78
    assert "45 mm" in answer.stderr
    assert "30 mm" in answer.stderr


@pytest.mark.parametrize(
    ("more", "code", "message"),
    [
        (("--cameras", "nowhere.yaml"), 66, "nowhere.yaml"),
        (("--square", "30"), 78, "30mm"),
        (("--targets", "wall"), 2, "board"),
        (("--person", "nobody.yaml"), 66, "nobody.yaml"),
    ],
)
def test_what_is_missing_or_wrong_is_named(recording, tmp_path, more, code, message):
    answer = teach(recording, tmp_path / "set", *more)
    assert answer.exit_code == code
    assert message in answer.stderr
    assert not (tmp_path / "set").exists()


def test_a_recording_without_key_points_is_reported(recording, tmp_path):
    with RecordingWriter(tmp_path / "recording.mcap", "a test"):
        pass
    (tmp_path / "cameras.yaml").write_bytes((recording / "cameras.yaml").read_bytes())
    answer = teach(tmp_path, tmp_path / "set")
    assert answer.exit_code == 78
    assert "no key points" in answer.stderr
