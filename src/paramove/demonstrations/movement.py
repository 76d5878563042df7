"""One labelled movement of an arm, its checks, and paths at other times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, InputError

Side = Literal["right", "left"]
AXIS_ENDINGS = ("_x", "_y", "_z")
TARGET_NAMES = ("target_x", "target_y", "target_z")
"""Parameters of a movement to a position."""
POINTS_FIRST = ("index", "wrist", "hand")
"""Which point is drawn if none is named: the first of these that there is, else the last point."""


class DemonstrationError(InputError):
    """A demonstration, its labels or a file of motion capture cannot be used; the message names it and the remedy."""


@dataclass(frozen=True)
class Movement:
    """One movement with its labels.

    Attributes:
        time: from the first frame, which is 0, increasing. Shape (T,), s; T is at least 2.
        positions: of the body points. Shape (T, P, 3), m, in `frame`.
        point_names: of the P points.
        frame: coordinate frame of the positions: x forward, y left, z up, unless the recording defines others.
        action: what is done.
        theta: the movement's parameters. Shape (Q,).
        parameter_names: of the Q components of theta.
        subject: who does it; "" if unknown.
        repetition: counts movements with the same action, theta and subject.
        side: the arm that moves.
        recording: name of the file, without folder, that it comes from.
        source: where it comes from, for errors: file and line of the label, recording, start and end.

    Raises DemonstrationError, which names the source, for a single frame, numbers that are not finite, times that do
    not increase, and shapes that do not fit.
    """

    time: Floats
    positions: Floats
    point_names: tuple[str, ...]
    frame: str
    action: str
    theta: Floats
    parameter_names: tuple[str, ...] = ()
    subject: str = ""
    repetition: int = 0
    side: Side = "right"
    recording: str = "movements.mcap"
    source: str = "a movement"

    def __post_init__(self) -> None:
        fault = self._wrong()
        if fault:
            raise DemonstrationError(f"{self.source}: {fault}")

    @property
    def frames(self) -> Floats:
        """Positions with x, y, z of all points stacked. Shape (T, 3 P), m."""
        return self.positions.reshape(len(self.positions), -1)

    @property
    def duration(self) -> float:
        """From the first to the last frame, s."""
        return float(self.time[-1])

    @property
    def rate_hz(self) -> float:
        """Mean frame rate."""
        return (len(self.time) - 1) / self.duration

    def point(self, name: str) -> Floats:
        """Path of one point. Shape (T, 3), m. Raises DemonstrationError that names the points there are."""
        if name not in self.point_names:
            raise DemonstrationError(
                f"{self.source}: there is no point '{name}'; there are {', '.join(self.point_names)}. "
                "Names are given when a file is imported, with --point or --mapping"
            )
        return self.positions[:, self.point_names.index(name)]

    def _wrong(self) -> str:
        length = len(self.time)
        if self.positions.shape != (length, len(self.point_names), 3):
            return (
                f"positions have shape {self.positions.shape}, expected ({length}, {len(self.point_names)}, 3) "
                "for the times and points"
            )
        if self.theta.shape != (len(self.parameter_names),):
            return f"theta has shape {self.theta.shape}, the parameters are {list(self.parameter_names)}"
        if length < 2:
            return f"{length} frame; a movement has at least 2. Give it a longer time between start and end"
        if self.time[0] != 0.0 or not (np.diff(self.time) > 0.0).all():
            return "times do not begin at 0 and increase"
        bad: NDArray[np.bool_] = np.asarray(~np.isfinite(self.positions).all(axis=(1, 2)))
        if bad.any():
            return f"positions that are not finite in frames {frame_ranges(bad)}; leave these frames out"
        return "" if np.isfinite(self.theta).all() else "theta is not finite"


def at_times(new_times: Floats, times: Floats, values: Floats) -> Floats:
    """Values (T, D) at other times, linearly interpolated. (len(new_times), D)."""
    return np.stack([np.interp(new_times, times, column) for column in values.T], axis=1)


def position_in_theta(parameter_names: tuple[str, ...]) -> slice | None:
    """Which components of theta are a position in space: three that follow each other and end in _x, _y, _z."""
    for first in range(len(parameter_names) - 2):
        three = parameter_names[first : first + 3]
        stems = {name.removesuffix(ending) for name, ending in zip(three, AXIS_ENDINGS, strict=True)}
        if len(stems) == 1 and all(name.endswith(ending) for name, ending in zip(three, AXIS_ENDINGS, strict=True)):
            return slice(first, first + 3)
    return None


def frame_ranges(marked: NDArray[np.bool_]) -> str:
    """Marked frames as text: '3-7, 12'; ranges beyond the sixth are counted."""
    ranges = [f"{first}" if end - first == 1 else f"{first}-{end - 1}" for first, end in runs(marked)]
    return ", ".join(ranges[:6]) + (f" and {len(ranges) - 6} more ranges" if len(ranges) > 6 else "")


def runs(marked: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Runs of marked frames: first, one past the last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
