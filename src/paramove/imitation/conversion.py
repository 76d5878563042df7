"""A person's movement model converted to a robot's arm (thesis 5.2.3).

The converted model keeps the correspondence between the parameter and the place that is reached: a movement synthesised
for a target in the robot's shoulder frame brings the gripper to that target.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.phmm import InterpolativePHMM, MovementDescription, ParameterGrid

FloatArray = NDArray[np.float64]

_POINTS = ("shoulder", "elbow", "knuckle", "index", "thumb")
_NEWTON_STEPS = 3


@dataclass(frozen=True)
class ArmPoses:
    """A sequence of K arm poses in the robot's shoulder frame, m.

    Attributes:
        elbow: q of 5.2.3, [K, 3].
        gripper: r, [K, 3].
        finger_to_thumb: o, [K, 3].
    """

    elbow: FloatArray
    gripper: FloatArray
    finger_to_thumb: FloatArray

    def __len__(self) -> int:
        return len(self.gripper)

    def __getitem__(self, states: slice) -> ArmPoses:
        return ArmPoses(self.elbow[states], self.gripper[states], self.finger_to_thumb[states])

    @classmethod
    def joined(cls, parts: list[ArmPoses]) -> ArmPoses:
        """One sequence after the other."""
        return cls(
            np.concatenate([p.elbow for p in parts]),
            np.concatenate([p.gripper for p in parts]),
            np.concatenate([p.finger_to_thumb for p in parts]),
        )

    def stacked(self) -> FloatArray:
        """All components side by side, [K, 9]."""
        return np.concatenate([self.elbow, self.gripper, self.finger_to_thumb], axis=1)

    @classmethod
    def from_stacked(cls, values: FloatArray) -> ArmPoses:
        """Inverse of `stacked`."""
        return cls(values[:, :3], values[:, 3:6], values[:, 6:])


@dataclass(frozen=True)
class RobotMovement:
    """The converted model: local state means of (elbow, gripper, finger to thumb) on the grid of targets.

    Attributes:
        grid: Targets in the robot's shoulder frame (t̂ of 5.2.3), m.
        means: [G, N, 9], m.
        scale: s = l / l′.
        o_min, o_max: Least and greatest distance of finger and thumb after scaling, m.
        reach_state: State in which the gripper is at the target, still open (T of 5.2.5).
        release_state: Last state in which the object is held (T′).
        duration: Mean duration of the demonstrations, s.
    """

    grid: ParameterGrid
    means: FloatArray
    scale: float
    o_min: float
    o_max: float
    reach_state: int
    release_state: int
    duration: float

    @classmethod
    def from_model(cls, model: InterpolativePHMM, arm_length: float) -> RobotMovement:
        """Convert a trained model of a reaching action.

        Args:
            model: Its description names the points shoulder, elbow, knuckle, index and thumb and the progress at which
                the target is reached and the object is last held.
            arm_length: l = a + b of the robot, m.

        Raises:
            ValueError: The model lacks a point or does not say where in the movement the target is reached.
        """
        description = model.description or MovementDescription()
        names = description.point_names
        missing = [name for name in _POINTS if name not in names]
        if missing:
            raise ValueError(
                f"the model has the points {', '.join(names) or 'none'}; needed also: {', '.join(missing)}"
            )
        if not 0.0 < description.arrival < description.grasp < 1.0:
            raise ValueError(
                f"the model of {description.action!r} gives arrival {description.arrival} and grasp "
                f"{description.grasp}; "
                "a reaching action has 0 < arrival < grasp < 1"
            )
        points = model.means_.reshape(*model.means_.shape[:2], -1, 3)  # [G, N, points, 3]
        place = {name: names.index(name) for name in _POINTS}
        shoulder = points[:, :, place["shoulder"]].mean(axis=(0, 1))  # p̄
        elbow = points[:, :, place["elbow"]] - shoulder
        gripper = points[:, :, [place["knuckle"], place["index"], place["thumb"]]].mean(axis=2) - shoulder  # r̃
        opening = points[:, :, place["thumb"]] - points[:, :, place["index"]]  # õ
        lengths = np.linalg.norm(elbow, axis=-1) + np.linalg.norm(gripper - elbow, axis=-1)
        scale = arm_length / float(lengths.max())  # s = l / l′
        means = np.concatenate([elbow, gripper, opening], axis=-1) * scale  # (5.7)
        size = np.linalg.norm(means[..., 6:], axis=-1)
        grid = ParameterGrid((model.grid_.origin - shoulder) * scale, model.grid_.edges * scale, model.grid_.knots)
        last = model.n_states - 1
        return cls(
            grid=grid,
            means=means,
            scale=scale,
            o_min=float(size.min()),
            o_max=float(size.max()),
            reach_state=round(description.arrival * last),
            release_state=round(description.grasp * last),
            duration=description.duration,
        )

    @property
    def n_states(self) -> int:
        """N, the number of states."""
        return int(self.means.shape[1])

    def poses(self, parameter: ArrayLike) -> ArmPoses:
        """State means for one parameter [3] of the grid: N poses (5.2)-(5.4), corrected."""
        return ArmPoses.from_stacked(self._means(np.asarray(parameter, dtype=np.float64)[None])[0])

    def poses_of_state(self, state: int, parameters: ArrayLike) -> ArmPoses:
        """One state's mean for K parameters [K, 3]: the sequences θ_T^t of 5.2.5 in which only t varies."""
        return ArmPoses.from_stacked(self._means(np.atleast_2d(np.asarray(parameters, dtype=np.float64)), state))

    def parameter_for(self, state: int, gripper: ArrayLike) -> FloatArray:
        """Parameters [K, 3] for which the gripper in `state` is at the given points [K, 3] (thesis 5.1, 1b).

        The demonstrations miss their targets a little; a few Newton steps on the effect remove that.
        """
        wanted = np.atleast_2d(np.asarray(gripper, dtype=np.float64))
        parameter = wanted.copy()
        steps = 0.01 * np.eye(3)
        for _ in range(_NEWTON_STEPS):
            reached = self.poses_of_state(state, parameter).gripper
            columns = [(self.poses_of_state(state, parameter + step).gripper - reached) / 0.01 for step in steps]
            jacobian = np.stack(columns, axis=-1)
            parameter = parameter + np.linalg.solve(jacobian, (wanted - reached)[..., None])[..., 0]
        return parameter

    def opening(self, finger_to_thumb: ArrayLike) -> FloatArray:
        """Normalised opening ξ of the gripper, [K], 1 open (after 5.24, corrected)."""
        size = np.linalg.norm(np.asarray(finger_to_thumb, dtype=np.float64), axis=-1)
        return np.asarray(np.clip((size - self.o_min) / (self.o_max - self.o_min), 0.0, 1.0))

    def _means(self, parameters: FloatArray, state: int | None = None) -> FloatArray:
        indices, weights = self.grid.weights(self.grid.coordinates(parameters), clamped=False)
        if state is None:
            return np.asarray(np.einsum("mc,mcnd->mnd", weights, self.means[indices]))
        return np.asarray(np.einsum("mc,mcd->md", weights, self.means[indices, state]))
