"""`paramove webcam`: the pose network and the person's measures; exit codes."""

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from paramove.action_space import read_person
from paramove.bus import topics
from paramove.cameras import write_cameras
from paramove.cli.webcam import app
from paramove.demonstrations import RESTING_SHOULDER
from paramove.observation import key_points_message
from paramove.recording import RecordingWriter
from studies.teaching.experiment import cameras
from studies.teaching.simulated_person import RATE_HZ, key_points, movement
from tests.observation.pictures import network, seated_person


def test_a_file_that_is_not_the_package_ends_with_66(tmp_path):
    (tmp_path / "a.whl").write_bytes(b"no package")
    answer = CliRunner().invoke(app, ["setup", "--wheel", str(tmp_path / "a.whl")])
    assert answer.exit_code == 66
    assert "a.whl" in answer.stderr


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A person who rests and moves the arm before one camera."""
    folder, rng = tmp_path_factory.mktemp("recording"), np.random.default_rng(2)
    write_cameras(folder / "cameras.yaml", cameras(1))
    poses = np.concatenate([movement(target, rng) for target in ([0.2, 0.2, 0.0], [0.2, -0.5, 0.1])])
    with RecordingWriter(folder / "recording.mcap", "a test") as writer:
        for number, points in enumerate(key_points(poses, cameras(1)[0], rng), start=1):
            at_ns = round(number * 1e9 / RATE_HZ)
            writer.write("camera_1/key_points", key_points_message(points, at_ns), at_ns, at_ns, number)
    assert "camera_1/key_points" in [topic.name for topic in topics.RECORDED]
    return folder


def person(recording, out, *more):
    source = f"recording:{recording / 'recording.mcap'}"
    arguments = ["person", "--out", str(out), "--source", source, "--cameras", str(recording / "cameras.yaml")]
    return CliRunner().invoke(app, [*arguments, *more])


def test_the_measures_are_a_file_that_the_tracker_reads(recording, tmp_path):
    answer = person(recording, tmp_path / "person.yaml", "--distance", "1.76m")
    assert answer.exit_code == 0, answer.output
    assert "move your right arm" in answer.output
    found = read_person(tmp_path / "person.yaml")
    np.testing.assert_allclose(found.shoulder, RESTING_SHOULDER, rtol=0.0, atol=0.12)
    assert 0.2 < found.upper_arm < 0.32


@pytest.mark.parametrize(
    ("more", "code", "message"),
    [
        (("--height", "175"), 78, "a length with its unit"),
        (("--cameras", "nowhere.yaml"), 66, "nowhere.yaml"),
        (("--square", "30mm"), 78, "images"),
        (("--source", "recording:nowhere.mcap"), 66, "nowhere.mcap"),
        (("--distance", "9m"), 1, "ended before"),
    ],
)
def test_what_is_missing_or_wrong_is_named(recording, tmp_path, more, code, message):
    answer = person(recording, tmp_path / "person.yaml", *more)
    assert answer.exit_code == code, answer.output
    assert message in answer.stderr
    assert not (tmp_path / "person.yaml").exists()


def test_a_first_look_needs_no_calibration(tmp_path):
    network()
    for number in range(10):
        (tmp_path / f"{number}.png").write_bytes(cv2.imencode(".png", seated_person(7))[1].tobytes())
    answer = CliRunner().invoke(app, ["look", "--source", f"folder:{tmp_path}@10"])
    assert answer.exit_code == 0, answer.output
    assert "picture's left" in answer.output
    assert "directions only" in answer.output
    answer = CliRunner().invoke(app, ["look", "--source", f"folder:{tmp_path}@10", "--size", "320x240"])
    assert answer.exit_code == 78
    assert "640 x 480" in answer.stderr
