"""The apparent size of an unoccluded object as a function of the image point."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats

POSITION_RADIUS_PX = 24.0
"""Closer samples belong to one position: about one object's width apart, over which the size changes by < 3 %."""
ACCEPT_RATIO = 0.85
"""A sample below this fraction of the expected area is partly occluded, unless it is as slender as expected."""
EXCHANGED_RATIO = 1.4
"""An object so much larger than expected may be another one, which is exchanged back later."""
AS_SLENDER = 0.11
"""Maximum difference of the logarithms of height and width: depth changes both alike, occlusion does not."""
POSITIONS_PER_OBJECT = 12


@dataclass(frozen=True)
class Size:
    """The size of an upright, round, unoccluded object; px.

    Attributes:
        area_px: Of its region.
        height_px, width_px: Of the region's box.
        lower_px: From its centre to its lower border.
        lean: du/dv along its axis.
    """

    area_px: float
    height_px: float
    width_px: float
    lower_px: float
    lean: float

    def foot_px(self, foreshortening: float) -> tuple[float, float]:
        """(u, v) from its centre to where its axis meets the surface.

        The lower end is a circle seen at a slant. The tracker puts the lower border where the region is half as wide as
        usual: at √3/2 of the radius of that circle below its middle.

        Args:
            foreshortening: Height over width, in the image, of a circle on the surface.
        """
        down_px = self.lower_px - math.sqrt(3) / 4 * foreshortening * self.width_px
        return self.lean * down_px, down_px


@dataclass
class _SizeSample:
    u_px: float
    v_px: float
    size: Size
    stands: bool


class FullSize:
    """Learns, from objects at rest, how large they are in the image as a function of the image point.

    Perspective makes sizes change smoothly over the image, alike for all objects: log area of object k is modelled as
    c_k + a·u + b·v with common a and b (least squares with a weak ridge on a and b), the lean likewise
    without the logarithm. The largest steady area at a position is the full one, as occlusion only makes
    an area smaller. No truth and no camera model is used.
    """

    def __init__(self) -> None:
        self._samples: dict[str, list[_SizeSample]] = {}
        self._before: dict[str, list[_SizeSample]] = {}
        self._model: dict[str, Floats] = {}
        self._slope: Floats = np.zeros((2, 5))

    def expected(self, name: str, u_px: float, v_px: float) -> Size | None:
        """Full size of the object at an image point; None before it was first detected at rest."""
        if name not in self._model:
            return None
        point = np.array([u_px, v_px]) / 100.0
        *logs, lean = self._model[name] + point @ self._slope
        area, height, width, lower = (float(np.exp(number)) for number in logs)
        return Size(area, height, width, lower, float(lean))

    def visible_fraction(self, name: str, u_px: float, v_px: float, area_px: float) -> float:
        """Area over full area at that image point, 0 to 1; 1 for an unknown object."""
        full = self.expected(name, u_px, v_px)
        return 1.0 if full is None else min(1.0, area_px / full.area_px)

    def was_exchanged_back(self, name: str, u_px: float, v_px: float, size: Size) -> bool:
        """Whether it looks as before it grew: then it is as before, as the larger object was another one."""
        if name not in self._before:
            return False
        self._exchange(name)
        full = self.expected(name, u_px, v_px)
        again = full is not None and _as_slender(size, full) and size.area_px > ACCEPT_RATIO * full.area_px
        if not again:
            self._exchange(name)
        return again

    def _exchange(self, name: str) -> None:
        self._samples[name], self._before[name] = self._before[name], self._samples[name]
        self._fit()

    def learn(self, name: str, u_px: float, v_px: float, size: Size, *, stands: bool = True) -> None:
        """Adds one sample of an object that stands still.

        Args:
            stands: It is known to stand on the surface. Samples of an object that may as well be held up, nearer to the
                camera, count only until there is one of it standing.
        """
        samples = self._samples.setdefault(name, [])
        if samples and samples[0].stands and not stands:
            return
        if stands and samples and not samples[0].stands:
            samples.clear()
        area_px, full = size.area_px, self.expected(name, u_px, v_px) if samples else None
        if full is not None and not _as_slender(size, full):
            if area_px < ACCEPT_RATIO * full.area_px:
                return
            if area_px > full.area_px / ACCEPT_RATIO:
                if area_px > EXCHANGED_RATIO * full.area_px:
                    self._before[name] = samples.copy()
                samples.clear()  # the earlier samples were of a smaller object, or partly occluded
        near = min(samples, key=lambda sample: _distance(sample, u_px, v_px), default=None)
        if near is None or _distance(near, u_px, v_px) > POSITION_RADIUS_PX:
            samples.append(_SizeSample(u_px, v_px, size, stands))
            del samples[:-POSITIONS_PER_OBJECT]
        elif area_px > 1.02 * near.size.area_px:
            near.u_px, near.v_px, near.size = u_px, v_px, size
        else:
            return
        self._fit()

    def _fit(self) -> None:
        names = sorted(self._samples)
        rows = [(index, sample) for index, name in enumerate(names) for sample in self._samples[name]]
        design = np.zeros((len(rows) + 2, len(names) + 2))
        value = np.zeros((len(rows) + 2, 5))
        for row, (index, sample) in enumerate(rows):
            design[row, index] = 1.0
            design[row, -2:] = sample.u_px / 100.0, sample.v_px / 100.0
            size = sample.size
            value[row, :4] = np.log([size.area_px, size.height_px, size.width_px, size.lower_px])
            value[row, 4] = size.lean
        design[-2, -2] = design[-1, -1] = 0.2  # ridge: if all positions coincide, the size is constant
        solution = np.linalg.lstsq(design, value, rcond=None)[0]
        self._slope = np.asarray(solution[-2:], dtype=np.float64)
        self._model = {name: np.asarray(solution[i], dtype=np.float64) for i, name in enumerate(names)}


def _as_slender(one: Size, other: Size) -> bool:
    return abs(math.log(one.height_px * other.width_px / (other.height_px * one.width_px))) < AS_SLENDER


def _distance(sample: _SizeSample, u_px: float, v_px: float) -> float:
    return float(np.hypot(sample.u_px - u_px, sample.v_px - v_px))
