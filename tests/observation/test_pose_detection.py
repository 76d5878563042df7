"""The networks of several cameras, and what is reported of the pictures."""

import numpy as np
import pytest

from paramove.observation import BodyKeyPoints, pose_detection
from paramove.observation.pose_detection import REPORTED_IMAGES, WATCHED_IMAGES, PoseDetection
from tests.observation.pictures import network, seated_person

EMPTY = np.full((240, 320, 3), 90, np.uint8)


class ScriptedNetwork:
    """Detects what a test sets."""

    def __init__(self):
        self.others = False
        self.hands = np.array([[140.0, 150.0], [200.0, 150.0]])
        self.nobody = False

    def detect(self, image):
        if self.nobody:
            return BodyKeyPoints.nobody()
        shoulders = np.array([[140.0, 60.0], [200.0, 60.0]])
        arms = shoulders[:, None] + np.linspace(0.0, 1.0, 4)[None, :, None] * (self.hands - shoulders)[:, None]
        return BodyKeyPoints(arms, np.ones((2, 4)), np.zeros((2, 4)), np.ones((2, 4)), 1.0)


@pytest.fixture
def scripted(monkeypatch):
    found = ScriptedNetwork()
    monkeypatch.setattr(pose_detection, "stored_network", lambda folder, offline: found)
    return found


def detect(detection, times=REPORTED_IMAGES):
    for _ in range(times):
        detection.detect("camera_1", EMPTY)
    return detection.trouble


def test_without_the_network_nothing_is_detected_and_the_command_named(tmp_path):
    detection = PoseDetection(tmp_path)
    assert "paramove webcam setup" in detection.trouble
    assert detection.detect("camera_1", EMPTY) is None


def test_a_damaged_network_is_reported(tmp_path):
    for name in ("pose_landmark_full.tflite", "hand_landmark_full.tflite"):
        (tmp_path / name).write_bytes(b"half of it")
    assert "damaged" in PoseDetection(tmp_path).trouble


def test_nobody_in_view_is_reported_until_somebody_is(scripted):
    detection = PoseDetection()
    scripted.nobody = True
    assert detect(detection, REPORTED_IMAGES - 1) == ""
    assert "camera_1: nobody" in detect(detection, 1)
    scripted.nobody = False
    assert detect(detection, 1) == ""


def test_an_arm_that_leaves_the_picture_is_reported(scripted):
    detection = PoseDetection()
    scripted.hands[0] = (-20.0, 150.0)
    assert "leaves the picture" in detect(detection)
    scripted.hands[0] = (20.0, 150.0)
    assert detect(detection, 1) == ""


def test_another_person_is_reported(scripted):
    scripted.others = True
    assert "another person" in detect(PoseDetection(), 1)


@pytest.mark.parametrize(("side", "reported"), [(0, False), (1, True)])
def test_the_wrong_arm_is_reported(scripted, side, reported):
    detection = PoseDetection()
    for number in range(WATCHED_IMAGES):
        scripted.hands[side, 1] = 150.0 - 2.0 * number
        detect(detection, 1)
    assert ("left arm moves" in detection.trouble) == reported


def test_a_real_picture_has_no_trouble():
    network()
    detection = PoseDetection()
    detection.detect("camera_1", seated_person(7))
    assert detection.trouble == ""
