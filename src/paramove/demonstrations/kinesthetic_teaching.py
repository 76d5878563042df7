"""A person leads a servo arm by hand: each segment becomes a movement of a demonstration set. It reads no clock.

The points are those of `robots/pose_points.py`, and theta is the final position of the end effector.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from paramove.demonstrations.movement import DemonstrationError
from paramove.demonstrations.taught_set import TaughtSet, moved_part
from paramove.documents import Floats
from paramove.robots import ARM_BASE, POINT_NAMES, DescriptionError, RobotDescription, arm_points

RESTS_WITHIN_M = 0.002
"""The hand rests while it is within this distance of the segment's start, and while it stays as close to its end."""
NANO = 1e-9


class KinestheticTeacher:
    """Pass joint angles to `handle`; call `begin` and `end` on the person's commands.

    Args:
        description: Of an arm with a chain.
        folder: Of the set.
        action: The demonstrated action, such as reaching.
        subject: The person who demonstrates it.
        append: Whether the set may exist already.

    Attributes:
        taught: The set, which has each segment as soon as it has ended.

    Raises:
        DescriptionError: The robot has no such arm.
        DemonstrationError: There is a set and `append` is not given, or it has other parameters.
    """

    def __init__(
        self, description: RobotDescription, folder: Path, action: str, subject: str = "", *, append: bool = False
    ) -> None:
        if description.chain is None:
            raise DescriptionError(f"{description.name} has no chain in its robot.yaml: it is not a servo arm")
        self._chain = description.chain
        about = f"{description.name} led by hand; theta is where its end effector ends"
        self.taught = TaughtSet(folder, action, subject, about, append=append)
        self._samples: list[tuple[int, Floats]] | None = None

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
        if len(samples) < 2:
            raise DemonstrationError(
                "the segment has no frames: receive the arm's angles before it ends; it is left out"
            )
        time_ns = np.array([at_ns for at_ns, _ in samples], dtype=np.int64)
        angles = np.array([row for _, row in samples])
        joints = angles[:, self._chain.indices]
        hand = self._chain.kinematics.forward(joints).position
        moved = moved_part(hand, RESTS_WITHIN_M)
        positions = arm_points(self._chain, joints, angles[:, self._chain.gripper_index])
        target = np.asarray(hand[moved[1] - 1])
        self.taught.add(NANO * (time_ns - time_ns[0]), positions, POINT_NAMES, ARM_BASE, moved, target)
        return target
