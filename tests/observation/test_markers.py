"""The stereo body tracker: markers and colours drawn into the images of two cameras are found in space."""

import cv2
import numpy as np
import pytest

from paramove.cameras.charuco_board import dictionary
from paramove.documents.input_error import InputError
from paramove.objects.colour_tracker import Colour
from paramove.observation.markers import ArucoMarker, BodyTrackerOptions, StereoBodyTracker
from tests.cameras.board_scene import camera, looking

EYES = (
    camera("left", looking((1.1, 0.5, 0.6), (0.2, 0.0, 0.25)), k1=-0.15),
    camera("right", looking((1.15, -0.4, 0.55), (0.2, 0.0, 0.25)), k1=0.05),
)
ARM = {
    "shoulder": (0.0, -0.15, 0.40),
    "elbow": (0.10, -0.25, 0.15),
    "wrist": (0.3, -0.05, 0.1),
    "index": (0.4, 0.08, 0.15),
}
NUMBERS = {"shoulder": 90, "elbow": 91, "wrist": 92, "index": 93}
HUES = {
    "shoulder": (0, (355.0, 10.0)),
    "elbow": (55, (42.0, 75.0)),
    "wrist": (120, (90.0, 165.0)),
    "index": (230, (195.0, 262.0)),
}
SIDE = 0.045
TOWARDS = np.array([0.9, 0.05, 0.3]) / np.linalg.norm([0.9, 0.05, 0.3])
"""Normal of all markers: between the cameras."""


def noisy(image, seed=0):
    noise = np.random.default_rng(seed).normal(0, 3, image.shape)
    return np.clip(np.round(image + noise), 0, 255).astype(np.uint8)


def wall(eye):
    return np.full((eye.height_px, eye.width_px, 3), 150.0)


def with_markers(eye, places=ARM, seed=0):
    """Markers on white patches, facing the cameras, anti-aliased."""
    right = np.cross([0.0, 0.0, 1.0], TOWARDS)
    right /= np.linalg.norm(right)
    up = np.cross(TOWARDS, right)
    fine, image = 4, wall(eye)
    large = cv2.resize(image, None, fx=fine, fy=fine)
    for name, place in places.items():
        patch = np.full((10, 10), 255, np.uint8)
        patch[2:8, 2:8] = cv2.aruco.generateImageMarker(dictionary(), NUMBERS[name], 6)
        patch = cv2.resize(patch, (200, 200), interpolation=cv2.INTER_NEAREST)
        half = 0.5 * SIDE * 10 / 6
        corners = [np.array(place) + half * (a * right + b * up) for a, b in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
        pixels = ((eye.project(corners) + 0.5) * fine - 0.5).astype(np.float32)
        edges = np.array([[-0.5, -0.5], [199.5, -0.5], [199.5, 199.5], [-0.5, 199.5]], np.float32)
        warp = cv2.getPerspectiveTransform(edges, pixels)
        size = (large.shape[1], large.shape[0])
        drawn = cv2.warpPerspective(patch, warp, size, flags=cv2.INTER_NEAREST)
        covered = cv2.warpPerspective(np.ones_like(patch), warp, size, flags=cv2.INTER_NEAREST) > 0
        large[covered] = drawn[covered][:, None]
    return noisy(cv2.resize(large, (eye.width_px, eye.height_px), interpolation=cv2.INTER_AREA), seed)


def with_colours(eye, places=ARM, seed=0):
    """Balls of 4 cm."""
    fine, image = 4, wall(eye)
    large = cv2.resize(image, None, fx=fine, fy=fine)
    for name, place in places.items():
        hsv = np.uint8([[[HUES[name][0] // 2, 220, 200]]])
        bgr = tuple(int(value) for value in cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0, 0])
        depth = (eye.camera_from_world @ [*place, 1.0])[2]
        centre = (eye.project(place) + 0.5) * fine - 0.5
        shifted = tuple(round(float(value) * 16) for value in centre)
        cv2.circle(large, shifted, round(eye.matrix[0, 0] * 0.02 / depth * fine * 16), bgr, -1, cv2.LINE_8, 4)
    return noisy(cv2.resize(large, (eye.width_px, eye.height_px), interpolation=cv2.INTER_AREA), seed)


COLOURED = BodyTrackerOptions(markers={name: Colour(name, hues) for name, (_, hues) in HUES.items()})


def places_of(pose):
    return {point.name: np.array([point.x, point.y, point.z]) for point in pose.points}


@pytest.mark.parametrize(
    ("options", "drawn", "tolerance"),
    [(None, with_markers, 0.003), (COLOURED, with_colours, 0.004)],
    ids=["aruco", "colour"],
)
def test_an_arm_is_found(options, drawn, tolerance):
    tracker = StereoBodyTracker(EYES, options)
    pose = tracker.update([drawn(eye, seed=number) for number, eye in enumerate(EYES)], captured_ns=1_500_000_000)
    assert (pose.frame, pose.captured.ToNanoseconds()) == ("table", 1_500_000_000)
    assert [point.name for point in pose.points] == list(ARM)
    for name, place in places_of(pose).items():
        np.testing.assert_allclose(place, ARM[name], rtol=0, atol=tolerance, err_msg=name)


def test_the_joint_lies_below_the_marker():
    inset = BodyTrackerOptions(markers={"elbow": ArucoMarker(91, inset=0.04)})
    found = StereoBodyTracker(EYES, inset).located([with_markers(eye) for eye in EYES])
    np.testing.assert_allclose(found["elbow"].position, np.array(ARM["elbow"]) - 0.04 * TOWARDS, rtol=0, atol=0.006)
    assert 0.0001 < found["elbow"].deviation < 0.003
    assert found["elbow"].residual_px < 1.0


def test_points_of_one_view_are_left_out():
    tracker = StereoBodyTracker(EYES)
    both = {name: ARM[name] for name in ("elbow", "wrist")}
    pose = tracker.update([with_markers(EYES[0]), with_markers(EYES[1], both)])
    assert list(places_of(pose)) == ["elbow", "wrist"]
    assert not tracker.update([with_markers(EYES[0]), None]).points
    assert not tracker.update([None, None]).points


@pytest.mark.parametrize(
    ("options", "drawn"), [(None, with_markers), (COLOURED, with_colours)], ids=["aruco", "colour"]
)
def test_views_that_disagree_are_left_out(options, drawn):
    """The wrist's marker is 6 cm higher in one view, as if another thing had its colour, or images were out of time."""
    moved = ARM | {"wrist": (0.3, -0.05, 0.16)}
    pose = StereoBodyTracker(EYES, options).update([drawn(EYES[0]), drawn(EYES[1], moved)])
    assert list(places_of(pose)) == ["shoulder", "elbow", "index"]


def test_what_is_refused():
    tracker = StereoBodyTracker(EYES)
    image = with_markers(EYES[0])
    with pytest.raises(InputError, match="each of 2 cameras, found 1"):
        tracker.update([image])
    with pytest.raises(InputError, match="right gives 320 x 240 px, calibrated are 640 x 480 px"):
        tracker.update([image, image[::2, ::2]])
    with pytest.raises(InputError, match="a number or colour of its own for each point"):
        StereoBodyTracker(EYES, BodyTrackerOptions(markers={"elbow": ArucoMarker(91), "wrist": ArucoMarker(91)}))
    with pytest.raises(InputError, match="at least one marker"):
        StereoBodyTracker(EYES, BodyTrackerOptions(markers={}))
    with pytest.raises(InputError, match="60 to 99, found 12"):
        ArucoMarker(12)
