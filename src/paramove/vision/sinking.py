"""Where an object was last seen at its full height, when it sank into an opening or went out of sight.

While a standing cylinder sinks, the opening's near rim cuts it off from below: the lower border of what is seen stays
where it is, on the rim, and the rest shrinks towards it. So the lower border is the best trace of the place, also while
a hand hides the upper end. The middle of the object at its full height is found from it upwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Self

import numpy as np

from paramove.msgs.tracked_objects_pb2 import TrackedObject
from paramove.vision.full_size import FullSize, Size

BORDER_PX = 2.0
"""The lower border scatters by about 0.3 px; on the rim it stays within this range."""
SHRUNK_SHARE = 0.8
"""A height below this share of the one before sinking is shrinking, no scatter (3 %)."""
LEAST_HEIGHT_SHARE = 0.1
"""Below this share of the height before sinking, the border is scatter."""
LAST_SAMPLES = 20
"""A second and a half: longer than any lowering into an opening."""
LOWERED_PX = 6.0
"""An object that came down this far in one place and is gone then has gone into an opening, falling between images."""
STEEPEST_AXIS = 0.6
"""Largest du/dv of a standing object's axis: a near camera looking down sees axes lean by 0.4 at its sides."""
ASIDE_PX = 8.0
"""u of an object's visible part changes by less than this while it sinks along a leaning axis."""


@dataclass(frozen=True)
class Sample:
    """An object in one image, px; time in s."""

    time_s: float
    u_px: float
    v_px: float
    area_px: float
    left_px: float
    top_px: float
    width_px: float
    height_px: float

    @classmethod
    def of(cls, tracked: TrackedObject, time_s: float) -> Self:
        box = (tracked.left_px, tracked.top_px, tracked.width_px, tracked.height_px)
        return cls(time_s, tracked.u_px, tracked.v_px, tracked.area_px, *box)

    @classmethod
    def median(cls, samples: Sequence[Sample]) -> Sample:
        """Median of each number; the time of the last."""
        rows = np.array([(s.u_px, s.v_px, s.area_px, s.left_px, s.top_px, s.width_px, s.height_px) for s in samples])
        return Sample(samples[-1].time_s, *(float(value) for value in np.median(rows, axis=0)))

    @property
    def right_px(self) -> float:
        return self.left_px + self.width_px

    @property
    def bottom_px(self) -> float:
        return self.top_px + self.height_px

    def teach(self, full_size: FullSize, name: str) -> None:
        """Give this sample of an object at rest to what is known of full sizes."""
        size = Size(self.area_px, self.height_px, self.bottom_px - self.v_px)
        full_size.learn(name, self.u_px, self.v_px, size)

    def displacement_px(self, other: Sample) -> float:
        """How far the object has moved for certain.

        Something in front of an object moves one border inwards, or both; motion moves opposite borders the same way.
        So the smaller of the two counts, and nothing if they move apart or together.
        """
        across = _common(self.left_px - other.left_px, self.right_px - other.right_px)
        along = _common(self.top_px - other.top_px, self.bottom_px - other.bottom_px)
        return float(np.hypot(across, along))

    def border_change_px(self, other: Sample) -> float:
        """Largest change of a border."""
        return max(
            abs(self.left_px - other.left_px),
            abs(self.right_px - other.right_px),
            abs(self.top_px - other.top_px),
            abs(self.bottom_px - other.bottom_px),
        )


@dataclass(frozen=True)
class LastPlace:
    """Middle of the object at its full height, px. `sunk`: measured from an opening's near rim."""

    u_px: float
    v_px: float
    sunk: bool
    confidence: float


def last_place(name: str, samples: Sequence[Sample], full_size: FullSize) -> LastPlace:
    """Last place at full height of an object that is seen no more.

    Args:
        samples: at least one, in the order of time, to the last one seen.
    """
    full = full_size.expected(name, samples[-1].u_px, samples[-1].v_px)
    if full is None:  # never seen at rest: the tallest sample has to do
        tallest = max(samples, key=lambda sample: sample.height_px)
        full = Size(tallest.area_px, tallest.height_px, tallest.bottom_px - tallest.v_px)
    heights = sorted(s.height_px for s in samples[-LAST_SAMPLES:])
    carried_px = median(heights[len(heights) // 2 :])  # less than the full height where a hand holds the upper end
    seen = [s for s in samples if s.height_px >= LEAST_HEIGHT_SHARE * carried_px] or [samples[-1]]
    on_rim = _on_rim(seen)
    shrunk = min(samples[-1].height_px, *(s.height_px for s in on_rim)) < SHRUNK_SHARE * carried_px
    sunk = shrunk or _came_down(seen[-LAST_SAMPLES:])
    on_rim = on_rim if sunk else seen[-1:]
    bottom_px = median(s.bottom_px for s in on_rim)
    at_place = full_size.expected(name, seen[-1].u_px, bottom_px - full.lower_px) or full
    middle_px = bottom_px - at_place.lower_px
    u_px = _on_axis(seen[-len(on_rim) - 8 :], on_rim, middle_px)
    return LastPlace(u_px, middle_px, sunk, confidence=1.0 if shrunk and len(on_rim) > 1 else 0.7)


def _came_down(recent: Sequence[Sample]) -> bool:
    """Whether the object was lowered where it was last seen."""
    there = [s.bottom_px for s in recent if abs(s.u_px - recent[-1].u_px) <= ASIDE_PX]
    return recent[-1].bottom_px - min(there) > LOWERED_PX


def _on_rim(seen: Sequence[Sample]) -> list[Sample]:
    """The last samples whose lower border is where that of the very last is, across and along."""
    on_rim = [seen[-1]]
    for sample in reversed(seen[:-1]):
        lifted = abs(sample.bottom_px - median(s.bottom_px for s in on_rim)) > BORDER_PX
        if lifted or abs(sample.u_px - seen[-1].u_px) > ASIDE_PX:
            break
        on_rim.append(sample)
    return on_rim[::-1]


def _on_axis(recent: Sequence[Sample], on_rim: Sequence[Sample], v_px: float) -> float:
    """u at height v of the image line along which the object came down: its own axis, as it stands upright."""
    u0, v0 = median(s.u_px for s in on_rim), median(s.v_px for s in on_rim)
    du, dv = np.array([s.u_px - u0 for s in recent]), np.array([s.v_px - v0 for s in recent])
    steep = np.abs(du) > 3 + 1.2 * STEEPEST_AXIS * np.abs(dv)  # still carried sideways
    slope = float(du[~steep] @ dv[~steep]) / (float(dv[~steep] @ dv[~steep]) + 10.0**2)
    return u0 + float(np.clip(slope, -STEEPEST_AXIS, STEEPEST_AXIS)) * (v_px - v0)


def _common(a: float, b: float) -> float:
    return 0.0 if a * b <= 0 else min(abs(a), abs(b))
