"""Any parametric HMM over the position that is reached, as a movement of a robot's arm (thesis 5.2.3).

Unlike the interpolation of a grid (`conversion.py`) this uses the state means of any model: linear, quadratic,
neural. A model of a movement that ends where it arrives, as when people touch something, has no retreat;
the hand then returns along its approach.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import Delaunay, QhullError

from paramove.documents import Floats
from paramove.motion.arm_pose import UnreachablePoseError
from paramove.motion.conversion import RobotMovement, arm_of, grasp_states, points_of
from paramove.motion.plans import centimetres
from paramove.motion.reaching_movement import ArmPoses, ReachingMovement
from paramove.motion.timing import minimum_jerk
from paramove.phmm import InterpolativePHMM, MovementDescription, ParametricHMM

WIDEST_AT = 0.7
"""Fraction of the path to an object at which a grasping hand is opened widest: 60 to 80 % (Jeannerod 1984)."""
_STEP = 0.005  # m, of the differences
_EXACT = 1e-7  # m
_NEWTON_STEPS = 25
_HALVINGS = 6
_FARTHEST = 5.0  # arm lengths, of a parameter from the middle of the training


class ModelledMovement(ReachingMovement):
    """The converted model. Lengths are scaled by s, and relative to the shoulder in each state.

    A person's trunk leans towards what is reached, the robot's does not: it takes over the movement of the arm alone.
    The parameter is the model's own, scaled and relative to the mean shoulder p̄.

    Args:
        model: Three parameters, the reached position; its description names the points shoulder, elbow, knuckle,
            index and thumb, and the progress of arrival: 1 for a movement that ends there, else that of the grasp too.
        arm_length: l = a + b of the robot, m.

    Raises:
        ValueError: The model lacks a point, has other parameters, or does not define when the target is reached.
    """

    def __init__(self, model: ParametricHMM, arm_length: float) -> None:
        self._model = model
        description = model.description or MovementDescription()
        self._names = description.point_names
        self._farthest = _FARTHEST * arm_length
        self._returns = not ends_at_target(description)
        self.begins_above_table = not self._returns
        self.reach_state, self.release_state = (
            grasp_states(description, model.n_states) if self._returns else (model.n_states - 1, model.n_states)
        )
        self._targets = targets = _targets_of(model)
        person = points_of(model.state_means(targets), self._names)
        elbow, gripper, across = arm_of(person, person["shoulder"])
        length = np.linalg.norm(elbow, axis=-1) + np.linalg.norm(gripper - elbow, axis=-1)
        self.scale = arm_length / float(length.max())  # s = l / l′
        self._shoulder = person["shoulder"].mean(axis=(0, 1))  # p̄
        self.centre = (targets.mean(axis=0) - self._shoulder) * self.scale
        size = self.scale * np.linalg.norm(across, axis=-1)
        self.o_min, self.o_max = float(size.min()), float(size.max())

    def parameter_for(self, state: int, gripper: ArrayLike) -> Floats:
        """Parameters [K, 3] for which the gripper in `state` is at the given points [K, 3] (thesis 5.1, 1b).

        Newton's method with steps that are halved until they come nearer; a linear model needs one step. Also outside
        the training's targets, as far as the model's movements go on to change with the target.

        Raises:
            UnreachablePoseError: There is no parameter for a point.
        """
        target = np.atleast_2d(np.asarray(gripper, dtype=np.float64))
        parameter: Floats = target + self.centre - self._gripper(state, self.centre[None])
        missed = target - self._gripper(state, parameter)
        for _ in range(_NEWTON_STEPS):
            if np.abs(missed).max() < _EXACT:
                return parameter
            parameter, missed = self._nearer(state, target, parameter, missed)
        worst = int(np.abs(missed).max(axis=1).argmax())
        if np.abs(missed[worst]).max() < _EXACT:
            return parameter
        raise UnreachablePoseError(self._no_parameter_message(target[worst], float(np.linalg.norm(missed[worst]))))

    def openings(self, states: ArmPoses) -> Floats:
        """ξ in all states: measured where the movement grasps, else opened on approach and closed on retreat."""
        if self._returns:
            return super().openings(states)
        there = minimum_jerk(np.clip(np.linspace(0.0, 1.0, len(states) // 2) / WIDEST_AT, 0.0, 1.0))
        return np.concatenate([there, there[::-1]])

    def within_training(self, target: ArrayLike) -> bool | None:
        """Whether the parameter of `target` [3] lies in the hull of the training's; None in files without them."""
        if self._model.training_theta_ is None:
            return None
        try:
            parameter = self.parameter_for(self.reach_state, target)[0]
        except UnreachablePoseError:
            return False
        return self._hull is not None and bool(self._hull.find_simplex(parameter[None])[0] >= 0)

    @cached_property
    def _hull(self) -> Delaunay | None:
        """Convex hull of the targets, without a margin; None if nothing lies between them: too few, or in one plane."""
        try:
            return Delaunay((self._targets - self._shoulder) * self.scale)
        except (QhullError, ValueError):
            return None

    def _nearer(self, state: int, target: Floats, parameter: Floats, missed: Floats) -> tuple[Floats, Floats]:
        """One step of Newton's method, halved where it would not come nearer."""
        steps = _STEP * np.eye(3)
        columns = [self._gripper(state, parameter + step) - self._gripper(state, parameter - step) for step in steps]
        jacobian = np.stack(columns, axis=-1) / (2.0 * _STEP)
        try:
            change = np.linalg.solve(jacobian, missed[..., None])[..., 0]
        except np.linalg.LinAlgError as error:
            raise UnreachablePoseError(
                self._no_parameter_message(target[0], float(np.linalg.norm(missed[0])))
            ) from error
        distance = np.linalg.norm(missed, axis=1)
        for _ in range(_HALVINGS):
            tried = self.centre + np.clip(parameter + change - self.centre, -self._farthest, self._farthest)
            left = target - self._gripper(state, tried)
            worse = np.linalg.norm(left, axis=1) > distance
            if not worse.any():
                break
            change = np.where(worse[:, None], 0.5 * change, change)
        return tried, left

    def _no_parameter_message(self, target: Floats, missed: float) -> str:
        description = self._model.description or MovementDescription()
        return (
            f"no movement of the model {description.action!r} brings the gripper to {centimetres(target)}, "
            f"the nearest is {100 * missed:.1f} cm away; its training reached no such position, and a linear "
            "model extrapolates farther than others"
        )

    def _gripper(self, state: int, parameters: Floats) -> Floats:
        return self.means_at(parameters, state)[..., 3:6]

    def means_at(self, parameters: Floats, state: int | None = None) -> Floats:
        """State means; those of a movement that ends at the target are followed by the same in reversed order."""
        means = self._model.state_means(parameters / self.scale + self._shoulder)
        last = 2 * self._model.n_states - 1
        if state is not None:
            means = means[:, state if self._returns else min(state, last - state)]
        elif not self._returns:
            means = np.concatenate([means, means[:, ::-1]], axis=1)
        person = points_of(means, self._names)
        return np.concatenate(arm_of(person, person["shoulder"]), axis=-1) * self.scale


def ends_at_target(description: MovementDescription) -> bool:
    """Whether the movement arrives with its last frame, as it does where no arrival and no grasp are named."""
    return description.arrival == 1.0 or (description.arrival < 0.0 and description.grasp < 0.0)


def _targets_of(model: ParametricHMM) -> Floats:
    """Targets [K, 3] that stand for all of the training."""
    if model.training_theta_ is not None:
        targets = model.training_theta_
    elif model.parameter_bounds_ is not None:
        targets = np.stack(np.meshgrid(*model.parameter_bounds_.T, indexing="ij"), axis=-1)
        targets = targets.reshape(-1, model.parameter_bounds_.shape[1])
    else:
        raise ValueError("the model is not trained: call fit first")
    if targets.shape[1] != 3:
        raise ValueError(f"expected a model of 3 parameters, the position that is reached; found {targets.shape[1]}")
    return targets


def robot_movement(model: ParametricHMM, arm_length: float) -> ReachingMovement:
    """The movement of a robot's arm of this length, m, by any model: a grid's with elbows as parts of an arm.

    Raises:
        ValueError: The model does not suit, see `RobotMovement` and `ModelledMovement`.
    """
    if isinstance(model, InterpolativePHMM) and not ends_at_target(model.description or MovementDescription()):
        return RobotMovement(model, arm_length)
    return ModelledMovement(model, arm_length)
