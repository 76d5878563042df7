"""Openings: dark round regions on a lighter surface, known only from the images.

An opening absorbs the light that falls into it, so it looks darker than the surface around it, and its rim is the
border of the dark region. The camera and the surface stand still, so an occluded opening is remembered.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median
from typing import Any

import cv2
import numpy as np

from paramove.documents import Image
from paramove.msgs.tracked_objects_pb2 import Opening

SURROUNDINGS_PX = 15
"""Side of the square of which the surface around an opening fills more than half, px at a quarter of the size."""
DARK_FRACTION = 0.62
"""Fraction of the surface's brightness: halfway between it and a dark inside."""
SMALLEST_PX, LARGEST_PX = 100.0, 3000.0
"""Area of an opening in a 480 x 360 image; an object of 20 x 50 mm has about 400 px."""
ROUNDNESS = 0.95
"""Area over that of the ellipse of the same second moments: 1 for an ellipse, 0.95 for a rectangle."""
SOLIDITY = 0.9
"""Area over that of the convex hull."""
HIDDEN_FRACTION = 0.85
"""An opening below this fraction of its usual area is partly occluded; noise changes a small one by a few %."""
MOVED_HALF_AXES = 0.25
"""A dark region farther from its previous position is moving, so it is no opening."""
STEADY, SAMPLES = 8, 30
"""Minimum number of sightings of an opening (half a second), and how many are stored."""
FORGOTTEN_IMAGES = 900
"""An opening that was not detected for a minute may be elsewhere."""
REACH = 1.6
"""An object that vanished within this many half axes of its nearest opening has gone into it."""


def find_openings(value: Image) -> list[Opening]:
    """Finds dark round regions.

    Args:
        value: Brightness at half resolution, [H, W] uint8.

    Returns:
        Openings in px of the full resolution.
    """
    quarter = cv2.resize(value, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    around = cv2.resize(cv2.medianBlur(quarter, SURROUNDINGS_PX), value.shape[::-1])
    smooth = cv2.GaussianBlur(value, (3, 3), 0.8)
    dark: Any = cv2.compare(smooth, cv2.convertScaleAbs(around, alpha=DARK_FRACTION), cv2.CMP_LT)
    contours, _ = cv2.findContours(dark, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    openings = (_opening(contour, value.shape) for contour in contours)
    return [opening for opening in openings if opening is not None]


def _opening(contour: Image, shape: tuple[int, ...]) -> Opening | None:
    """The opening with this border, the middles of its outermost pixels at half resolution; None if it is none."""
    left, top, width, height = cv2.boundingRect(contour)
    area = cv2.contourArea(contour)
    if not SMALLEST_PX / 4 <= area <= LARGEST_PX / 4 or left == 0 or top == 0:
        return None
    if left + width == shape[1] or top + height == shape[0]:
        return None
    moments = cv2.moments(contour)
    determinant = moments["mu20"] * moments["mu02"] - moments["mu11"] ** 2
    if area**2 < ROUNDNESS * 4 * np.pi * np.sqrt(determinant) or area < SOLIDITY * cv2.contourArea(
        cv2.convexHull(contour)
    ):
        return None
    return Opening(
        u_px=2 * moments["m10"] / moments["m00"] + 0.5,
        v_px=2 * moments["m01"] / moments["m00"] + 0.5,
        area_px=4 * area,
        width_px=2 * width,
        height_px=2 * height,
    )


@dataclass
class _Region:
    """One dark region; `sightings` since it was partly occluded or moved."""

    sightings: deque[Opening]
    last_image: int

    def distance(self, u_px: float, v_px: float) -> float:
        """Of a point from the middle; 1 on the rim."""
        last = self.sightings[-1]
        return float(2 * np.hypot((u_px - last.u_px) / last.width_px, (v_px - last.v_px) / last.height_px))


class OpeningTracker:
    """Tracks openings by their latest unoccluded sightings."""

    def __init__(self) -> None:
        self._regions: list[_Region] = []
        self._images = 0

    def update(self, openings: Iterable[Opening]) -> None:
        """Adds the openings of one image."""
        self._images += 1
        for opening in openings:
            known = _nearest(self._regions, opening.u_px, opening.v_px, within=1.0)
            if known is None:
                self._regions.append(_Region(deque([opening], maxlen=SAMPLES), self._images))
                continue
            usual = median(one.area_px for one in known.sightings)
            hidden = opening.area_px < HIDDEN_FRACTION * usual
            if hidden and len(known.sightings) >= STEADY:
                continue
            moved = known.distance(opening.u_px, opening.v_px) > MOVED_HALF_AXES
            if moved or hidden or opening.area_px * HIDDEN_FRACTION > usual:
                known.sightings.clear()
            known.sightings.append(opening)
            known.last_image = self._images
        self._regions = [one for one in self._regions if self._images - one.last_image < FORGOTTEN_IMAGES]

    def at(self, u_px: float, v_px: float) -> tuple[float, float] | None:
        """Centre (u, v), px, of the opening that an object at an image point of the surface has gone into, if any."""
        steady = [one for one in self._regions if len(one.sightings) >= STEADY]
        near = _nearest(steady, u_px, v_px, within=REACH)
        if near is None:
            return None
        return median(one.u_px for one in near.sightings), median(one.v_px for one in near.sightings)


def _nearest(regions: Iterable[_Region], u_px: float, v_px: float, within: float) -> _Region | None:
    near = min(regions, key=lambda one: one.distance(u_px, v_px), default=None)
    return near if near is not None and near.distance(u_px, v_px) <= within else None
