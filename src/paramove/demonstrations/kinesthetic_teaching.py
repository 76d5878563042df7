"""A person leads a servo arm by hand: each segment becomes a movement of a demonstration set. It reads no clock.

The points are those of `robots/pose_points.py`, and theta is the final position of the end effector.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from paramove.demonstrations.labelling import next_repetition
from paramove.demonstrations.labels import FILE_NAME, Segment, load_labels
from paramove.demonstrations.movement import DemonstrationError
from paramove.demonstrations.writing import Label, Take, write_set
from paramove.documents import Floats, replacing
from paramove.robots import ARM_BASE, POINT_NAMES, DescriptionError, RobotDescription, arm_points

PARAMETERS = ("target_x", "target_y", "target_z")
RESTS_WITHIN_M = 0.002
"""The hand rests while it is within this distance of the segment's start, and while it stays as close to its end."""
RECORDING = "taught_{:03d}.mcap"
NANO = 1e-9


class KinestheticTeacher:
    """Pass joint angles to `handle`; call `begin`, `end` and `drop` on the person's commands.

    A segment is written as soon as it has ended, so that a later failure loses nothing.

    Args:
        description: Of an arm with a chain.
        folder: Of the set.
        action: The demonstrated action, such as reaching.
        subject: The person who demonstrates it.
        append: Whether the set may exist already.

    Attributes:
        written: Recordings of the segments that have ended, the latest last.

    Raises:
        DescriptionError: The robot has no such arm.
        DemonstrationError: There is a set and `append` is not given, or it has other parameters.
    """

    def __init__(
        self, description: RobotDescription, folder: Path, action: str, subject: str = "", *, append: bool = False
    ) -> None:
        if description.chain is None:
            raise DescriptionError(f"{description.name} has no chain in its robot.yaml: it is not a servo arm")
        self._chain, self._robot = description.chain, description.name
        self._folder, self._action, self._subject = folder, action, subject
        self._labels = folder / FILE_NAME
        self._before: list[bytes | None] = []
        self._samples: list[tuple[int, Floats]] | None = None
        self.written: list[str] = []
        if self._labels.exists():
            self._check_existing(append)

    def _check_existing(self, append: bool) -> None:
        if not append:
            raise DemonstrationError(
                f"{self._folder} holds a demonstration set already; choose another folder, or --append to it"
            )
        has = tuple(load_labels(self._labels).file.parameters)
        if has != PARAMETERS:
            raise DemonstrationError(
                f"{self._labels} has the parameters ({', '.join(has)}), teaching gives ({', '.join(PARAMETERS)}); "
                "choose another folder"
            )

    @property
    def is_recording(self) -> bool:
        """Whether a segment has begun."""
        return self._samples is not None

    def handle(self, at_ns: int, angles: Floats) -> None:
        """Adds the angles of all joints of the robot, [J] in its order, rad."""
        if self._samples is not None and (not self._samples or at_ns > self._samples[-1][0]):
            self._samples.append((at_ns, angles))

    def begin(self) -> None:
        """Begins a segment; an unfinished one is discarded."""
        self._samples = []

    def end(self) -> Floats:
        """Ends the segment and writes it.

        Returns:
            The final position of the end effector, [3], m, frame of the arm's base.

        Raises:
            DemonstrationError: None has begun, the arm was not moved, or it cannot be written; it is discarded.
        """
        samples, self._samples = self._samples, None
        if samples is None:
            raise DemonstrationError("no segment has begun")
        take = self._take(samples)
        before = self._labels.read_bytes() if self._labels.exists() else None
        description = f"{self._robot} led by hand; theta is where its end effector ends"
        write_set(self._folder, [take], PARAMETERS, description, add=True)
        self._before.append(before)
        self.written.append(take.recording)
        return np.array(take.labels[0].theta)

    def drop(self) -> str:
        """Deletes the latest finished segment of this session, its recording and its label.

        Returns:
            The name of its recording.

        Raises:
            DemonstrationError: There is none, or labels.yaml was changed since.
        """
        if not self.written:
            raise DemonstrationError("no segment of this session is left to drop")
        name = self.written[-1]
        segments = load_labels(self._labels).file.segments
        if not segments or segments[-1].recording != name:
            raise DemonstrationError(f"{self._labels} was changed meanwhile; take {name} out of it by hand")
        self.written.pop()
        before = self._before.pop()
        if before is None:
            self._labels.unlink()
        else:
            with replacing(self._labels) as unfinished:
                unfinished.write_bytes(before)
        (self._folder / name).unlink()
        return name

    def _take(self, samples: list[tuple[int, Floats]]) -> Take:
        if len(samples) < 2:
            raise DemonstrationError(
                "the segment has no frames: receive the arm's angles before it ends; it is left out"
            )
        time_ns = np.array([at_ns for at_ns, _ in samples], dtype=np.int64)
        angles = np.array([row for _, row in samples])
        joints = angles[:, self._chain.indices]
        hand = self._chain.kinematics.forward(joints).position
        first, end = moved_part(hand)
        theta = tuple(hand[end - 1].tolist())
        label = Label(first, end, self._action, theta, self._subject, self._repetition(theta))
        positions = arm_points(self._chain, joints, angles[:, self._chain.gripper_index])
        time = NANO * (time_ns - time_ns[0])
        return Take(self._free_name(), time, positions, POINT_NAMES, ARM_BASE, (label,))

    def _repetition(self, theta: tuple[float, ...]) -> int:
        there = load_labels(self._labels).file.segments if self._labels.exists() else []
        like = Segment(
            recording="any", start=0.0, end=1.0, action=self._action, theta=list(theta), subject=self._subject
        )
        return next_repetition(there, like)

    def _free_name(self) -> str:
        names = (RECORDING.format(number) for number in itertools.count(1))
        return next(name for name in names if not any(self._folder.glob(f"{name}*")))  # nor an unfinished one


def moved_part(hand: Floats) -> tuple[int, int]:
    """First frame, and one past the last, of a movement between the rests before and after it.

    Args:
        hand: Path, shape [T, 3], m.

    Raises:
        DemonstrationError: The hand does not move.
    """
    away = np.flatnonzero(np.linalg.norm(hand - hand[0], axis=1) > RESTS_WITHIN_M)
    on_the_way = np.flatnonzero(np.linalg.norm(hand - hand[-1], axis=1) > RESTS_WITHIN_M)
    if not away.size or not on_the_way.size:
        raise DemonstrationError(
            f"the hand was moved by less than {1e3 * RESTS_WITHIN_M:g} mm, or returned to its start; the "
            "segment is left out"
        )
    return max(0, int(away[0]) - 1), int(on_the_way[-1]) + 2
