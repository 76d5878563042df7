"""Crops, and the arms of a real person."""

import cv2
import numpy as np
import pytest

from paramove.documents import InputError
from paramove.observation.pose_network import FIRST_PASSES, Crop, PoseNetwork
from tests.observation.pictures import network, seated_person

SHOULDER, ELBOW, WRIST, HAND = (224, 71), (178, 105), (132, 138), (120, 153)
"""Where frame 7 shows them, px."""


def test_the_whole_picture_is_in_its_crop():
    crop = Crop.whole(np.zeros((480, 640, 3), np.uint8))
    np.testing.assert_allclose(crop.placed([[-0.5, -0.5], [255.5, 255.5]], 256), [[-0.5, -80.5], [639.5, 559.5]])


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.0])
def test_a_turned_crop_shows_the_part_that_it_says(angle):
    image = np.zeros((200, 300, 3), np.uint8)
    cv2.circle(image, (180, 90), 4, (255, 255, 255), -1)
    crop = Crop(np.array([170.0, 100.0]), 64.0, angle)
    shown = crop.cut(image, 128)[0, 0]
    y, x = (np.indices(shown.shape) * shown).sum(axis=(1, 2)) / shown.sum()
    np.testing.assert_allclose(crop.placed([[x, y]], 128), [[180, 90]], rtol=0.0, atol=0.5)


def test_the_arm_of_a_real_person_is_detected():
    found = network().detect(seated_person(7))
    assert found.has_person
    np.testing.assert_allclose(found.positions[0], [SHOULDER, ELBOW, WRIST, HAND], rtol=0.0, atol=12.0)
    assert found.positions[1, 0, 0] > found.positions[0, 0, 0] + 50, "the left shoulder is to the right"
    assert (found.deviations > 0.5).all()
    assert (found.deviations < 10.0).all()


def test_the_same_picture_again_is_detected_alike():
    detector, image = network(), seated_person(7)
    first, second = detector.detect(image), detector.detect(image)
    apart = np.linalg.norm(first.positions[0] - second.positions[0], axis=1) / first.deviations[0]
    assert np.median(apart) < 2.0, f"after {FIRST_PASSES} passes the crop still moves"


def test_a_small_person_in_a_large_picture_is_found_within_a_second():
    image = np.full((1080, 1920, 3), 90, np.uint8)
    image[300:780, 900:1540] = seated_person(7)
    detector = network()
    assert any(detector.detect(image).has_person for _ in range(15))
    found = detector.detect(image)
    np.testing.assert_allclose(found.positions[0] - (900, 300), [SHOULDER, ELBOW, WRIST, HAND], rtol=0.0, atol=16.0)
    assert not detector.others


def test_of_two_persons_the_nearer_one_is_followed_and_the_other_noticed():
    person = seated_person(7)
    image = np.full((720, 1280, 3), 90, np.uint8)
    image[60:420, 30:510] = cv2.resize(person, (480, 360), interpolation=cv2.INTER_AREA)
    detector = network()
    for _ in range(20):
        far = detector.detect(image)
    assert not detector.others
    assert far.positions[0, 0, 0] < 400
    image[240:720, 640:] = person
    for _ in range(150):
        near = detector.detect(image)
    assert detector.others
    np.testing.assert_allclose(near.positions[0] - (640, 240), [SHOULDER, ELBOW, WRIST, HAND], rtol=0.0, atol=16.0)


@pytest.mark.parametrize("turns", [pytest.param(1, marks=pytest.mark.long), 2])
def test_a_turned_picture_is_found_by_voting(turns):
    detector = network()
    for frame in range(20, 30):
        found = detector.detect(np.ascontiguousarray(np.rot90(seated_person(frame), turns)))
    assert np.degrees(detector.turn) == pytest.approx((-90 * turns) % 360)
    upright = network()
    for frame in range(20, 30):
        expected = upright.detect(seated_person(frame))
    x, y = expected.positions[0].T
    turned = {0: (x, y), 1: (y, 639 - x), 2: (639 - x, 479 - y), 3: (479 - y, x)}[turns]
    apart = np.linalg.norm(found.positions[0] - np.stack(turned, axis=1), axis=1) / expected.deviations[0]
    assert np.median(apart) < 3.0


def test_a_person_in_portrait_is_detected():
    found = network().detect(np.ascontiguousarray(seated_person(7)[:, 40:400]))
    np.testing.assert_allclose(found.positions[0] + (40, 0), [SHOULDER, ELBOW, WRIST, HAND], rtol=0.0, atol=12.0)


def test_nobody_is_nobody_and_found_when_coming_back():
    detector, empty = network(), np.full((480, 640, 3), 90, np.uint8)
    assert detector.detect(seated_person(7)).has_person
    for _ in range(3):
        last = detector.detect(empty)
    assert not last.has_person
    assert detector.detect(seated_person(8)).has_person


def test_a_file_that_is_no_network_is_an_error(tmp_path):
    (tmp_path / "a.tflite").write_bytes(b"not a network")
    with pytest.raises(InputError, match=r"a\.tflite"):
        PoseNetwork(tmp_path / "a.tflite", tmp_path / "a.tflite")
