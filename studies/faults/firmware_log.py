"""The simulated firmware's own log of the frames it played, judged against the limits of the robot's description."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paramove.robots import RobotDescription

FILE = "firmware_frames.int16"
SPAN = 8  # frames; over fewer, rounding to counts is larger than the limit of the acceleration


@dataclass(frozen=True)
class LargestStep:
    """The largest step of a joint between two frames, 1 ms apart, and the hardest change of speed.

    Attributes:
        share: Of the operating velocity, all joints; at most 1 is within the limits.
        joint: Which joint that was.
        counts: The step in the joint's units.
        at_ms: When, since the start of the run.
        bend_share: Of the stop acceleration, over 8 ms; at most 1 is within the limits.
        frames: How many frames were judged.
    """

    share: float
    joint: str
    counts: int
    at_ms: int
    bend_share: float
    frames: int

    @property
    def within_limits(self) -> bool:
        """Whether the arm never jumped."""
        return self.share <= 1.0 and self.bend_share <= 1.0


def read_frames(path: Path, n_joints: int) -> NDArray[np.int32]:
    """Frames played, [N, J] counts, one a millisecond; a last one that was cut off is left out."""
    raw = np.fromfile(path, dtype="<i2")
    whole = len(raw) // n_joints
    return raw[: whole * n_joints].reshape(whole, n_joints).astype(np.int32)


def largest_step(frames: NDArray[np.int32], robot: RobotDescription) -> LargestStep:
    """Judge frames [N, J] of counts. Half a count of rounding at each end of a step is allowed for."""
    if len(frames) < 2:
        return LargestStep(0.0, "", 0, 0, 0.0, len(frames))
    period_s = robot.stream.period_us * 1e-6
    per_rad = np.abs(robot.units.counts_per_rad)
    steps = np.abs(np.diff(frames, axis=0))
    shares = steps / (per_rad * robot.operating_velocity * period_s + 1.0)
    row, joint = (int(i) for i in np.unravel_index(int(np.argmax(shares)), shares.shape))
    bends = np.abs(frames[2 * SPAN :] - 2 * frames[SPAN:-SPAN] + frames[: -2 * SPAN])
    allowed = per_rad * robot.stop_acceleration * (SPAN * period_s) ** 2 + 2.0
    return LargestStep(
        share=float(shares[row, joint]),
        joint=robot.joint_names[joint],
        counts=int(steps[row, joint]),
        at_ms=row + 1,
        bend_share=float((bends / allowed).max(initial=0.0)),
        frames=len(frames),
    )
