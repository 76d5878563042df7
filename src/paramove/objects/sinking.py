"""The last position of an object at its full height, when it sank into an opening or went out of sight.

While a standing cylinder sinks, the opening's near rim cuts it off from below: the lower border of the visible
part stays on the rim, and the rest shrinks towards it. So the lower border is the best evidence of the position, also
while a hand hides the upper end. The middle of the object at its full height is computed from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from statistics import median
from typing import Self

import numpy as np

from paramove.msgs.tracked_objects_pb2 import TrackedObject
from paramove.objects.full_size import FullSize, Size

BORDER_PX = 2.0
"""The lower border scatters by about 0.3 px; on the rim it stays within this range."""
MIN_HEIGHT_FRACTION = 0.1
"""Below this fraction of the height before sinking, the border is scatter."""
LAST_SAMPLES = 20
"""A second and a half: longer than any lowering into an opening."""
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
    lean: float

    @classmethod
    def of(cls, tracked: TrackedObject, time_s: float) -> Self:
        box = (tracked.left_px, tracked.top_px, tracked.width_px, tracked.height_px)
        return cls(time_s, tracked.u_px, tracked.v_px, tracked.area_px, *box, tracked.lean)

    @classmethod
    def median(cls, samples: Sequence[Sample]) -> Sample:
        """Median of each number; the time of the last."""
        rows = np.array([astuple(sample) for sample in samples])
        return Sample(samples[-1].time_s, *(float(value) for value in np.median(rows, axis=0)[1:]))

    @property
    def right_px(self) -> float:
        return self.left_px + self.width_px

    @property
    def bottom_px(self) -> float:
        return self.top_px + self.height_px

    @property
    def size(self) -> Size:
        """The size as if the object were unoccluded."""
        lean = float(np.clip(self.lean, -STEEPEST_AXIS, STEEPEST_AXIS))
        return Size(self.area_px, self.height_px, self.width_px, self.bottom_px - self.v_px, lean)

    def displacement_px(self, other: Sample) -> float:
        """Minimum distance that the object has moved.

        Occlusion moves one border inwards, or both; motion moves opposite borders the same way. So the smaller of the
        two counts, and none if they move apart or together.
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


def last_position(name: str, samples: Sequence[Sample], full_size: FullSize) -> tuple[float, float]:
    """Middle (u, v), px, of an object that has vanished, at its last full height.

    If it sank into an opening, the result is nearer to the camera than the object, by the gap between it and the rim.

    Args:
        samples: at least one, in the order of time, up to the last detection.
    """
    tallest = max(samples, key=lambda sample: sample.height_px)  # the only estimate if it was never at rest
    full = full_size.expected(name, samples[-1].u_px, samples[-1].v_px) or tallest.size
    heights = sorted(s.height_px for s in samples[-LAST_SAMPLES:])
    carried_px = median(heights[len(heights) // 2 :])  # less than the full height where a hand holds the upper end
    visible = [s for s in samples if s.height_px >= MIN_HEIGHT_FRACTION * carried_px] or [samples[-1]]
    bottom_px = median(s.bottom_px for s in _on_rim(visible))
    full = full_size.expected(name, visible[-1].u_px, bottom_px - full.lower_px) or full
    middle_px = bottom_px - full.lower_px
    return visible[-1].u_px + full.lean * (middle_px - visible[-1].v_px), middle_px


def _on_rim(visible: Sequence[Sample]) -> list[Sample]:
    """The last samples with their lower border at that of the very last one, across and along."""
    on_rim = [visible[-1]]
    for sample in reversed(visible[:-1]):
        lifted = abs(sample.bottom_px - median(s.bottom_px for s in on_rim)) > BORDER_PX
        if lifted or abs(sample.u_px - visible[-1].u_px) > ASIDE_PX:
            break
        on_rim.append(sample)
    return on_rim[::-1]


def _common(a: float, b: float) -> float:
    return 0.0 if a * b <= 0 else min(abs(a), abs(b))
