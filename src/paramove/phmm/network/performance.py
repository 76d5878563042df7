"""Distribution of whole executions about the means of networks, by which a NeuralPHMM estimates theta.

As `CorrelatedRegression` for polynomials: a movement is one vector, the averages of its parts and its last frame, about
the predictions of the networks at theta, with a covariance that models dependent frames.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from paramove.documents import Floats, Ints
from paramove.phmm.correlated_regression import (
    SHRINKAGES,
    LeftOutFold,
    chosen_shrinkage,
    deviations_of,
    shrunk,
)
from paramove.phmm.left_out import folds_of, inflation_of
from paramove.phmm.network.networks import StateNetworks, hidden_units
from paramove.phmm.performance import part_averages
from paramove.phmm.ridge import residuals_left_out

Missed = Callable[[Floats], tuple[Floats, Floats]]

PARTS = 10
MAX_STEPS, TOLERANCE = 20, 1e-8
STEP_FRACTIONS = (1.0, 0.4, 0.16, 0.06)


@dataclass(frozen=True)
class StateAverages:
    """Averages of training movements in each state; the last frame counts as a further state.

    Attributes:
        positions: scaled theta, (K, P). features: monomials there, (K, F); jacobians: their slopes, (K, F, P).
        averages: shape (K, N + 1, D). weights: frames in each state, (K, N).
        ridge: of each column of Z and W2, in frames, (F + H,).
        groups: number of the group of each movement, (K,).
    """

    positions: Floats
    features: Floats
    jacobians: Floats
    averages: Floats
    weights: Floats
    ridge: Floats
    groups: Ints

    def chosen(self, own: Ints) -> StateAverages:
        """Some of the movements."""
        return StateAverages(
            self.positions[own], self.features[own], self.jacobians[own], self.averages[own], self.weights[own],
            self.ridge, self.groups[own],
        )  # fmt: skip

    def networks(self, inner: Floats) -> StateNetworks:
        """The best fit with these hidden units (N + 1, H, P + 1)."""
        columns = []
        for i, design in enumerate(self._designs(inner)):
            squares = design.T @ design + self._penalty(i)
            columns.append(np.linalg.solve(squares, design.T @ self.averages[:, i]).T)
        weights, n_features = np.stack(columns), self.features.shape[1]
        return StateNetworks(weights[..., :n_features], weights[..., n_features:], inner)

    def residuals_left_out_of_groups(self, inner: Floats) -> Floats:
        """Parts of the residuals of each movement from networks without its group. Shape (K, n)."""
        missed = np.stack(
            [
                residuals_left_out(self.averages[:, i], design, self._penalty(i), self.groups)
                for i, design in enumerate(self._designs(inner))
            ],
            axis=1,
        )
        return self.parts(missed)

    def parts(self, states: Floats) -> Floats:
        """`part_averages` of values of all states and the last frame (K, N + 1, D). Shape (K, n)."""
        return np.stack([parts_of(one, weights) for one, weights in zip(states, self.weights, strict=True)])

    def _penalty(self, state: int) -> Floats:
        """As strong, for averages, as the ridge is for frames; the last frame's is that of the last state."""
        frames = float(self.weights[:, min(state, self.weights.shape[1] - 1)].mean())
        return np.diag(self.ridge / frames + 1e-9)

    def _designs(self, inner: Floats) -> list[Floats]:
        hidden = hidden_units(inner, self.positions)
        return [np.concatenate([self.features, hidden[:, i]], axis=1) for i in range(len(inner))]


@dataclass(frozen=True)
class NetworkPerformances:
    """Parts of a movement are those of the networks at theta and e ~ N(0, C).

    Attributes:
        last: network of the last frame, as of one state.
        root: lower triangular L with C = L L', shape (n, n).
        inflation: factor on covariances of theta that gives regions their nominal coverage.
    """

    last: StateNetworks
    root: Floats
    inflation: float

    @classmethod
    def fitted(cls, observed: StateAverages, inner: Floats) -> NetworkPerformances:
        """Of networks with these hidden units (N, H, P + 1); the last frame has those of the last state."""
        inner = np.concatenate([inner, inner[-1:]])
        missed = observed.residuals_left_out_of_groups(inner)
        deviation = deviations_of(missed)
        folds = [
            _fold(observed.chosen(others), observed.chosen(tested), tested, inner, deviation)
            for tested, others in folds_of(observed.groups)
        ]
        shrinkage, excess, _, _ = chosen_shrinkage(folds, SHRINKAGES)
        inflation = inflation_of(excess, observed.positions.shape[1], len(np.unique(observed.groups)), minimum=1e-6)
        triangle = np.linalg.cholesky(shrunk(missed / deviation, shrinkage))
        whole = observed.networks(inner)
        last = StateNetworks(*(np.ascontiguousarray(one[-1:]) for one in (whole.skip, whole.outer, whole.inner)))
        return cls(last, np.ascontiguousarray(deviation[:, None] * triangle), inflation)

    def nearest(self, position: Floats, bound: float, missed: Missed) -> tuple[Floats, Floats]:
        """Scaled theta (P,) whose networks come nearest to a movement, and its widened covariance, both scaled.

        Gauss-Newton steps from `position` within +-`bound`, shortened while the distance would grow.

        Args:
            missed: parts of the movement minus those of the networks at a position, (n,), and their slopes (n, P).
        """
        right, wide = self._white(missed(position))
        for _ in range(MAX_STEPS):
            step = np.linalg.solve(wide.T @ wide + np.eye(len(position)) / bound**2, wide.T @ right)
            for fraction in STEP_FRACTIONS:
                candidate = np.clip(position + fraction * step, -bound, bound)
                candidate_white = self._white(missed(candidate))
                gain = float(right @ right - candidate_white[0] @ candidate_white[0])
                if gain >= 0.0:
                    break
            else:
                break
            position, (right, wide) = candidate, candidate_white
            if gain < TOLERANCE:
                break
        covariance = self.inflation * np.linalg.inv(wide.T @ wide + np.eye(len(position)) / bound**2)
        return position, covariance.astype(np.float64)

    def _white(self, values: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        white: Floats = solve_triangular(self.root, np.column_stack(values), lower=True, check_finite=False)
        return white[:, 0], white[:, 1:]

    def arrays(self) -> dict[str, Floats]:
        """Everything learned, for a file."""
        return {
            "last_skip": self.last.skip,
            "last_outer": self.last.outer,
            "performance_root": self.root,
            "performance_inflation": np.array([self.inflation]),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, Floats], networks: StateNetworks) -> NetworkPerformances:
        """From the result of `arrays`. Raises ValueError for shapes or values that do not fit."""
        last = StateNetworks(arrays["last_skip"], arrays["last_outer"], networks.inner[-1:])
        root, inflation = arrays["performance_root"], arrays["performance_inflation"]
        n_states, dim, _ = networks.skip.shape
        size = len(part_averages(np.zeros((n_states, dim)), np.ones(n_states), np.zeros((1, dim)), PARTS))
        if last.skip.shape != networks.skip[-1:].shape or last.outer.shape != networks.outer[-1:].shape:
            raise ValueError(f"the network of the last frame has shapes {last.skip.shape} and {last.outer.shape}")
        if root.shape != (size, size) or inflation.shape != (1,):
            raise ValueError(
                f"expected performance_root of shape ({size}, {size}) and one performance_inflation, "
                f"found {root.shape} and {inflation.shape}"
            )
        if not (np.diagonal(root) > 0).all() or not inflation[0] > 0:
            raise ValueError("expected performance_root with a positive diagonal and performance_inflation above 0")
        return cls(last, root, float(inflation[0]))


def parts_of(states: Floats, weights: Floats) -> Floats:
    """`part_averages` of values of all states and, last, of the last frame (N + 1, D). Shape (n,)."""
    return part_averages(states[:-1], weights, states[-1:], PARTS)


def _fold(others: StateAverages, tested: StateAverages, members: Ints, inner: Floats, deviation: Floats) -> LeftOutFold:
    networks = others.networks(inner)
    missed = tested.parts(tested.averages - networks.means(tested.positions, tested.features))
    slopes = []
    for position, jacobian, weights in zip(tested.positions, tested.jacobians, tested.weights, strict=True):
        of_states = np.moveaxis(networks.slopes(position, jacobian), 2, 0)
        slopes.append(np.stack([parts_of(one, weights) for one in of_states], axis=1) / deviation[:, None])
    return LeftOutFold(
        members, others.residuals_left_out_of_groups(inner) / deviation, missed / deviation, np.stack(slopes)
    )
