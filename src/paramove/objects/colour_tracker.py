"""Finds objects and the hand by their colours (thesis 5.2.6: "tracked by a color tracker in a camera view").

Regions are found at half resolution and measured at full resolution. Pixels are weighted: a pixel at the border that is
half object, half background counts half, which gives centres to about 0.1 px.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, Image
from paramove.msgs.tracked_objects_pb2 import TrackedObject, TrackedObjects
from paramove.objects.full_size import FullSize, Size
from paramove.objects.openings import find_openings

MIN_AREA_PX = 24.0
"""Smaller regions are noise; an object of 20 x 50 mm has about 400 px."""
MAX_AREA_FRACTION = 0.12
"""Regions above this fraction of the image are background."""
MAX_PIECES = 6
TWIN_SHARE = 0.4
"""Of the area of the largest region of a colour, from which another one apart from it can be an object."""


@dataclass(frozen=True)
class Colour:
    """A colour to be tracked.

    Attributes:
        name: Name of the colour, used as the object's name.
        hue_deg: Lower and upper hue, 0 to 360; lower > upper wraps over red.
        saturation: Minimum saturation, (max - min)/max of RGB, 0 to 1.
        hand: True for the instructor's hand.
    """

    name: str
    hue_deg: tuple[float, float]
    saturation: float = 0.45
    hand: bool = False

    def __post_init__(self) -> None:
        if not all(0 <= hue <= 360 for hue in self.hue_deg) or not 0 < self.saturation < 1:
            raise ValueError(
                f"colour {self.name!r}: hues within 0..360 degrees and a saturation within 0..1 expected, "
                f"found hue {self.hue_deg} and saturation {self.saturation}"
            )


DEFAULT_COLOURS = (
    Colour("yellow", (42.0, 75.0)),
    Colour("green", (90.0, 165.0)),
    Colour("blue", (195.0, 262.0)),
    Colour("magenta", (280.0, 345.0), hand=True),
)
"""Gaps of at least 15 degrees between neighbours keep noisy dark pixels out of the wrong colour."""


class ColourTracker:
    """Tracks one region per colour.

    Args:
        colours: The colours to track.
    """

    STILL_PX = 0.75  # centres of a standing object scatter by about 0.15 px
    STILL_FRAMES = 8  # half a second at 15 Hz

    def __init__(self, colours: Sequence[Colour] = DEFAULT_COLOURS) -> None:
        if not colours or len({colour.name for colour in colours}) != len(colours):
            raise ValueError(f"colours {[c.name for c in colours]}: at least one, each name once, expected")
        cv2.setNumThreads(1)  # images are small: threads cost more than they give, and other nodes need the cores
        self._colours = tuple(colours)
        self._full_size = FullSize()
        self._recent = {colour.name: deque[TrackedObject](maxlen=self.STILL_FRAMES) for colour in self._colours}

    def update(self, image_bgr: Image, captured_ns: int = 0) -> TrackedObjects:
        """The coloured regions of one image [H, W, 3] uint8, BGR. Raises ValueError for any other array."""
        if image_bgr.ndim != 3 or image_bgr.shape[2] != 3 or image_bgr.dtype != np.uint8:
            raise ValueError(f"image of shape {image_bgr.shape} and type {image_bgr.dtype}: [H, W, 3] uint8 expected")
        height, width = image_bgr.shape[:2]
        tracked = TrackedObjects(frame="camera_optical", width_px=width, height_px=height)
        tracked.captured.FromNanoseconds(captured_ns)
        small = cv2.resize(image_bgr, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
        hsv, chroma = _hue_and_chroma(small)
        _, coloured = cv2.threshold(chroma, int(_min_chroma(small, hsv)), 255, cv2.THRESH_BINARY)
        tracked.openings.extend(find_openings(hsv[:, :, 2]))
        for colour in self._colours:
            box, twin = _find(_of_colour(hsv, coloured, colour))
            region = None if box is None else _measure(image_bgr, box, colour)
            if region is None or region.area_px < MIN_AREA_PX:
                self._recent[colour.name].clear()
                continue
            if not colour.hand:
                region.twin, region.confidence = twin, self._visible_fraction(region)
            tracked.objects.append(region)
        return tracked

    def _visible_fraction(self, region: TrackedObject) -> float:
        """Of an object, whose full size is learned while it stands still."""
        recent = self._recent[region.name]
        recent.append(region)
        if self._stands_still(recent):
            area, height = median(r.area_px for r in recent), median(r.height_px for r in recent)
            lower = region.top_px + region.height_px - region.v_px
            size = Size(area, height, region.width_px, lower, region.lean)
            self._full_size.learn(region.name, region.u_px, region.v_px, size)
        return self._full_size.visible_fraction(region.name, region.u_px, region.v_px, region.area_px)

    def _stands_still(self, recent: deque[TrackedObject]) -> bool:
        if len(recent) < self.STILL_FRAMES:
            return False
        latest = recent[-1]
        return all(
            abs(r.u_px - latest.u_px) < self.STILL_PX and abs(r.v_px - latest.v_px) < self.STILL_PX for r in recent
        )


def _hue_and_chroma(image: Image) -> tuple[Image, Image]:
    """HSV image (hue in 2 degrees, OpenCV's unit) and chroma = max - min of the channels."""
    hsv: Any = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
    chroma: Any = cv2.multiply(hsv[:, :, 1], hsv[:, :, 2], scale=1 / 255.0)
    return hsv, chroma


def _min_chroma(image: Image, hsv: Image) -> float:
    """Chroma that neither noise nor a grey surface reaches, from this image alone.

    Grows with the scene's brightness (a colour's chroma is proportional to the light) and with the noise (max - min of
    three grey channels stays below 5 sigma).
    """
    values = np.sort(hsv[::6, ::6, 2], axis=None)
    bright = float(values[int(0.9 * values.size)])
    steps = np.abs(np.diff(image[::6, :, 1].astype(np.int16), axis=1))
    noise = float(np.minimum(steps, 20).mean()) / 1.13  # E|difference of neighbours| = 1.13 sigma
    return max(8.0, 0.09 * bright, 5.0 * noise)


def _of_colour(hsv: Image, coloured: Image, colour: Colour) -> Image:
    low, high = colour.hue_deg[0] / 2, colour.hue_deg[1] / 2
    minimum = 255 * colour.saturation
    if low <= high:
        mask: Any = cv2.inRange(hsv, (low, minimum, 0), (high, 255, 255))
    else:
        above, below = (
            cv2.inRange(hsv, (low, minimum, 0), (180, 255, 255)),
            cv2.inRange(hsv, (0, minimum, 0), (high, 255, 255)),
        )
        mask = cv2.bitwise_or(above, below)
    return cv2.bitwise_and(mask, coloured)


def _find(mask: Image) -> tuple[tuple[int, int, int, int] | None, bool]:
    """Box (left, top, right, bottom), full-resolution px, of the largest region and its nearby pieces.

    Also whether there is another one that can be an object.
    """
    x, y, width, height = cv2.boundingRect(mask)
    if width == 0:
        return None, False
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask[y : y + height, x : x + width], connectivity=8)
    minimum, maximum = MIN_AREA_PX / 4, MAX_AREA_FRACTION * mask.size
    areas = stats[1:, cv2.CC_STAT_AREA]
    pieces = stats[1:][(areas >= max(2.0, 0.1 * minimum)) & (areas <= maximum)]
    pieces = pieces[np.argsort(-pieces[:, cv2.CC_STAT_AREA], kind="stable")][:MAX_PIECES]
    if not len(pieces) or pieces[0][cv2.CC_STAT_AREA] < minimum:
        return None, False
    left, top, right, bottom = _corners(pieces[0])
    reach, twin = max(right - left, bottom - top), False
    for piece in pieces[1:]:  # an arm in front may cut a region into pieces
        if piece[cv2.CC_STAT_AREA] < max(minimum, 0.1 * pieces[0][cv2.CC_STAT_AREA]):
            break
        other = _corners(piece)
        if max(left - other[2], other[0] - right, top - other[3], other[1] - bottom) <= 0.5 * reach:
            left, top = min(left, other[0]), min(top, other[1])
            right, bottom = max(right, other[2]), max(bottom, other[3])
        else:
            twin |= bool(piece[cv2.CC_STAT_AREA] >= TWIN_SHARE * pieces[0][cv2.CC_STAT_AREA])
    return (2 * (x + left), 2 * (y + top), 2 * (x + right), 2 * (y + bottom)), twin


def _corners(row: NDArray[np.int32]) -> tuple[int, int, int, int]:
    left, top = int(row[cv2.CC_STAT_LEFT]), int(row[cv2.CC_STAT_TOP])
    return left, top, left + int(row[cv2.CC_STAT_WIDTH]), top + int(row[cv2.CC_STAT_HEIGHT])


def _measure(image: Image, box: tuple[int, int, int, int], colour: Colour) -> TrackedObject | None:
    """Measure the region of a colour within the box and 5 px around it."""
    left, top = max(0, box[0] - 5), max(0, box[1] - 5)
    patch = cv2.GaussianBlur(image[top : box[3] + 5, left : box[2] + 5], (3, 3), 0.8)
    hsv, chroma = _hue_and_chroma(patch)
    of_hue = _of_colour(hsv, np.full_like(chroma, 255), Colour(colour.name, colour.hue_deg, 0.6 * colour.saturation))
    of_hue_chroma = np.sort(chroma[(of_hue > 0) & (chroma > 0.25 * chroma.max())])
    if of_hue_chroma.size == 0:
        return None
    # The 30th percentile is the region's shaded side; half of it is the border between region and grey background.
    side = float(of_hue_chroma[int(0.3 * of_hue_chroma.size)])
    weight = np.clip((chroma - 0.25 * side) * (2.0 / side), 0.0, 1.0) * (of_hue > 0)
    return _region(weight, left, top, colour)


def _region(weight: Floats, left: int, top: int, colour: Colour) -> TrackedObject | None:
    """(u, v) is the centre of gravity, for a hand the middle of its palm. The middle of the first pixel is 0."""
    area = float(weight.sum())
    if area <= 0:
        return None
    columns, rows = weight.sum(axis=0), weight.sum(axis=1)
    left_edge, right_edge = _extent(columns)
    top_edge, bottom_edge = _extent(rows)
    u, v = float(columns @ np.arange(columns.size)) / area, float(rows @ np.arange(rows.size)) / area
    lean = _lean(weight, u, v)
    if colour.hand:
        u, v = _palm(weight)
    region = TrackedObject(
        name=colour.name,
        kind=TrackedObject.KIND_HAND if colour.hand else TrackedObject.KIND_OBJECT,
        u_px=left + u,
        v_px=top + v,
        area_px=area,
        left_px=left + left_edge,
        top_px=top + top_edge,
        width_px=right_edge - left_edge,
        height_px=bottom_edge - top_edge,
        lean=lean,
        confidence=1.0,
    )
    for column, row in _outline(weight, left, top):
        region.outline.add(u_px=float(column), v_px=float(row))
    return region


def _lean(weight: Floats, u: float, v: float) -> float:
    """du/dv of the principal axis through the centre (u, v)."""
    du, dv = np.arange(weight.shape[1]) - u, np.arange(weight.shape[0]) - v
    uu, vv = float(weight.sum(axis=0) @ du**2), float(weight.sum(axis=1) @ dv**2)
    uv = float(dv @ weight @ du)
    return float(np.tan(0.5 * np.arctan2(2 * uv, vv - uu)))


def _palm(weight: Floats) -> tuple[float, float]:
    """Middle of the largest circle within the region: of a hand the palm, wherever its fingers and its sleeve are."""
    inside = np.pad((weight > 0.5).astype(np.uint8), 1)
    _, _, _, (u, v) = cv2.minMaxLoc(cv2.distanceTransform(inside, cv2.DIST_L2, 3))
    return u - 1.0, v - 1.0


def _outline(weight: Floats, left: int, top: int) -> Floats:
    """Convex hull of the pixels that belong to the region by more than a half; [M, 2] px."""
    points = cv2.findNonZero((weight > 0.5).astype(np.uint8))
    if points is None:
        return np.zeros((0, 2))
    return np.asarray(cv2.convexHull(points).reshape(-1, 2) + np.array([left, top]), dtype=np.float64)


def _extent(profile: Floats) -> tuple[float, float]:
    """First and last position at which a profile crosses half of its typical value, with subpixel accuracy."""
    typical = np.sort(profile[profile > 0.2 * profile.max()])
    level = 0.5 * float(typical[typical.size // 2])
    inside = np.flatnonzero(profile >= level)
    first, last = int(inside[0]), int(inside[-1])
    before = profile[first - 1] if first > 0 else 0.0
    after = profile[last + 1] if last + 1 < profile.size else 0.0
    rise = (profile[first] - level) / max(profile[first] - before, 1e-9)
    fall = (profile[last] - level) / max(profile[last] - after, 1e-9)
    return first - float(rise), last + float(fall)
