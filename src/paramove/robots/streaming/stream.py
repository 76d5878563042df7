"""The stream to a robot: batches of target frames, each of which ends in its own stop ramp.

The next batch replaces the ramp from an index that is not yet played. So nothing has to be decided when batches stop
coming: the robot plays the ramp that it already has. `StreamReader` is the robot's side; it plays one frame a period
and rejects, as a whole, every batch that it could not play smoothly. HOAP-3's wire carries both sides' messages
(`robots/hoap3/wire.py`); a servo arm has both in one process.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Self

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, Ints
from paramove.robots import RobotDescription

Frames = NDArray[np.int16]
"""Joint units of a robot, [J], or [N, J] of N frames."""

MAX_FRAMES = 5000
# Accelerations are judged over spans of this length, at least one frame: over 1 ms, rounding to counts is larger than
# the limit.
SPAN_S = 0.004
BEYOND = float(np.deg2rad(2.0))
"""A joint that rests so far beyond its range, against its stop, may be held there; the gate judges how far it may."""


class Playing(IntEnum):
    """What a robot plays; the numbers are those of HOAP-3's wire."""

    UNSPECIFIED = 0
    NOTHING = 1
    FRAMES = 2
    STOP_RAMP = 3
    HELD = 4


@dataclass(frozen=True, eq=False)
class StreamBatch:
    """Frames to play.

    Attributes:
        epoch: Of the sender; new at each of its starts, not 0.
        first_index: Of the first frame; frames count from 0 since the epoch began.
        period_us: Of a frame.
        frames: [N, J], joint units of the robot.
        stop_ramp_frames: How many of the last frames are the stop ramp.
    """

    epoch: int
    first_index: int
    period_us: int
    frames: Frames
    stop_ramp_frames: int

    @classmethod
    def of(cls, description: RobotDescription, epoch: int, first_index: int, rows: Floats, ramp_rows: int) -> Self:
        """Encode rows of joint angles, [N, J] rad, of which the last `ramp_rows` are the stop ramp.

        Raises:
            JointRangeError: A value that the robot's integer units cannot hold.
        """
        frames = description.units.to_counts(rows, BEYOND)
        return cls(epoch, first_index, description.stream.period_us, frames, ramp_rows)


@dataclass(frozen=True, eq=False)
class StreamState:
    """What a robot reports of its stream and joints.

    Attributes:
        captured_ns: Time of the measurement.
        epoch: Of the stream being played; 0 before any.
        next_index: Of the frame to be played next.
        depth: Frames still to be played, the stop ramp included.
        playing: What the next frame is part of.
        counts: Measured joints, [J], joint units.
        target_counts: The frame that is played or held, [J]; empty from a robot that does not report it.
        rejected_batches: How many batches were rejected.
        rejection: Why the latest of them was.
    """

    captured_ns: int
    epoch: int
    next_index: int
    depth: int
    playing: Playing
    counts: Ints
    target_counts: Ints
    rejected_batches: int
    rejection: str


class StreamReader:
    """The robot's side of the stream: a buffer that is played one frame a millisecond.

    Args:
        description: Of the robot.
        held_counts: The frame that the robot holds before any batch, [J].

    Attributes:
        epoch: Of the stream being played; 0 before any.
        next_index: Of the frame to be played next.
        rejected_batches: How many batches were rejected.
        rejection: Why the latest of them was.
    """

    def __init__(self, description: RobotDescription, held_counts: Frames) -> None:
        self.epoch = 0
        self.next_index = 0
        self.rejected_batches = 0
        self.rejection = ""
        self._units = description.units
        self._period_us = description.stream.period_us
        period_s = self._period_us * 1e-6
        counts_per_rad = np.abs(description.units.counts_per_rad)
        # Each rounded frame is off by up to half a count, hence +1 for a step and +2 for a second difference.
        self._step = np.floor(counts_per_rad * description.velocity * period_s) + 1
        self._span = max(1, round(SPAN_S / period_s))
        self._bend = np.floor(counts_per_rad * description.stop_acceleration * (self._span * period_s) ** 2) + 2
        low, high = self._units.counts_range()
        self._low, self._high = np.minimum(low, held_counts), np.maximum(high, held_counts)  # what is held may stay
        # The last two spans of played frames, then the frames to come.
        self._played = np.repeat(np.asarray(held_counts, dtype=np.int16)[None], 2 * self._span, axis=0)
        self._coming = self._played[:0]
        self._ramp_frames = 0

    @property
    def depth(self) -> int:
        """Frames still to be played, the stop ramp included."""
        return len(self._coming)

    @property
    def at_rest(self) -> bool:
        """Whether nothing is left to be played."""
        return not len(self._coming)

    @property
    def playing(self) -> Playing:
        """What the next frame is part of."""
        if not self.epoch:
            return Playing.NOTHING
        if self.at_rest:
            return Playing.HELD
        return Playing.STOP_RAMP if self.depth <= self._ramp_frames else Playing.FRAMES

    @property
    def target(self) -> Frames:
        """The frame that was played last or is held, [J]."""
        return np.asarray(self._played[-1])

    def play(self) -> Frames:
        """The frame for the next millisecond, [J]; the held one if nothing is left."""
        if len(self._coming):
            frame = self._coming[0]
            self._coming = self._coming[1:]
            self._played = np.concatenate([self._played[1:], frame[None]])
            self.next_index += 1
        elif (self._played[0] != self._played[-1]).any():
            self._played = np.concatenate([self._played[1:], self._played[-1:]])
        return self.target

    def offer(self, batch: StreamBatch) -> bool:
        """Take a batch, or reject it as a whole and keep the buffer. Returns whether it was taken."""
        reason = self._error_of_form(batch) or self._error_of_index(batch) or self._error_of_frames(batch)
        if reason:
            self.reject(reason)
            return False
        if batch.epoch != self.epoch:
            self.epoch = batch.epoch
            self.next_index = batch.first_index
        n_before = batch.first_index - self.next_index
        self._coming = np.concatenate([self._coming[:n_before], batch.frames])
        self._ramp_frames = batch.stop_ramp_frames
        return True

    def reject(self, reason: str) -> None:
        """Count a batch that is not taken."""
        self.rejected_batches += 1
        self.rejection = reason

    def state(self, measured_counts: Frames | Ints, captured_ns: int) -> StreamState:
        """What the robot reports: its stream and its measured joints, [J] counts."""
        return StreamState(
            captured_ns,
            self.epoch,
            self.next_index,
            self.depth,
            self.playing,
            np.asarray(measured_counts, dtype=np.int64),
            self.target.astype(np.int64),
            self.rejected_batches,
            self.rejection,
        )

    def _error_of_form(self, batch: StreamBatch) -> str:
        n_joints = len(self._units.names)
        if not batch.epoch:
            return "epoch 0, a sender's epoch is 1 or more"
        if batch.period_us != self._period_us:
            return f"period {batch.period_us} us, allowed {self._period_us} us"
        if batch.frames.ndim != 2 or batch.frames.shape[1] != n_joints:
            return f"{batch.frames.shape[-1]} joints, allowed {n_joints}"
        n_frames = len(batch.frames)
        if not 1 <= n_frames <= MAX_FRAMES:
            return f"{n_frames} frames, allowed 1 to {MAX_FRAMES}"
        if batch.stop_ramp_frames > n_frames:
            return f"a stop ramp of {batch.stop_ramp_frames} frames, the batch has {n_frames}"
        return ""

    def _error_of_index(self, batch: StreamBatch) -> str:
        if batch.epoch != self.epoch:
            return "" if self.at_rest else f"epoch {batch.epoch} while {self.epoch} is played; allowed only at rest"
        if batch.first_index < self.next_index:
            return f"first index {batch.first_index}, played up to {self.next_index}: too late"
        end = self.next_index + self.depth
        if batch.first_index > end:
            return f"first index {batch.first_index}, allowed up to {end}: a gap"
        depth = batch.first_index + len(batch.frames) - self.next_index
        return "" if depth <= MAX_FRAMES else f"{depth} frames to be played, allowed {MAX_FRAMES}: the buffer is full"

    def _error_of_frames(self, batch: StreamBatch) -> str:
        n_before = batch.first_index - self.next_index if batch.epoch == self.epoch else 0
        frames, span = batch.frames, self._span
        before = np.concatenate([self._played, self._coming[:n_before]])[-2 * span :]
        whole = np.concatenate([before, frames, np.repeat(frames[-1:], 2 * span, axis=0)]).astype(np.float64)
        outside = (frames < self._low) | (frames > self._high)
        steps = np.abs(np.diff(whole[2 * span - 1 :], axis=0))
        bends = np.abs(whole[2 * span :] - 2 * whole[span:-span] + whole[: -2 * span])
        for values, bad, what in (
            (frames, outside, "{0:.0f} counts, allowed {1:.0f} to {2:.0f}"),
            (steps, steps > self._step, "a step of {0:.0f} counts from {5:.0f} to {6:.0f}, allowed {3:.0f}"),
            (bends, bends > self._bend, "speed changes by {0:.0f} counts in " + f"{span} frames, allowed {{4:.0f}}"),
        ):
            if bad.any():
                row, joint = (int(i) for i in np.argwhere(bad)[0])
                limits = (self._low[joint], self._high[joint], self._step[joint], self._bend[joint])
                step = whole[2 * span - 1 + row : 2 * span + 1 + row, joint]
                detail = what.format(values[row, joint], *limits, *step)
                return f"frame {row}, joint {self._units.names[joint]}: {detail}"
        return ""
