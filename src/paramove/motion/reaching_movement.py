"""A reaching movement as a robot's arm makes it: the interface that the relocation action needs, for any model."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.documents import Floats


@dataclass(frozen=True)
class ArmPoses:
    """A sequence of K arm poses in the robot's shoulder frame, m.

    Attributes:
        elbow: q of 5.2.3, [K, 3].
        gripper: r, [K, 3].
        finger_to_thumb: o, [K, 3].
    """

    elbow: Floats
    gripper: Floats
    finger_to_thumb: Floats

    def __len__(self) -> int:
        return len(self.gripper)

    def __getitem__(self, states: slice | NDArray[np.intp]) -> ArmPoses:
        return ArmPoses(self.elbow[states], self.gripper[states], self.finger_to_thumb[states])

    def stacked(self) -> Floats:
        """All components side by side, [K, 9]."""
        return np.concatenate([self.elbow, self.gripper, self.finger_to_thumb], axis=1)

    @classmethod
    def from_stacked(cls, values: Floats) -> ArmPoses:
        """Inverse of `stacked`."""
        return cls(values[:, :3], values[:, 3:6], values[:, 6:])


class ReachingMovement(ABC):
    """A family of movements over the position that is reached, converted to a robot's arm (thesis 5.2.3).

    Attributes:
        centre: Mean target of the training, [3], m, robot's shoulder frame.
        scale: s = l / l′.
        o_min, o_max: Minimum and maximum distance of finger and thumb after scaling, m.
        reach_state: State in which the gripper is at the target, still open (T of 5.2.5).
        release_state: State in which the hand begins to go back (T′).
        begins_above_table: Whether the hand comes from above the table, as that of people who sit at it; otherwise it
            comes from next to the body, where the robot's own hangs.
    """

    centre: Floats
    scale: float
    o_min: float
    o_max: float
    reach_state: int
    release_state: int
    begins_above_table: bool = False

    @abstractmethod
    def means_at(self, parameters: Floats, state: int | None = None) -> Floats:
        """Elbow, gripper, finger to thumb for K parameters [K, 3]: all states, [K, N, 9], or one, [K, 9] (5.7)."""

    @abstractmethod
    def parameter_for(self, state: int, gripper: ArrayLike) -> Floats:
        """Parameters [K, 3] for which the gripper in `state` is at the given points [K, 3] (thesis 5.1, 1b)."""

    @abstractmethod
    def within_training(self, target: ArrayLike) -> bool | None:
        """Whether the gripper is at `target` [3] in a movement between the demonstrated ones; None if unknown.

        Between: the parameter lies in the convex hull of the targets of the training.
        """

    def openings(self, states: ArmPoses) -> Floats:
        """Normalised openings ξ of the gripper, 1 open, in the states of a movement, [N] (after 5.24, corrected)."""
        size = np.linalg.norm(states.finger_to_thumb, axis=-1)
        return np.asarray(np.clip((size - self.o_min) / (self.o_max - self.o_min), 0.0, 1.0))

    def poses(self, parameter: ArrayLike) -> ArmPoses:
        """All states for one parameter [3]."""
        return ArmPoses.from_stacked(self.means_at(np.asarray(parameter, dtype=np.float64)[None])[0])

    def poses_of_state(self, state: int, parameters: ArrayLike) -> ArmPoses:
        """One state for K parameters [K, 3]: the sequences θ_T^t of 5.2.5 in which only t varies."""
        return ArmPoses.from_stacked(self.means_at(np.atleast_2d(np.asarray(parameters, dtype=np.float64)), state))

    def approach(self, target: ArrayLike) -> tuple[ArmPoses, Floats]:
        """States 1..T of the movement that brings the gripper to `target` [3], and the openings."""
        poses = self.poses(self.parameter_for(self.reach_state, target)[0])
        last = self.reach_state + 1
        return poses[:last], self.openings(poses)[:last]

    def retreat(self, target: ArrayLike) -> tuple[ArmPoses, Floats]:
        """States T′..N of the movement that leaves `target` [3], and the openings."""
        poses = self.poses(self.parameter_for(self.release_state, target)[0])
        return poses[self.release_state :], self.openings(poses)[self.release_state :]
