"""A drawn arm is followed through camera, messages and tracker."""

import cv2
import numpy as np
import pytest

from paramove.documents.input_error import InputError
from studies.real_images import replay
from studies.real_images.experiment import (
    JUDGED,
    NETWORK,
    OUTLINE,
    SIDES_EXCHANGED,
    exchanged,
    mean_of,
    numbers_of,
    recording_folder,
    run_all,
)
from studies.real_images.report import write_report
from studies.real_images.scores import read_reference
from studies.real_images.seated_person import camera
from tests.observation.pictures import network
from tests.studies.real_images.synthetic_recording import key_points, true_poses, write_recording

CASES = (JUDGED, OUTLINE, SIDES_EXCHANGED)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recording")
    write_recording(folder)
    return folder


@pytest.fixture(scope="module")
def points(recording):
    return key_points(camera(recording), true_poses(camera(recording)))


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    return tmp_path_factory.mktemp("models")


@pytest.fixture(scope="module")
def reference(recording, points):
    return read_reference(recording, camera(recording), points)


@pytest.fixture(scope="module")
def replays(recording, points, reference, models):
    return run_all(recording, points, reference, (0,), CASES, models=models)


def test_the_hand_is_followed(replays):
    both, outline, swapped = (replay.distances for replay in replays)
    assert both.frames.tolist() == outline.frames.tolist() == list(range(25))
    assert np.median(both.pixels) < 3.0
    assert np.median(swapped.pixels) < 4.0
    assert np.median(outline.pixels) < 15.0
    assert np.median(both.hand) < 0.1
    assert np.isfinite(both.from_shoulder).all()


def test_about_a_quarter_is_exchanged(points):
    swapped = [a is not b for a, b in zip(exchanged(points * 8, 0.25, 1), points * 8, strict=True)]
    assert 0.15 < np.mean(swapped) < 0.35


def test_what_is_said_comes_with_every_frame(replays):
    for one in replays[1].estimates:
        assert one.pose.shape == (9,)
        assert len(one.outline) > 50
        assert 0.0 <= one.progress <= 1.0
    assert replays[0].estimates[-1].direction[0] == pytest.approx(0.8, abs=0.15)


def test_tracking_needs_no_reference(recording, points, models, replays, tmp_path):
    for name in ("color", "cam_params_realsense.json"):
        (tmp_path / name).symlink_to(recording / name)
    estimates = replay.replayed(tmp_path, points, models=models)
    np.testing.assert_array_equal([one.pose for one in estimates], [one.pose for one in replays[0].estimates])


def test_the_page_shows_no_picture(replays, points, reference, recording, tmp_path):
    numbers = numbers_of(replays, points, reference, camera(recording))
    text = write_report(replays, numbers, reference, camera(recording), tmp_path).read_text(encoding="utf-8")
    assert text.count("<svg") == 2
    assert [word for word in ("<img", "<image", "data:image", "base64", "jpg", "<script") if word in text] == []


def test_too_few_frames_miss_the_goal(replays, points, reference, recording):
    numbers = numbers_of(replays, points, reference, camera(recording))
    assert not numbers["met"], "frames 32-50 were never tracked"
    assert mean_of(numbers["cases"][JUDGED.name], "frames 32-50", "median_px") is None
    assert mean_of(numbers["cases"][JUDGED.name], "frames 32-50", "lost_frames") == 19
    assert mean_of(numbers["cases"][NETWORK], "frames 6-9", "median_px") == 0.0


def test_missing_pictures_are_told(tmp_path, recording, models):
    (tmp_path / "cam_params_realsense.json").write_text((recording / "cam_params_realsense.json").read_text())
    with pytest.raises(InputError, match="folder of pictures") as caught:
        replay.replayed(tmp_path, models=models)
    assert caught.value.missing


def test_a_dark_picture_is_told(tmp_path, recording, models):
    (tmp_path / "cam_params_realsense.json").write_text((recording / "cam_params_realsense.json").read_text())
    (tmp_path / "color").mkdir()
    cv2.imwrite(str(tmp_path / "color" / "00000.jpg"), np.zeros((480, 640, 3), np.uint8))
    with pytest.raises(InputError, match="too dark"):
        replay.replayed(tmp_path, models=models)


@pytest.mark.long
def test_the_real_recording_keeps_the_goals():
    """One seed of the five that the goals are means of: 3 cm and 1.5 degrees more."""
    try:
        folder = recording_folder(None)
    except InputError as error:
        pytest.skip(str(error))
    detected = replay.detected_key_points(folder, network())
    true = read_reference(folder, camera(folder), detected)
    numbers = numbers_of(
        run_all(folder, detected, true, (0,), (JUDGED, SIDES_EXCHANGED)), detected, true, camera(folder)
    )
    slack = {"hand_cm": 3.0, "from_shoulder_cm": 3.0, "direction_deg": 1.5, "median_px": 1.0}
    missed = [one for one in numbers["goals"] if one["mean"] > one["goal"] + slack.get(one["number"], 0.0)]
    assert missed == []
    resting = numbers["cases"]["hand left on the knee"]
    assert min(mean_of(resting, rows, "median_px") for rows in ("frames 6-9", "frames 32-50")) > 50.0
