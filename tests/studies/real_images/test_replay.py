"""A drawn arm is followed through camera, messages and tracker."""

import cv2
import numpy as np
import pytest

from paramove.documents.input_error import InputError
from studies.real_images import replay
from studies.real_images.experiment import (
    JUDGED,
    Case,
    numbers_of,
    recording_folder,
    resting_numbers,
    run_all,
)
from studies.real_images.report import write_report
from studies.real_images.scores import GOAL_PX, RANGES, read_reference
from studies.real_images.seated_person import camera
from tests.studies.real_images.synthetic_recording import write_recording


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recording")
    write_recording(folder)
    return folder


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    return tmp_path_factory.mktemp("models")


@pytest.fixture(scope="module")
def replays(recording, models):
    return run_all(recording, (0,), (JUDGED,), models=models)


def test_the_hand_is_followed(replays):
    found = replays[0].distances
    assert found.frames.tolist() == list(range(25))
    assert np.median(found.middle) < 0.5 * GOAL_PX
    assert np.median(found.middle) < np.median(found.tip), "the reference is the hand's middle"


def test_what_is_said_comes_with_every_frame(replays):
    for one in replays[0].estimates:
        assert one.pose.shape == (9,)
        assert len(one.outline) > 50
        assert 0.0 <= one.progress <= 1.0
    assert replays[0].estimates[-1].direction[0] == pytest.approx(0.8, abs=0.15)


def test_tracking_needs_no_reference(recording, models, replays, tmp_path):
    for name in ("color", "cam_params_realsense.json"):
        (tmp_path / name).symlink_to(recording / name)
    estimates = replay.replayed(tmp_path, models=models)
    np.testing.assert_array_equal([one.pose for one in estimates], [one.pose for one in replays[0].estimates])


def test_the_page_shows_no_picture(replays, recording, tmp_path):
    numbers = numbers_of(replays) | {"hand left on the knee": resting_numbers(recording)}
    page = write_report(replays, numbers, read_reference(recording), camera(recording), tmp_path)
    text = page.read_text(encoding="utf-8")
    assert text.count("<svg") == 2
    assert [word for word in ("<img", "<image", "data:image", "base64", "jpg", "<script") if word in text] == []


def test_too_few_frames_miss_the_goal(replays):
    numbers = numbers_of(replays)
    assert not numbers["met"], "frames 32-50 were never tracked"
    run = numbers["cases"][JUDGED.name]["runs"][0]
    assert run["frames 32-50"]["median_px"] is None
    assert run["frames 32-50"]["far_frames"] == 19
    assert run["frames 6-9"]["frames"] == 4


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


def test_the_real_recording_keeps_the_goal():
    try:
        folder = recording_folder(None)
    except InputError as error:
        pytest.skip(str(error))
    found = run_all(folder, (0,), (Case(JUDGED.name),))[0].distances.numbers()
    medians = [found[name]["median_px"] for name in RANGES]
    resting = resting_numbers(folder)
    assert max(medians) <= GOAL_PX
    assert min(resting[name]["median_px"] for name in RANGES) > 2.0 * GOAL_PX, "a hand left on the knee passes too"
