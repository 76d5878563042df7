"""A person's movement model converted to a robot's arm (thesis 5.2.3).

The converted model keeps the correspondence between parameter and reached position: a movement synthesised
for a target in the robot's shoulder frame brings the gripper to that target.

Elbows between the demonstrated ones: interpolated as parts of an arm, not as points on their own.

The mean of the elbows of differently directed arms lies inside all of them: a shorter arm, turned about the line from
shoulder to gripper (thesis 5.2.7 finds up to 25 mm). Here lengths are interpolated as lengths, and the direction in
which the elbow leaves that line is carried to the new line by the smallest rotation before it is averaged.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.motion.reaching_movement import ArmPoses, ReachingMovement
from paramove.phmm import InterpolativePHMM, MovementDescription, ParameterGrid

_TINY = 1e-9
_MIN_RADIUS = 1e-6  # m; keeps the elbow's side known where the arm is straight
POINTS = ("shoulder", "elbow", "knuckle", "index", "thumb")
ElbowInterpolation = Literal["carried", "linear"]

_NEWTON_STEPS = 3


class RobotMovement(ReachingMovement):
    """The converted model: local state means of (elbow, gripper, finger to thumb) on the grid of targets.

    Args:
        model: Of a reaching action. Its description names the points shoulder, elbow, knuckle, index and thumb and the
            progress at which the target is reached and the object is last held.
        arm_length: l = a + b of the robot, m.
        elbow_interpolation: "carried" interpolates the elbow as part of an arm, "linear" as a point on its own, as the
            thesis does.

    Raises:
        ValueError: The model lacks a point or does not define when the target is reached.

    Attributes:
        grid: Targets in the robot's shoulder frame (t̂ of 5.2.3), m.
        means: [G, N, 9], m.
        shoulder: p̄, the demonstrator's mean shoulder, which is the origin here, [3], m, frame of the demonstrations.
    """

    def __init__(
        self, model: InterpolativePHMM, arm_length: float, elbow_interpolation: ElbowInterpolation = "carried"
    ) -> None:
        description = model.description or MovementDescription()
        person = points_of(model.means_, description.point_names)
        self.reach_state, self.release_state = grasp_states(description, model.n_states)
        self.shoulder = person["shoulder"].mean(axis=(0, 1))  # p̄
        elbow, gripper, _ = arm_of(person, self.shoulder)
        lengths = np.linalg.norm(elbow, axis=-1) + np.linalg.norm(gripper - elbow, axis=-1)
        self.scale = arm_length / float(lengths.max())  # s = l / l′
        self.means = np.concatenate(arm_of(person, self.shoulder), axis=-1) * self.scale  # (5.7)
        size = np.linalg.norm(self.means[..., 6:], axis=-1)
        self.o_min, self.o_max = float(size.min()), float(size.max())
        grid = model.grid_
        self.grid = ParameterGrid((grid.origin - self.shoulder) * self.scale, grid.edges * self.scale, grid.knots)
        self.centre = np.asarray(self.grid.points().mean(axis=0))
        self._elbow_interpolation = elbow_interpolation

    def converted(self, means: Floats, point_names: tuple[str, ...]) -> ArmPoses:
        """Converts other poses of the same person: scaled by s, relative to p̄ (5.7).

        Args:
            means: Body points, [K, 3 · points], m, frame of the demonstrations.
            point_names: Their names, in order.

        Raises:
            ValueError: A needed point is missing.
        """
        return ArmPoses(*(self.scale * part for part in arm_of(points_of(means, point_names), self.shoulder)))

    def parameter_for(self, state: int, gripper: ArrayLike) -> Floats:
        """Parameters [K, 3] for which the gripper in `state` is at the given points [K, 3] (thesis 5.1, 1b).

        The demonstrations miss their targets a little; a few Newton steps on the effect remove that.
        """
        target = np.atleast_2d(np.asarray(gripper, dtype=np.float64))
        parameter = target.copy()
        steps = 0.01 * np.eye(3)
        for _ in range(_NEWTON_STEPS):
            reached = self._gripper(state, parameter)
            columns = [(self._gripper(state, parameter + step) - reached) / 0.01 for step in steps]
            jacobian = np.stack(columns, axis=-1)
            parameter = parameter + np.linalg.solve(jacobian, (target - reached)[..., None])[..., 0]
        return parameter

    def within_training(self, target: ArrayLike) -> bool | None:
        """Whether the parameter of `target` [3] lies in the grid."""
        coordinates = self.grid.coordinates(self.parameter_for(self.reach_state, target))
        return bool(((coordinates >= 0.0) & (coordinates <= 1.0)).all())

    def means_at(self, parameters: Floats, state: int | None = None) -> Floats:
        """Weighted means of the local models around each parameter (5.2)-(5.4), corrected."""
        weights, corners = self._corners(parameters, state)
        means: Floats = np.einsum("kc,kc...->k...", weights, corners)
        if self._elbow_interpolation == "carried":
            means[..., :3] = interpolated_elbow(weights, corners[..., :3], corners[..., 3:6])
        return means

    def _gripper(self, state: int, parameters: Floats) -> Floats:
        weights, corners = self._corners(parameters, state)
        return np.asarray(np.einsum("kc,kcd->kd", weights, corners[..., 3:6]))

    def _corners(self, parameters: Floats, state: int | None) -> tuple[Floats, Floats]:
        """Weights [K, C] and means [K, C, N, 9] or [K, C, 9] of the grid points around each parameter."""
        indices, weights = self.grid.weights(self.grid.coordinates(parameters), clamped=False)
        means = self.means if state is None else self.means[:, state]
        return weights, np.asarray(means[indices])


def grasp_states(description: MovementDescription, n_states: int) -> tuple[int, int]:
    """States of arrival and of the beginning of the retreat, of a movement that grasps in between."""
    arrival, grasp, last = description.arrival, description.grasp, n_states - 1
    if not 0.0 < arrival < grasp < 1.0:
        raise ValueError(
            f"the model of {description.action!r} gives arrival {arrival} and grasp {grasp}; "
            "a reaching action has 0 < arrival < grasp < 1, or arrival 1 if it ends at the target"
        )
    return round(arrival * last), round(grasp * last)


def points_of(means: Floats, point_names: tuple[str, ...]) -> dict[str, Floats]:
    """The needed points [..., 3] by name, of means [..., 3 · points]; raises ValueError if one is missing."""
    missing = [name for name in POINTS if name not in point_names]
    if missing:
        raise ValueError(
            f"the model has the points {', '.join(point_names) or 'none'}; needed also: {', '.join(missing)}"
        )
    points = means.reshape(*means.shape[:-1], -1, 3)
    return {name: points[..., point_names.index(name), :] for name in POINTS}


def arm_of(person: dict[str, Floats], shoulder: Floats) -> tuple[Floats, Floats, Floats]:
    """Elbow q̃, gripper r̃ relative to a shoulder, and finger to thumb õ; [..., 3] each (5.2.3)."""
    gripper = np.mean([person["knuckle"], person["index"], person["thumb"]], axis=0)
    return person["elbow"] - shoulder, gripper - shoulder, person["thumb"] - person["index"]


def interpolated_elbow(weights: Floats, elbow: Floats, gripper: Floats) -> Floats:
    """Elbows of M weighted means of C arm poses each, in the frame of the shoulder.

    Where one pose has weight 1 the result is that pose's elbow. Weights sum to one; outside a grid some are negative.

    Args:
        weights: [M, C].
        elbow: Elbows of the arm poses, [M, C, ..., 3], m.
        gripper: Their grippers, the same shape; that of the result is their weighted mean.

    Returns:
        [M, ..., 3], m.
    """
    line = _mean(weights, gripper)
    upper_arm = _mean(weights, _length(elbow))
    forearm = _mean(weights, _length(gripper - elbow))
    distance = np.maximum(_length(line), _TINY)
    along_line = line / distance
    own_line = _unit(gripper)
    side = _unit(elbow - _dot(elbow, own_line) * own_line)  # (5.12), (5.13) of each pose
    carried = _mean(weights, carried_over(side, own_line, along_line[:, None]))
    carried = _unit(carried - _dot(carried, along_line) * along_line)
    middle = (upper_arm**2 + distance**2 - forearm**2) / (2.0 * distance)  # a cos β of (5.8)
    middle = np.clip(middle, -upper_arm, upper_arm)
    radius = np.sqrt(np.maximum(upper_arm**2 - middle**2, _MIN_RADIUS**2))
    return np.asarray(middle * along_line + radius * carried)


def carried_over(vectors: Floats, start: Floats, end: Floats) -> Floats:
    """`vectors` turned by the smallest rotation that takes unit vectors `start` to `end`. All [..., 3]."""
    axis = np.cross(start, end)
    cosine = _dot(start, end)
    return np.asarray(
        cosine * vectors + np.cross(axis, vectors) + axis * _dot(axis, vectors) / np.maximum(1.0 + cosine, _TINY)
    )


def _mean(weights: Floats, values: Floats) -> Floats:
    return np.asarray(np.einsum("mc,mc...->m...", weights, values))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.sum(a * b, axis=-1, keepdims=True))


def _length(v: Floats) -> Floats:
    return np.asarray(np.linalg.norm(v, axis=-1, keepdims=True))


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.maximum(_length(v), _TINY))
