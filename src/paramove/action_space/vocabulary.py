"""The actions that a tracker knows: parametric HMMs of the arm pose, as tables for many particles (thesis 6.4.1)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from paramove.action_space.pose_kernels import write_polynomial_poses, write_tabled_poses
from paramove.demonstrations import table_place
from paramove.documents import Floats, InputError, Ints
from paramove.hmm import LeftRightHMM
from paramove.observation import BENT_POSE_POINTS, HAND, POSE_POINTS
from paramove.phmm import ParametricHMM, PolynomialPHMM

POSE_SIZES = (3 * len(POSE_POINTS), 3 * len(BENT_POSE_POINTS))
THETA_BOUNDS = (-0.2, 1.2)
PLACE_SIZE = 2
"""Components of one target (u, v); theta is one or more targets, the last of which is where the hand goes."""
MIN_APART = 0.15
"""Of the progress: nearer poses are similar because they are near, not because one mirrors the other."""
ALIKE = 0.10
"""m, root mean square over the three points of a pose: poses nearer than this may be confused."""


class PoseModel(Protocol):
    """The part of a parametric HMM that is needed here."""

    def state_means(self, theta: ArrayLike) -> Floats:
        """Means of all states for theta (M, P). Shape (M, N, D)."""
        ...

    def at(self, theta: ArrayLike) -> LeftRightHMM:
        """The HMM for theta (P,)."""
        ...


def table_target(theta: Floats) -> Floats:
    """Position on the table (..., 3), m, in the model's frame, of the last two components (u, v) of theta (..., P)."""
    return table_place(theta[..., -PLACE_SIZE:])


@dataclass(frozen=True)
class ActionModel:
    """One action a: poses for any theta and progress tau.

    Attributes:
        name: of the action.
        model: of poses (shoulder, elbow, hand, or also the wrist; m, frame of the default demonstrator's table); D = 9
            or 12.
        duration_s: mean duration T_a.
        parameter_names: one for each of the P components of theta, two components a target.
        bounds: theta stays within, (minimum, maximum) for every component.
        target: where the hand goes for theta (..., P), (..., 3), m, in the frame of the model.
        explained_variance: fraction of the variance of a pose that its deviation covers; few particles cover few
            components better. 1.0 retains all, as (6.3).
    """

    name: str
    model: PoseModel
    duration_s: float
    parameter_names: tuple[str, ...] = ("u", "v")
    bounds: tuple[float, float] = THETA_BOUNDS
    target: Callable[[Floats], Floats] = field(default=table_target, repr=False)
    explained_variance: float = 0.995

    def __post_init__(self) -> None:
        """Raises InputError for a duration, parameters or a model that no action can have."""
        if not (np.isfinite(self.duration_s) and self.duration_s > 0.0):
            raise InputError(f"action {self.name!r}: expected a positive duration, found {self.duration_s} s")
        if not self.parameter_names or len(self.parameter_names) % PLACE_SIZE:
            raise InputError(
                f"action {self.name!r}: expected one or more targets of {PLACE_SIZE} parameters, found the parameters "
                f"{list(self.parameter_names)}"
            )
        shape = self.state_means(self.centre[None]).shape[1:]
        if len(shape) != 2 or shape[1] not in POSE_SIZES:
            raise InputError(
                f"action {self.name!r}: expected a model of {POSE_SIZES[0]} numbers a frame (x, y, z of "
                f"{', '.join(POSE_POINTS)}), or {POSE_SIZES[1]} (and of the wrist), found {shape[-1]}; "
                "paramove.action_space.training makes one"
            )

    @classmethod
    def from_file_model(cls, model: ParametricHMM, target: Callable[[Floats], Floats] = table_target) -> Self:
        """From a trained model whose description names action, parameters and duration. Raises InputError otherwise."""
        description = model.description
        if description is None or description.duration <= 0.0:
            raise InputError("expected a model whose description names action and duration, found none")
        bounds = model.parameter_bounds_
        size = PLACE_SIZE if bounds is None else bounds.shape[1]
        names = description.parameter_names or ("u", "v")
        points = description.point_names
        if len(points) == len(BENT_POSE_POINTS) and points[-1] != BENT_POSE_POINTS[-1]:
            raise InputError(
                f"action {description.action!r}: expected the points {BENT_POSE_POINTS}, found {tuple(points)}"
            )
        if len(names) != size:
            raise InputError(f"action {description.action!r}: expected {size} names of parameters, found {list(names)}")
        return cls(description.action, model, description.duration, names, target=target)

    @property
    def n_parameters(self) -> int:
        """P."""
        return len(self.parameter_names)

    @property
    def pose_size(self) -> int:
        """D, 9 or 12."""
        return int(self.factors.shape[1])

    @property
    def n_deviations(self) -> int:
        """R, components of a deviation."""
        return int(self.factors.shape[2])

    @property
    def centre(self) -> Floats:
        """The middle theta, (P,)."""
        return np.full(self.n_parameters, 0.5)

    def state_means(self, theta: Floats) -> Floats:
        """Means of all states for theta (M, P). Shape (M, N, D)."""
        return np.asarray(self.model.state_means(theta), dtype=np.float64)

    @cached_property
    def factors(self) -> Floats:
        """F_i of each state: F_i z with standard normal z (R,) has the covariance (6.3). Shape (N, D, R).

        Symmetric roots, which change as smoothly as the covariances, times the directions that vary most on average;
        interpolated like the means. The covariances are those of the middle theta.
        """
        covariances = np.asarray(self.model.at(self.centre).covariances_, dtype=np.float64)
        values, vectors = np.linalg.eigh(covariances)
        roots = (vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]) @ np.swapaxes(vectors, 1, 2)
        pooled, directions = np.linalg.eigh(covariances.mean(axis=0))
        explained = np.cumsum(pooled[::-1]) / max(float(pooled.sum()), 1e-300)
        n_directions = min(int(np.searchsorted(explained, self.explained_variance - 1e-12)) + 1, len(pooled))
        return np.ascontiguousarray(roots @ directions[:, ::-1][:, :n_directions])

    @cached_property
    def middle_means(self) -> Floats:
        """State means of the middle theta, (N, D)."""
        return np.asarray(self.state_means(self.centre[None])[0])

    @cached_property
    def mirrored(self) -> Floats:
        """For each state the progress of a similar pose in the opposite direction; -1: none. (N,)."""
        n_states = len(self.middle_means)
        distances = np.linalg.norm(self.middle_means[:, None] - self.middle_means[None], axis=2) / np.sqrt(
            self.pose_size / 3
        )
        number = np.arange(n_states)
        distances[np.abs(number[:, None] - number) < MIN_APART * n_states] = np.inf
        nearest = distances.argmin(axis=1)
        return np.asarray(np.where(distances.min(axis=1) <= ALIKE, nearest / max(n_states - 1, 1), -1.0))

    @cached_property
    def place_dependence(self) -> Floats:
        """How much the hand of each state depends on each target of theta, 0 (not at all) to 1 (most). (P / 2, N)."""
        sizes = np.zeros((self.n_parameters // PLACE_SIZE, len(self.middle_means)))
        for component in range(self.n_parameters):
            step = np.zeros(self.n_parameters)
            step[component] = 0.25
            ends = self.state_means(np.stack([self.centre + step, self.centre - step]))
            sizes[component // PLACE_SIZE] += ((ends[0] - ends[1])[:, HAND] ** 2).sum(axis=1)
        sizes = np.sqrt(sizes)
        return np.asarray(sizes / np.maximum(sizes.max(axis=1, keepdims=True), 1e-12))

    def at_progress(self, table: Floats, tau: Floats) -> Floats:
        """A table with one value per state (N,), interpolated at tau (M,)."""
        return np.asarray(np.interp(tau, np.linspace(0.0, 1.0, len(table)), table))

    def poses(self, theta: ArrayLike, tau: ArrayLike, deviation: ArrayLike | None = None) -> Floats:
        """Mean poses (6.2), or with deviations (M, R) poses of the density (6.3). (M, P), (M,) -> (M, D)."""
        places = np.atleast_2d(np.asarray(theta, dtype=np.float64))
        progress = np.broadcast_to(np.asarray(tau, dtype=np.float64), len(places))
        drawn = np.zeros((len(places), self.n_deviations)) if deviation is None else np.asarray(deviation, np.float64)
        poses = np.empty((len(places), self.pose_size))
        self.write_poses(np.arange(len(places)), places, progress, drawn, poses)
        return poses

    def write_poses(self, rows: Ints, theta: Floats, tau: Floats, deviation: Floats, poses: Floats) -> None:
        """Writes poses[rows] (M, D) of particles theta (M, >= P), tau (M,), deviation (M, >= R)."""
        if isinstance(self.model, PolynomialPHMM):
            monomials = self.model.monomials_
            write_polynomial_poses(
                rows, theta, tau, deviation, self.model.coefficients_, monomials.exponents, monomials.centre,
                monomials.scale, self.factors, poses
            )  # fmt: skip
            return
        means = np.ascontiguousarray(self.state_means(theta[rows, : self.n_parameters]))
        write_tabled_poses(rows, means, tau, deviation, self.factors, poses)


class Vocabulary:
    """The actions, numbered in the order given.

    Raises InputError for no action, two of one name, or poses only some of which have a wrist.
    """

    def __init__(self, actions: Sequence[ActionModel]) -> None:
        names = [action.name for action in actions]
        if not names or len(set(names)) < len(names):
            raise InputError(f"expected one or more actions of different names, found {names}")
        sizes = {action.name: action.pose_size for action in actions}
        if len(set(sizes.values())) > 1:
            raise InputError(
                f"expected poses of the same size for all actions, found {sizes}: train all of them with the "
                "wrist, or none"
            )
        self.actions = tuple(actions)
        self.pose_size = actions[0].pose_size

    @property
    def names(self) -> tuple[str, ...]:
        """Of the actions."""
        return tuple(action.name for action in self.actions)

    @cached_property
    def n_parameters(self) -> int:
        """Largest P: theta of actions with fewer components is padded behind."""
        return max(action.n_parameters for action in self.actions)

    @cached_property
    def n_deviations(self) -> int:
        """Largest R."""
        return max(action.n_deviations for action in self.actions)

    def __len__(self) -> int:
        return len(self.actions)

    def index(self, name: str) -> int:
        """Number of an action."""
        return self.names.index(name)

    def poses(self, action: Ints, theta: Floats, tau: Floats, deviation: Floats) -> Floats:
        """Poses (M, D), m, in the frame of the models, for action (M,), theta (M, P), tau (M,), deviation (M, R)."""
        poses = np.empty((len(action), self.pose_size))
        for number, model in enumerate(self.actions):
            rows = np.flatnonzero(action == number)
            if len(rows):
                model.write_poses(rows, theta, tau, deviation, poses)
        return poses
