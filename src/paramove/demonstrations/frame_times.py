"""Times of frames: their usual period, frames that are missing between two, and times that cannot be right."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paramove.demonstrations.movement import DemonstrationError
from paramove.documents import Floats, Ints

MIN_RATE_HZ, MAX_RATE_HZ = 5.0, 1000.0
"""Rates at which human movement is recorded."""
UNEVEN = 0.5
"""Steps that differ from the period by more than this fraction of it are uneven."""
MISSING = 0.75
"""From this fraction of a period on, a longer step counts as missing frames."""
BURST = 0.25
"""A frame that follows within this fraction of the period is one of a burst: it was not captured at its time."""
LATE_FRAMES = 2
"""A frame that is at most so many periods late is not missing: the next ones follow in shorter steps."""
MAX_NEW_FRAMES = 1000
MAX_STRETCH = 100
"""Resampling gives at most this many frames, and this many times as many as there are."""


def period_of(time: Floats) -> float:
    """Usual time between two frames: the median, or with frames in bursts the mean without holes. Shape (T,), s.

    0 for fewer than two frames.
    """
    if len(time) < 2:
        return 0.0
    steps = np.diff(time)
    median = float(np.median(steps))
    longer = longer_step(time)
    if median >= BURST * longer:
        return median
    return float(steps[steps <= (1.0 + MISSING) * longer].mean())


def longer_step(time: Floats) -> float:
    """A step that 30 % exceed: longer than those within bursts, shorter than holes. Shape (T,), T >= 2, s."""
    return float(np.percentile(np.diff(time), 70))


def is_plausible(rate_hz: float) -> bool:
    """Whether human movement is recorded at this rate; with 0.1 % for rounded times."""
    return MIN_RATE_HZ * 0.999 <= rate_hz <= MAX_RATE_HZ * 1.001


def is_uneven(time: Floats) -> bool:
    """Whether the steps between frames differ so much that a cubic spline through them would overshoot."""
    steps = np.diff(time)
    return bool(len(steps) and (np.abs(steps - np.median(steps)) > UNEVEN * np.median(steps)).any())


def bursts(time: Floats) -> NDArray[np.bool_]:
    """Frames that follow the one before within a fraction of the period. Shape (T,)."""
    result = np.zeros(len(time), dtype=np.bool_)
    result[1:] = np.diff(time) < BURST * period_of(time)
    return result


def missing_frames(time: Floats) -> Ints:
    """How many frames are missing between each frame and the next. Shape (T - 1,).

    A frame whose time is late, so that the next ones follow in shorter steps, does not count as missing.
    """
    period = period_of(time)
    steps = np.diff(time)
    if period <= 0.0:
        return np.zeros(len(steps), dtype=np.int64)
    excess = steps / period - 1.0
    missing = np.where(excess > MISSING, np.rint(excess), 0.0)
    for long in np.flatnonzero((missing > 0.0) & (missing <= LATE_FRAMES)).tolist():
        caught_up = 0.0
        for short in excess[long + 1 : long + 2 + 2 * LATE_FRAMES]:
            if short > -UNEVEN:
                break
            caught_up -= short
        missing[long] = max(0.0, np.rint(excess[long] - caught_up))
    return np.minimum(missing, 2.0**62).astype(np.int64)


def longest_hole(time: Floats) -> float:
    """Duration of the most frames that are missing one after the other, s; 0 without. Shape (T,)."""
    return float(missing_frames(time).max(initial=0)) * period_of(time)


def check_stretch(n_frames: int, n_resampled: float, source: str) -> None:
    """Raises DemonstrationError if so few frames cannot become so many: times or a rate have another unit."""
    if n_resampled > max(MAX_NEW_FRAMES, MAX_STRETCH * n_frames):
        raise DemonstrationError(
            f"{source}: its {n_frames} frames would become {n_resampled:.3g} at the rate of the others; "
            "are its times in seconds? Import it again"
        )
