"""Openings are found as dark round places and remembered while something hides them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from paramove.msgs.tracked_objects_pb2 import Opening
from paramove.objects.openings import STEADY, OpeningTracker, find_openings

CENTRE = (200.0, 150.0)


def _value(brightness: int, darkness: float, noise: float = 0.0) -> np.ndarray:
    """Brightness at half resolution: one elliptic opening at `CENTRE`, 36 x 24 px, in a surface."""
    image = np.full((4 * 360, 4 * 480), float(brightness))
    cv2.ellipse(
        image, (int(4 * CENTRE[0] + 1.5), int(4 * CENTRE[1] + 1.5)), (72, 48), 8, 0, 360, brightness * darkness, -1
    )
    small = cv2.resize(image, (240, 180), interpolation=cv2.INTER_AREA)
    return np.clip(small + np.random.default_rng(1).normal(0, noise, small.shape), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("brightness", [40, 90, 230])
@pytest.mark.parametrize("darkness", [0.05, 0.3])
def test_middle_of_a_dark_round_place(brightness: int, darkness: float) -> None:
    (found,) = find_openings(_value(brightness, darkness, noise=2.0))
    assert (found.u_px, found.v_px) == (pytest.approx(CENTRE[0], abs=0.5), pytest.approx(CENTRE[1], abs=0.5))
    assert (found.width_px, found.height_px) == (pytest.approx(36, abs=3), pytest.approx(24, abs=3))


def test_stripes_borders_and_shades_are_no_openings() -> None:
    value = np.full((180, 240), 100, np.uint8)
    cv2.line(value, (20, 20), (120, 30), 10, 3)  # a slit
    cv2.circle(value, (0, 90), 9, 10, -1)  # cut off by the image's border
    cv2.circle(value, (160, 90), 9, 80, -1)  # a shade
    cv2.circle(value, (200, 140), 3, 10, -1)  # a spot
    assert find_openings(value) == []


def _opening(u: float = 200.0, v: float = 150.0, hidden: float = 0.0) -> Opening:
    return Opening(u_px=u, v_px=v + 12 * hidden, area_px=680 * (1 - hidden), width_px=36, height_px=24 * (1 - hidden))


def _seen(*images: list[Opening]) -> OpeningTracker:
    tracker = OpeningTracker()
    for openings in images:
        tracker.update(openings)
    return tracker


def test_a_hidden_opening_is_remembered_where_it_was_seen_whole() -> None:
    seen = _seen(*[[_opening()]] * STEADY, *[[_opening(hidden=0.3)]] * 40, *[[]] * 100)
    assert seen.at(203, 158) == (200.0, 150.0)
    assert seen.at(200, 220) is None


def test_what_hid_a_part_at_first_is_forgotten() -> None:
    assert _seen(*[[_opening(hidden=0.3)]] * 40, *[[_opening()]] * STEADY).at(200, 150) == (200.0, 150.0)


def test_the_nearest_of_two_openings_takes_the_object() -> None:
    assert _seen(*[[_opening(), _opening(u=250)]] * STEADY).at(222, 150) == (200.0, 150.0)


def test_something_dark_that_moves_is_no_opening() -> None:
    assert _seen(*[[_opening(u=100 + 6 * image)] for image in range(30)]).at(274, 150) is None


def test_an_opening_not_seen_for_a_minute_is_forgotten() -> None:
    assert _seen(*[[_opening()]] * STEADY, *[[]] * 900).at(200, 150) is None
