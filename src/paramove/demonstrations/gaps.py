"""Gaps in the recorded points: reported, and filled where they are short."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paramove.demonstrations.frame_times import is_uneven
from paramove.demonstrations.movement import at_times, runs
from paramove.documents import Floats

NEIGHBOURS = 5
"""Number of frames on each side of a gap that its spline goes through."""
LONGEST_CUBIC_S = 0.1
"""In longer gaps a cubic spline may overshoot far beyond the frames around."""


@dataclass(frozen=True)
class PointGap:
    """A point was lost from frame `first` until before frame `end`, for `duration` seconds between valid frames."""

    point: str
    first: int
    end: int
    duration: float

    def __str__(self) -> str:
        frames = f"frame {self.first}" if self.end - self.first == 1 else f"frames {self.first}-{self.end - 1}"
        length = "it is not valid on both sides" if np.isinf(self.duration) else f"{self.duration:.3g} s"
        return f"{self.point} in {frames} ({length})"


def gaps_within(gaps: Iterable[PointGap], first: int, end: int) -> list[PointGap]:
    """Those that lie in the frames from `first` to before `end`, at least in part."""
    return [gap for gap in gaps if gap.end > first and gap.first < end]


def gaps_in_words(gaps: Sequence[PointGap], maximum: int = 4) -> str:
    """Gaps as text; those beyond `maximum` are counted."""
    more = f" and {len(gaps) - maximum} more" if len(gaps) > maximum else ""
    return "; ".join(map(str, gaps[:maximum])) + more


def fill_gaps(
    time: Floats, positions: Floats, point_names: tuple[str, ...], max_gap: float
) -> tuple[Floats, list[PointGap], list[PointGap]]:
    """Fills gaps of at most `max_gap` seconds by a cubic spline through the frames around them.

    Where the times of these frames are uneven, or the gap is longer than 0.1 s, the spline stays between its
    neighbours (PCHIP).

    Args:
        time: Shape (T,), s, increasing.
        positions: Shape (T, P, 3); not finite where a point was lost.
        point_names: Of the P points.
        max_gap: Longest time between the frames before and after a gap that is filled, less one frame period.

    Returns:
        Positions, with NaN where nothing was filled; the filled gaps; those left open, which are too long or lie at
        the beginning or end. Valid positions are unchanged.
    """
    result = positions.copy()
    missing: NDArray[np.bool_] = np.asarray(~np.isfinite(positions).all(axis=-1))
    result[missing] = np.nan
    filled, left = [], []
    for point in np.flatnonzero(missing.any(axis=0)):
        valid_frames = np.flatnonzero(~missing[:, point])
        for first, end in runs(missing[:, point]):
            at_edge = first == 0 or end == len(time)
            duration = np.inf if at_edge else (time[end] - time[first - 1]) * (end - first) / (end - first + 1)
            gap = PointGap(point_names[point], first, end, float(duration))
            if duration > max_gap * (1.0 + 1e-9):
                left.append(gap)
                continue
            split = int(np.searchsorted(valid_frames, first))
            around = valid_frames[max(0, split - NEIGHBOURS) : split + NEIGHBOURS]
            even = duration <= LONGEST_CUBIC_S * (1.0 + 1e-9) and not is_uneven(time[around[0] : around[-1] + 1])
            result[first:end, point] = _between(time, positions[:, point], around, time[first:end], even=even)
            filled.append(gap)
    return result, filled, left


def _between(time: Floats, path: Floats, around: NDArray[np.intp], new_time: Floats, *, even: bool) -> Floats:
    if len(around) < 4:
        return at_times(new_time, time[around], path[around])
    from scipy.interpolate import CubicSpline, PchipInterpolator  # a third of a second, which only a gap should cost

    spline = CubicSpline if even else PchipInterpolator
    result: Floats = spline(time[around], path[around])(new_time)
    return result
