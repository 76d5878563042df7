"""Simulated cameras instead of the recording: what is measured there is known here."""

import numpy as np
import pytest

from paramove.demonstrations import RecordingsError, data_folder
from paramove.documents import InputError
from studies.multicam.cameras import moved_centre, read_calibration
from studies.multicam.experiment import numbers_of, with_offsets
from studies.teaching.experiment import camera_at
from studies.teaching.simulated_person import key_points, movement

PLACES = ((0.6, -1.8, 0.8), (1.7, -0.9, 0.75), (1.5, 1.0, 1.0))
OFFSET = np.array([9.0, -6.0])


@pytest.fixture(scope="module")
def seen():
    true = [camera_at(f"camera_{number}", np.array(place)) for number, place in enumerate(PLACES)]
    poses, rng = movement(np.array([0.2, 0.0, 0.0]), np.random.default_rng(0)), np.random.default_rng(1)
    tracks = [key_points(poses, camera, rng) for camera in true]
    return [moved_centre(true[0], -OFFSET), *true[1:]], tracks


def test_a_constant_offset_is_estimated(seen):
    _, offsets = with_offsets(*seen)
    relative = offsets[0] - offsets[1:].mean(axis=0)
    assert relative @ OFFSET > 0.3 * OFFSET @ OFFSET, "the points take the rest of it"


@pytest.mark.long
def test_all_numbers(seen):
    numbers = numbers_of(*seen)
    assert numbers["reprojection_px"] < numbers["reprojection_without_offsets_px"]
    assert max(numbers["left_out_px"].values()) < 25.0
    assert numbers["exchanges"]["found"] >= 0.9 * numbers["exchanges"]["exchanged"] > 10
    assert all(value < 6.0 for value in numbers["deviation_of_lengths_cm"].values())


def test_a_missing_or_damaged_calibration_is_an_error(tmp_path):
    with pytest.raises(InputError, match=r"Calib\.qca\.txt") as caught:
        read_calibration(tmp_path)
    assert caught.value.missing
    (tmp_path / "Calib.qca.txt").write_text("<calibration><camera/></calibration>")
    with pytest.raises(InputError, match="Qualisys"):
        read_calibration(tmp_path)


def test_the_recorded_cameras_look_at_one_place():
    try:
        folder = data_folder(None) / "multicam_person"
    except RecordingsError as error:
        pytest.skip(str(error))
    if not folder.is_dir():
        pytest.skip(f"no recording {folder}")
    cameras = read_calibration(folder)
    assert [camera.name for camera in cameras] == ["cam01", "cam02", "cam03", "cam04"]
    middle = cameras[0].project(np.array([0.0, 0.0, 1.0]))
    assert (np.abs(middle - 0.5 * np.array([1088, 1920])) < 500).all()
