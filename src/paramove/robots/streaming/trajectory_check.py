"""The check of one trajectory while the arm's driver goes on: in slices, between which it can be stopped."""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from typing import Any

from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory
from paramove.safety import CheckedPath, MotionLimits, TrajectoryRejectedError, check_in_slices

AT_ONCE_S = 0.002
"""A part of the check begins no slice after so long, so that a stop waits for one slice more at most."""
POINTS_AT_ONCE = 1000


class TrajectoryCheck:
    """The check of a trajectory that begins at `start_index` of the stream.

    Args:
        message: The trajectory.
        begun_ns: When it was received, by the driver's clock.
        start_index: Of the row to be played next, with which its first row would be sent.
        commanded, limits, start_tolerance: See `paramove.safety.check_in_slices`.

    Attributes:
        path: Of a trajectory that passed; None before, and of one that did not.
        error: Why it is rejected; None before, and of one that passed.
    """

    def __init__(
        self,
        message: JointTrajectory,
        begun_ns: int,
        start_index: int,
        commanded: Floats,
        limits: MotionLimits,
        start_tolerance: ArrayLike,
    ) -> None:
        self.trajectory_id = message.id
        self.begun_ns = begun_ns
        self.start_index = start_index
        self.path: CheckedPath | None = None
        self.error: TrajectoryRejectedError | None = None
        self._slices = _slices(message, commanded, limits, start_tolerance)

    @property
    def is_over(self) -> bool:
        """Whether the trajectory has passed or is rejected."""
        return self.path is not None or self.error is not None

    def go_on(self, seconds: float = AT_ONCE_S) -> bool:
        """Checks for so long and one slice more at most; returns whether there is more to check."""
        until_s = time.perf_counter() + seconds
        while not self.is_over:
            try:
                next(self._slices)
            except StopIteration as end:
                self.path = end.value
            except TrajectoryRejectedError as error:
                self.error = error
            if time.perf_counter() > until_s:
                break
        return not self.is_over


def _slices(
    message: JointTrajectory, commanded: Floats, limits: MotionLimits, start_tolerance: ArrayLike
) -> Generator[None, None, CheckedPath]:
    times_s: list[float] = []
    positions: list[Sequence[float]] = []
    points: Any = message.points
    for first in range(0, len(points), POINTS_AT_ONCE):
        part = points[first : first + POINTS_AT_ONCE]
        times_s += [point.time_s for point in part]
        positions += [point.position_rad for point in part]
        yield
    path = yield from check_in_slices(list(message.joints), times_s, positions, commanded, limits, start_tolerance)
    return path
