"""Sizes and turn of cylinders and blocks, standing or lying, from the outline of their perspective image."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.objects.homography import PlaneHomography
from paramove.objects.object_shape import ObjectShape, object_shape
from tests.objects.scene import WORKING_AREA, Look, Scene

ROUND = np.deg2rad(np.arange(0, 360, 5))
PLACES = [(0.12, -0.10), (0.155, -0.02), (0.18, 0.07)]


@pytest.fixture(scope="module")
def view() -> tuple[Scene, PlaneHomography]:
    scene = Scene(Look.random(3))
    scene.close()
    image = [scene.project(np.array([x, y, 0.025])) for x, y in WORKING_AREA]
    return scene, PlaneHomography.fit(image, WORKING_AREA)


def outline(scene: Scene, foot: np.ndarray, height: float) -> np.ndarray:
    """Convex hull of the image of a prism on this foot [N, 2]."""
    return hull_of(scene, np.concatenate([np.column_stack([foot, np.full(len(foot), z)]) for z in (0.0, height)]))


def hull_of(scene: Scene, corners: np.ndarray) -> np.ndarray:
    """Convex hull of the image of points [N, 3], as the tracker gives it: without half a pixel."""
    points = np.array([scene.project(point) for point in corners], dtype=np.float32)
    hull = cv2.convexHull(points).reshape(-1, 2).astype(np.float64)
    middle = hull.mean(axis=0)
    away = hull - middle
    return np.asarray(hull - 0.35 * away / np.linalg.norm(away, axis=1, keepdims=True))


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(("width", "height"), [(0.020, 0.020), (0.028, 0.028), (0.022, 0.050), (0.045, 0.030)])
@pytest.mark.parametrize("turn_deg", [None, 0.0, 12.0, 45.0, 81.0])
def test_it_is_that_of_the_prism(
    view: tuple[Scene, PlaneHomography],
    place: tuple[float, float],
    width: float,
    height: float,
    turn_deg: float | None,
) -> None:
    angles = ROUND if turn_deg is None else np.deg2rad(turn_deg + np.array([45, 135, 225, 315]))
    radius = width / 2 * (1.0 if turn_deg is None else np.sqrt(2))
    foot = np.array(place) + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    shape = object_shape(outline(view[0], foot, height), view[1])
    assert shape is not None
    assert (shape.turn is None) == (turn_deg is None)
    assert not shape.length
    assert abs(shape.width - width) < 0.0025
    assert abs(shape.height - height) < 0.007
    if turn_deg is not None:
        assert abs(np.remainder(np.rad2deg(shape.turn or 0.0) - turn_deg + 45, 90) - 45) < 8.0


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(("width", "length"), [(0.020, 0.026), (0.020, 0.050), (0.030, 0.040)])
@pytest.mark.parametrize("corners", [72, 4])
@pytest.mark.parametrize("turn_deg", [0.0, 25.0, 50.0, 75.0, 100.0, 125.0, 150.0])
def test_what_lies_slantwise_does_not_count_as_standing(
    view: tuple[Scene, PlaneHomography],
    place: tuple[float, float],
    width: float,
    length: float,
    corners: int,
    turn_deg: float,
) -> None:
    angles = 2 * np.pi * (np.arange(corners) + 0.5) / corners
    end = width / 2 * np.column_stack([np.cos(angles), np.sin(angles)]) / np.cos(np.pi / corners)
    turn = np.deg2rad(turn_deg)
    along, beside = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])
    middle = np.array([*place, width / 2])
    halves = (-length / 2, length / 2)
    body = [middle + half * along + y * beside + z * np.array([0, 0, 1]) for half in halves for y, z in end]
    shape = object_shape(hull_of(view[0], np.array(body)), view[1])
    assert shape is not None
    away, _ = view[1].away_from_camera(*view[0].project(middle))
    if np.cos(np.deg2rad(70.0)) < abs(away @ along[:2]) < np.cos(np.deg2rad(20.0)):
        assert abs(shape.length - length) < 0.004
        assert abs(shape.width - width) < 0.004
        assert shape.height == shape.width
        assert abs(np.remainder(np.rad2deg(shape.turn or 0.0) - turn_deg + 90, 180) - 90) < 8.0


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.lists(st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)), max_size=12))
def test_any_outline_gives_a_shape_or_none(points: list[tuple[float, float]]) -> None:
    homography = PlaneHomography.fit(
        [(100, 300), (400, 300), (300, 100), (180, 100)], WORKING_AREA[1:] + WORKING_AREA[:1]
    )
    try:
        shape = object_shape(np.array(points).reshape(-1, 2), homography)
    except ValueError:
        return
    assert shape is None or isinstance(shape, ObjectShape)
    assert shape is None or min(shape.width, shape.height) > 0.0
