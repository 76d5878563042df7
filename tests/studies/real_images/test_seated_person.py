"""Camera, person and knee as set on the first frame."""

import json

import numpy as np
import pytest

from paramove.documents.input_error import InputError
from studies.real_images import seated_person
from tests.studies.real_images.synthetic_recording import write_lens


def test_the_lens_is_stored_column_by_column(tmp_path):
    matrix = write_lens(tmp_path).matrix
    np.testing.assert_allclose(matrix, [[600, 0, 320], [0, 600, 240], [0, 0, 1]], rtol=0.0, atol=0.0)


def test_a_place_is_seen_where_it_came_from(tmp_path):
    camera = write_lens(tmp_path)
    place = seated_person.in_world(seated_person.SHOULDER_PX, seated_person.SHOULDER_DEPTH, camera)
    np.testing.assert_allclose(camera.project(place), seated_person.SHOULDER_PX, rtol=0.0, atol=1e-9)


def test_the_floor_is_below_and_the_camera_where_it_stands(tmp_path):
    camera = write_lens(tmp_path)
    np.testing.assert_allclose(camera.position, [0.0, 0.0, seated_person.CAMERA_HEIGHT], rtol=0.0, atol=1e-9)
    shoulder, _, hand = seated_person.resting_pose(camera).reshape(3, 3)
    assert 0.7 < shoulder[2] < 1.1
    assert 0.3 < shoulder[2] - hand[2] < 0.5
    assert hand[0] - shoulder[0] > 0.3, "the hand on the knee is before the shoulder"


def test_the_resting_arm_has_its_lengths(tmp_path):
    shoulder, elbow, hand = seated_person.resting_pose(write_lens(tmp_path)).reshape(3, 3)
    assert np.linalg.norm(elbow - shoulder) == pytest.approx(seated_person.SIZES.upper_arm, abs=1e-9)
    assert np.linalg.norm(hand - elbow) == pytest.approx(seated_person.SIZES.lower_arm, abs=1e-9)


def test_a_missing_lens_is_told(tmp_path):
    with pytest.raises(InputError, match=seated_person.INTRINSICS) as caught:
        seated_person.camera(tmp_path)
    assert caught.value.missing


@pytest.mark.parametrize("content", ["[]", "{", json.dumps({"width": 640, "height": 480, "intrinsic_matrix": [1, 2]})])
def test_a_lens_of_another_form_is_told(tmp_path, content):
    (tmp_path / seated_person.INTRINSICS).write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match="intrinsic_matrix expected") as caught:
        seated_person.camera(tmp_path)
    assert not caught.value.missing
