import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.objects.homography import HomographyError, PlaneHomography
from tests.objects.scene import WORKING_AREA, Look, Scene

CORNERS = np.array(WORKING_AREA)
ROLL = np.array([(np.cos(0.5), np.sin(0.5)), (-np.sin(0.5), np.cos(0.5))])
SEEN = np.array([(120.0, 130.0), (90.0, 190.0), (330.0, 230.0), (320.0, 160.0)])


def _grid() -> np.ndarray:
    return np.array([(x, y) for x in np.linspace(0.12, 0.19, 5) for y in np.linspace(-0.12, 0.08, 9)])


def _residuals(homography: PlaneHomography) -> np.ndarray:
    """Distance of each correspondence to its mapped image point, m, [M]."""
    assert homography.correspondences is not None
    mapped = np.array([homography.plane_from_image(u, v) for u, v, _, _ in homography.correspondences])
    return np.linalg.norm(mapped - homography.correspondences[:, 2:], axis=1)


@settings(deadline=None, max_examples=60, derandomize=True)
@given(st.lists(st.floats(-12, 12), min_size=8, max_size=8), st.floats(0.12, 0.19), st.floats(-0.12, 0.08))
def test_round_trip_for_any_four_seen_corners(shifts: list[float], x: float, y: float) -> None:
    homography = PlaneHomography.fit(SEEN + np.reshape(shifts, (4, 2)), CORNERS)
    assert_allclose(homography.plane_from_image(*homography.image_from_plane(x, y)), (x, y), rtol=0, atol=1e-9)
    assert_allclose(_residuals(homography), 0, rtol=0, atol=1e-9)


def test_agrees_with_opencv_on_noisy_overdetermined_points() -> None:
    draw = np.random.default_rng(3)
    exact = PlaneHomography.fit(SEEN, CORNERS)
    plane = _grid()
    image = np.array([exact.image_from_plane(*p) for p in plane]) + draw.normal(0, 0.3, (len(plane), 2))
    fitted = PlaneHomography.fit(image, plane)
    reference, _ = cv2.findHomography(image, plane)
    theirs = cv2.perspectiveTransform(image[None], reference)[0]
    ours = np.array([fitted.plane_from_image(*p) for p in image])
    assert_allclose(ours, theirs, rtol=0, atol=3e-4)
    assert np.median(_residuals(fitted)) < 1e-3


@pytest.mark.parametrize("k1", [-0.1, 0.1])
@pytest.mark.parametrize("focal_px", [500.0, 620.0])
def test_lens_distortion_costs_less_than_a_millimetre(k1: float, focal_px: float) -> None:
    scene = Scene(Look(k1=k1, focal_scale=focal_px / 560.0))
    scene.close()
    image = np.array([scene.project(np.array([x, y, 0.025])) for x, y in CORNERS])
    homography = PlaneHomography.fit(image, CORNERS)
    mapped = np.array([homography.plane_from_image(*scene.project(np.array([x, y, 0.025]))) for x, y in _grid()])
    assert np.linalg.norm(mapped - _grid(), axis=1).max() < 0.001


@pytest.mark.parametrize("elevation_deg", [35.0, 52.0, 65.0])
def test_a_circle_is_foreshortened_by_the_sine_of_the_elevation(elevation_deg: float) -> None:
    away, across, elevation = 0.6, np.array([(-0.05, 0.05), (0.05, 0.05), (0.05, -0.05), (-0.05, -0.05)]), elevation_deg
    sine, cosine = np.sin(np.deg2rad(elevation)), np.cos(np.deg2rad(elevation))
    depth = away + across[:, 1] * cosine
    image = 560 * np.column_stack([across[:, 0], -across[:, 1] * sine]) / depth[:, None] + (240, 180)
    homography = PlaneHomography.fit(image, across)
    assert homography.foreshortening(240, 180) == pytest.approx(sine, rel=0.002)
    rolled = PlaneHomography.fit((image - (240, 180)) @ ROLL + (240, 180), across)
    assert rolled.foreshortening(240, 180) > 1.01 * sine


@pytest.mark.parametrize("roll_deg", [-20.0, 0.0, 30.0])
def test_what_lies_below_the_plane_is_farther_away(roll_deg: float) -> None:
    scene = Scene(Look(camera_turn_deg=(0.0, 0.0, roll_deg)))
    scene.close()
    homography = PlaneHomography.fit([scene.project(np.array([x, y, 0.025])) for x, y in CORNERS], CORNERS)
    for x, y in _grid():
        for depth in (-0.010, 0.015):
            u, v = scene.project(np.array([x, y, 0.025 - depth]))
            assert np.hypot(*(np.array(homography.below_plane(u, v, depth)) - (x, y))) < 0.0015


@pytest.mark.parametrize(
    ("image", "plane", "words"),
    [
        (SEEN[:3], CORNERS[:3], "at least 4"),
        (SEEN[:3], CORNERS, "equal numbers"),
        (np.array([(0, 0), (10, 10), (20, 20), (0, 30)]), CORNERS, "collinear"),
        (SEEN, np.array([(0, 0), (0.1, 0), (0.2, 0), (0.3, 0)]), "collinear"),
        (SEEN, np.array([(0, 0), (0, 0), (0.1, 0.1), (0, 0.1)]), "collinear or coincide"),
        (SEEN[[0, 3, 2, 1]], CORNERS, "mirrored"),
        (SEEN[[1, 0, 2, 3]], CORNERS, "mixed up"),
        (np.where(SEEN == 120.0, np.nan, SEEN), CORNERS, "finite"),
    ],
)
def test_refuses_what_gives_no_homography(image: np.ndarray, plane: np.ndarray, words: str) -> None:
    with pytest.raises(HomographyError, match=words):
        PlaneHomography.fit(image, plane)


def test_message_round_trip() -> None:
    homography = PlaneHomography.fit(SEEN, CORNERS, -0.08, "arm_base", "yellow")
    message = PlaneCalibration.FromString(homography.to_message(captured_ns=5_000_000_000).SerializeToString())
    back = PlaneHomography.from_message(message)
    assert_allclose(back.plane_from_image_matrix, homography.plane_from_image_matrix, rtol=1e-12, atol=0)
    assert message.captured.seconds == 5
    assert (back.plane_z, back.plane_frame, back.object_name) == (-0.08, "arm_base", "yellow")
    assert back.correspondences is not None
    assert_allclose(back.correspondences[:, 2:], CORNERS, rtol=1e-12, atol=0)


@pytest.mark.parametrize("numbers", [[], [1.0] * 8, [float("nan")] * 9, [1.0] * 9])
def test_refuses_a_message_without_a_matrix(numbers: list[float]) -> None:
    with pytest.raises(HomographyError, match=r"nine finite|singular"):
        PlaneHomography.from_message(PlaneCalibration(plane_from_image=numbers))
