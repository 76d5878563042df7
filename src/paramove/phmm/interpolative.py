"""The interpolative parametric HMM: multilinear interpolation of synchronised local HMMs on a grid (thesis 3.4).

States of all local HMMs model the same part of the movement (3.4.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.hmm import (
    LeftRightHMM,
    Parameters,
    Statistics,
    TrainingOptions,
    covariances_of,
    durations_of,
    regularisation_at,
    root_mean_deviation,
)
from paramove.phmm import interpolation_kernels
from paramove.phmm.description import MovementDescription
from paramove.phmm.estimates import ParameterEstimate
from paramove.phmm.features import Monomials
from paramove.phmm.grid import ParameterGrid
from paramove.phmm.noise import AddedNoise
from paramove.phmm.parametric import ParametricHMM, Residuals, inverse_information
from paramove.phmm.storage import check_shapes, check_states

REMEDY = "demonstrate every point of a grid, or train a QuadraticPHMM, which needs none"
SEARCH_TOLERANCE = 1e-7
"""Relative change of the log-likelihood at which the search within a region ends."""
CONTRADICTED = 1e10
"""Minus the log-likelihood, for the search, where the durations contradict the sequence."""


def synchronised(
    global_parameters: Parameters, groups: Sequence[Sequence[Floats]], options: TrainingOptions, iterations: int
) -> list[Parameters]:
    """One local model per group of sequences, aligned by the global model.

    The first E-step uses the global model's responsibilities and gives the means (3.7), which are then fixed; further
    steps refine covariances and durations. Each covariance is shrunk to the mean of its state over all groups (few
    frames per state make a full covariance singular).
    """
    first = [Statistics.gathered(global_parameters, group) for group in groups]
    means = [statistics.means() for statistics in first]  # Equation (3.7)
    scale = root_mean_deviation([sequence for group in groups for sequence in group])
    local = _refined(first, means, global_parameters.d_min, options, scale)
    for _ in range(iterations - 1):
        gathered = [Statistics.gathered(one, group) for one, group in zip(local, groups, strict=True)]
        local = _refined(gathered, means, global_parameters.d_min, options, scale)
    return local


def _refined(
    gathered: Sequence[Statistics], means: Sequence[Floats], d_min: int, options: TrainingOptions, scale: float
) -> list[Parameters]:
    scatters = [one.scatter(mean) for one, mean in zip(gathered, means, strict=True)]
    weights = [one.weight for one in gathered]
    # Broadcast over states: the target of state i is the mean of state i over the groups.
    target = np.sum(scatters, axis=0) / np.sum(weights, axis=0)[:, None, None]
    regularisation = regularisation_at(options.annealing_iterations, options, scale, target)  # annealing is over
    return [
        Parameters(
            mean,
            covariances_of(scatter, weight, regularisation),
            durations_of(one.durations, d_min, options.duration_pseudocount),
            d_min,
        )
        for one, mean, scatter, weight in zip(gathered, means, scatters, weights, strict=True)
    ]


class InterpolativePHMM(ParametricHMM):
    """Local HMMs at the points of a grid of any size and dimension, interpolated in between (3.6), (3.8)-(3.10).

    Outside the grid the means extrapolate; the weights of covariances and durations are clamped (corrected). (3.6) is
    applied to the duration distributions p_i(d), which for d_max = d_min + 1 is the same as interpolating transitions.

    Args:
        n_states, d_min, d_max, options, resampled_frames, description: as in `ParametricHMM`.
        corners: for a cuboid that is not axis-parallel: theta of (0, 0, ..), (1, 0, ..), (0, 1, ..), ..; (P + 1, P).
        shape: grid lines per dimension; with `corners` only. Without them the grid follows from theta.
        local_iterations: EM steps of the local models, the first with the global responsibilities.
        residuals: "correlated" learns how whole executions vary and depend on theta, by a polynomial: `estimate` then
            models dependent frames, its covariance is realistic, beginnings and outliers are recognised. "independent"
            is the thesis: maximum likelihood of frames.
        search_margin: how far outside the grid `estimate` searches, as a fraction of the grid.

    Attributes:
        grid_: the ParameterGrid.
        means_: shape (G, N, D), grid points with the last dimension fastest.
        covariances_: shape (G, N, D, D).
        durations_: shape (G, N, d_max).
        performances_: distribution of whole executions; None with independent residuals.
    """

    _prepared: tuple[Any, ...] | None = None

    def __init__(
        self,
        n_states: int = 20,
        d_min: int | None = None,
        d_max: int | None = None,
        *,
        options: TrainingOptions | None = None,
        resampled_frames: int | None = None,
        description: MovementDescription | None = None,
        corners: tuple[tuple[float, ...], ...] | None = None,
        shape: tuple[int, ...] | None = None,
        local_iterations: int = 4,
        residuals: Residuals = "correlated",
        search_margin: float = 0.25,
    ) -> None:
        super().__init__(
            n_states, d_min, d_max, options=options, resampled_frames=resampled_frames, description=description
        )
        self.corners = corners
        self.shape = shape
        self.local_iterations = local_iterations
        self.residuals = residuals
        self.search_margin = search_margin

    def _fit(self, sequences: list[Floats], theta: Floats, groups: Ints) -> None:
        if self.corners is None:
            grid = ParameterGrid.from_theta(theta)
        else:
            grid = ParameterGrid.from_corners(self.corners, self.shape or (2,) * theta.shape[1])
        at_points = grouped(sequences, theta, grid)
        options = self._training_options()
        everything = LeftRightHMM(self.n_states, self.d_min_, self.d_max_, options=options).fit(sequences)
        local = synchronised(everything.parameters, at_points, options, self.local_iterations)
        self.training_ = everything.training_
        self._set_grid(grid)
        self.means_ = np.stack([one.means for one in local])
        self.covariances_ = np.stack([one.covariances for one in local])
        self.durations_ = np.stack([one.durations for one in local])

    def _set_grid(self, grid: ParameterGrid) -> None:
        """Executions depend on theta by a quadratic polynomial, or a cubic one if the grid has as many lines."""
        self.grid_, self._prepared = grid, None
        self.monomials_ = Monomials.of_degree(3 if max(grid.shape) > 3 else 2, grid.points())

    def at(self, theta: ArrayLike) -> LeftRightHMM:
        """The interpolated HMM for theta (P,)."""
        values = self._checked_theta(theta)  # raises if the model is not trained
        coordinates = self.grid_.coordinates(values)[None, :]
        indices, weights = self.grid_.weights(coordinates, clamped=False)
        means = np.tensordot(weights[0], self.means_[indices[0]], axes=1)
        indices, weights = self.grid_.weights(coordinates, clamped=True)
        covariances = np.tensordot(weights[0], self.covariances_[indices[0]], axes=1)
        durations = np.tensordot(weights[0], self.durations_[indices[0]], axes=1)
        return LeftRightHMM.from_parameters(Parameters(means, covariances, durations, self.d_min_), self.options)

    def state_means(self, theta: ArrayLike) -> Floats:
        """Means of all states for one theta (P,) or many (M, P) (5.2)-(5.4, corrected). Shape (N, D) or (M, N, D)."""
        values = self._checked_theta(theta)  # raises if the model is not trained
        coordinates = self.grid_.coordinates(values)
        indices, weights = self.grid_.weights(np.atleast_2d(coordinates), clamped=False)
        means = np.einsum("mc,mcnd->mnd", weights, self.means_[indices])
        return cast(Floats, means[0] if coordinates.ndim == 1 else means)

    def _most_likely(self, recorded: Floats) -> ParameterEstimate:
        """The maximum of the likelihood (thesis 3.4.4); its covariance is the inverse information: far too small.

        The likelihood is smooth within a region of the grid and has kinks between them, and a sequence that could be
        aligned in two ways has two maxima (corrected 4.2.5): the half of the regions with the likeliest middles is
        searched.
        """
        from scipy.optimize import minimize  # imported where it is needed: it takes half a second

        columns = np.ascontiguousarray(self._resampled_for_states(recorded).T)
        arrays, grid = self._kernel_arrays(), self.grid_

        def minus_log_likelihood(position: Floats, cell: Ints) -> tuple[float, Floats]:
            value, gradient, _ = interpolation_kernels.expectation_at(position, cell, columns, *arrays)
            return min(-value, CONTRADICTED), -gradient

        regions = [(middle, grid.cell(middle), bounds) for middle, bounds in grid.regions(self.search_margin)]
        regions.sort(key=lambda region: -interpolation_kernels.value_at(region[0], region[1], columns, *arrays))
        found = [
            (minimize(minus_log_likelihood, middle, cell, jac=True, bounds=bounds, tol=SEARCH_TOLERANCE), cell)
            for middle, cell, bounds in regions[: (len(regions) + 1) // 2]
        ]
        best, cell = min(found, key=lambda one: float(one[0].fun))
        value, _, information = interpolation_kernels.expectation_at(best.x, cell, columns, *arrays)
        edges = grid.edges
        covariance = edges.T @ inverse_information(information, 1.0 + 2.0 * self.search_margin) @ edges
        return ParameterEstimate(grid.theta(best.x), covariance, float(value))

    def _log_likelihood_at(self, resampled: Floats, theta: Floats) -> float:
        position, columns = self.grid_.coordinates(theta), np.ascontiguousarray(resampled.T)
        cell = self.grid_.cell(position)
        return float(interpolation_kernels.value_at(position, cell, columns, *self._kernel_arrays()))

    def _expect(self, noise: AddedNoise) -> None:
        super()._expect(noise)
        self._prepared = None

    def _move_means(self, change: Floats) -> None:
        features = self.monomials_.at(self.grid_.points())
        self.means_ = self.means_ + np.einsum("ndf,gf->gnd", change, features)
        self._prepared = None

    def _kernel_arrays(self) -> tuple[Any, ...]:
        """Grid lines (P, maximum), their numbers (P,), and the local models as the kernels take them."""
        if self._prepared is None:
            grid = self.grid_
            knots = np.zeros((grid.dimension, max(grid.shape)))
            for row, line in zip(knots, grid.knots, strict=True):
                row[: len(line)] = line
            flat = np.ascontiguousarray(self.covariances_.reshape(*self.covariances_.shape[:2], -1))
            means, durations = np.ascontiguousarray(self.means_), np.ascontiguousarray(self.durations_)
            self._prepared = knots, np.array(grid.shape, dtype=np.int64), means, flat, durations, self.d_min_
        return self._prepared

    def _arrays(self) -> dict[str, Floats]:
        knots = {f"knots_{number}": line for number, line in enumerate(self.grid_.knots)}
        grid = {"grid_origin": self.grid_.origin, "grid_edges": self.grid_.edges, **knots}
        local = {"means": self.means_, "covariances": self.covariances_, "durations": self.durations_}
        return local | grid

    def _set_arrays(self, arrays: dict[str, Floats]) -> None:
        knots = tuple(arrays[f"knots_{number}"] for number in range(len(arrays["grid_origin"])))
        self._set_grid(ParameterGrid(arrays["grid_origin"], arrays["grid_edges"], knots))
        self.means_, self.covariances_ = arrays["means"], arrays["covariances"]
        self.durations_ = arrays["durations"]
        dim, theta_dim = self.means_.shape[-1], self.grid_.dimension
        expected = {"means": (self.grid_.size, self.n_states, dim), "grid_origin": (theta_dim,)}
        check_shapes(arrays, expected | {"grid_edges": (theta_dim, theta_dim)})
        check_states(arrays, self.means_, self.d_min_, self.d_max_)


def grouped(sequences: list[Floats], theta: Floats, grid: ParameterGrid) -> list[list[Floats]]:
    """Sequences per grid point. Raises ValueError naming labels off the grid and grid points without sequences."""
    if theta.shape[1] != grid.dimension:
        raise ValueError(f"theta has {theta.shape[1]} components, the grid has {grid.dimension}")
    if grid.size > len(theta):
        shape = " x ".join(map(str, grid.shape))
        raise ValueError(f"a grid of {shape} points has more points than the {len(theta)} sequences; {REMEDY}")
    index, distance = grid.nearest(theta)
    if (distance > 0.1).any():
        worst = int(distance.argmax())
        nearest = np.round(grid.points()[index[worst]], 4).tolist()
        raise ValueError(
            f"{int((distance > 0.1).sum())} sequences are not at a grid point; sequence {worst} has theta "
            f"{np.round(theta[worst], 4).tolist()}, its nearest point is {nearest}"
        )
    groups = [[sequences[k] for k in np.flatnonzero(index == number)] for number in range(grid.size)]
    empty = [np.round(grid.points()[number], 4).tolist() for number, group in enumerate(groups) if not group]
    if empty:
        raise ValueError(f"no training sequences at {len(empty)} of {grid.size} points of the grid: {empty}; {REMEDY}")
    return groups
