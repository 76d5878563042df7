"""The interpolative parametric HMM: multilinear interpolation of synchronised local HMMs on a grid (thesis 3.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.hmm import Evaluator, LeftRightHMM, Parameters, TrainingOptions, check_length, checked_sequence
from paramove.phmm import interpolation_kernels, interpolation_search
from paramove.phmm.description import MovementDescription
from paramove.phmm.execution_covariance import ExecutionCovariance, Sensitivity, left_out_of_groups
from paramove.phmm.grid import ParameterGrid
from paramove.phmm.local_models import check_local_models
from paramove.phmm.noise import AddedNoise, expected_responsibilities
from paramove.phmm.parametric import ParameterEstimate, ParametricHMM, TrainingData
from paramove.phmm.performance import state_averages
from paramove.phmm.synchronisation import synchronised

UNSEEN_BEND = 0.03
"""Standard deviation of theta half-way between the only two lines of a dimension, as a fraction of the grid: the
movements between them are unknown. The 2 x 2 model of thesis 4.2.5 is 3.5 cm off in the middle of 80 cm."""
SMOOTHING = 0.3
"""Factor on squared distances where the search begins: covariances are widened by its inverse (paper 5.3)."""


class InterpolativePHMM(ParametricHMM):
    """Local HMMs at the points of a grid of any size and dimension, interpolated in between (3.6), (3.8)-(3.10).

    Outside the grid the means extrapolate; the weights of covariances and durations are clamped (corrected). (3.6) is
    applied to the duration distributions p_i(d), which for d_max = d_min + 1 is the same as interpolating transitions.

    Args:
        n_states, d_min, d_max, options, resampled_frames, description: as in `ParametricHMM`.
        corners: for a cuboid that is not axis-parallel: theta of (0, 0, ..), (1, 0, ..), (0, 1, ..), ..; (P + 1, P).
        shape: grid lines per dimension; with `corners` only. Without them the grid follows from theta.
        local_iterations: EM steps of the local models, the first with the global responsibilities.
        search_margin: how far outside the grid `estimate` searches, as a fraction of the grid.
        covariance_inflation: further factor on the covariance of `estimate`, see `calibrate`.

    Attributes:
        grid_: the ParameterGrid.
        means_: shape (G, N, D), grid points with the last dimension fastest.
        covariances_: shape (G, N, D, D).
        durations_: shape (G, N, d_max).
        spread_: covariance of whole training executions; None for a model made of given local HMMs.
    """

    spread_: ExecutionCovariance | None = None
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
        search_margin: float = 0.25,
        covariance_inflation: float = 1.0,
    ) -> None:
        super().__init__(
            n_states, d_min, d_max, options=options, resampled_frames=resampled_frames, description=description
        )
        self.corners = corners
        self.shape = shape
        self.local_iterations = local_iterations
        self.search_margin = search_margin
        self.covariance_inflation = covariance_inflation

    @classmethod
    def from_local_models(cls, grid: ParameterGrid, local: Sequence[Parameters], **parameters: Any) -> Self:
        """A model made of given local HMMs, one per grid point in the order of `grid.points()` (thesis 5.2.3).

        `parameters` are further constructor arguments. Raises ValueError where number or shapes differ.
        """
        if len(local) != grid.size:
            raise ValueError(f"expected {grid.size} local models, one per grid point, found {len(local)}")
        kinds = {(one.means.shape, one.durations.shape, one.d_min) for one in local}
        if len(kinds) != 1:
            raise ValueError(f"all local models have the same shapes and d_min, found {sorted(kinds)}")
        (states, _), (_, d_max), d_min = kinds.pop()
        model = cls(states, d_min, d_max, **parameters)
        corners = grid.points()
        model.parameter_bounds_ = np.stack([corners.min(axis=0), corners.max(axis=0)])
        model._set_local(grid, local)
        return model

    def local_models(self) -> list[Parameters]:
        """The local HMMs in the order of `grid_.points()`."""
        stored = zip(self.means_, self.covariances_, self.durations_, strict=True)
        return [Parameters(means, covariances, durations, self.d_min_) for means, covariances, durations in stored]

    def calibrate(self, sequences: Sequence[ArrayLike], theta: ArrayLike) -> Self:
        """Set `covariance_inflation` so that covariances of `estimate` match its errors on labelled sequences.

        Needed for a model made of given local HMMs; a trained one knows how executions vary, but only those of its
        training. Use sequences that did not train the model. Raises ValueError for fewer than two.
        """
        labels = np.atleast_2d(np.asarray(theta, dtype=np.float64))
        if len(sequences) < 2:
            raise ValueError(f"calibration needs at least 2 labelled sequences, found {len(sequences)}")
        self.covariance_inflation = 1.0
        squared = []
        for sequence, label in zip(sequences, labels, strict=True):
            estimate = self.estimate(sequence)
            error = estimate.theta - label
            squared.append(float(error @ np.linalg.solve(estimate.covariance, error)))
        self.covariance_inflation = float(np.mean(squared)) / self.grid_.dimension
        return self

    def _fit(self, data: TrainingData) -> None:
        grid = self._grid_for(data.theta)
        groups = grouped(data.sequences, data.theta, grid)
        options = self._training_options()
        everything = LeftRightHMM(self.n_states, self.d_min_, self.d_max_, options=options).fit(data.sequences)
        local = synchronised(everything.parameters, groups, options, self.local_iterations)
        self.training_ = everything.training_
        self._set_local(grid, local)
        self.spread_ = self._execution_covariance(data.sequences, data.theta)

    def _execution_covariance(self, sequences: Sequence[Floats], theta: Floats) -> ExecutionCovariance:
        numbers = self.grid_.nearest(theta)[0]
        evaluators = [Evaluator.of(one) for one in self.local_models()]
        averages = [
            state_averages(evaluators[g].expectation(x)[1].T, x)[0].ravel()
            for g, x in zip(numbers.tolist(), sequences, strict=True)
        ]
        residuals = np.stack(averages) - self.means_[numbers].reshape(len(numbers), -1)
        counts = self._kernel_arrays()[1]
        sensitivities = []
        for g, sequence in zip(numbers.tolist(), sequences, strict=True):
            cell = np.minimum(np.unravel_index(g, self.grid_.shape), counts - 2)
            position = self.grid_.coordinates(self.grid_.points()[g])
            sensitivities.append(self._sensitivity(position, cell, len(sequence)))
        return ExecutionCovariance.fitted(left_out_of_groups(residuals, numbers), sensitivities, self.grid_.size)

    def _grid_for(self, theta: Floats) -> ParameterGrid:
        if self.corners is None:
            return ParameterGrid.from_theta(theta)
        return ParameterGrid.from_corners(self.corners, self.shape or (2,) * theta.shape[1])

    def _set_local(self, grid: ParameterGrid, local: Sequence[Parameters]) -> None:
        self.grid_ = grid
        self.means_ = np.stack([one.means for one in local])
        self.covariances_ = np.stack([one.covariances for one in local])
        self.durations_ = np.stack([one.durations for one in local])
        self.spread_ = None
        self._prepared = None

    def at(self, theta: ArrayLike) -> LeftRightHMM:
        """The interpolated HMM for theta (P,)."""
        return LeftRightHMM.from_parameters(self._interpolated(self._coordinates(theta)), self.options)

    def state_means(self, theta: ArrayLike) -> Floats:
        """Means of all states for one theta (P,) or many (M, P) (5.2)-(5.4, corrected). Shape (N, D) or (M, N, D)."""
        coordinates = self._coordinates(theta)
        indices, weights = self.grid_.weights(np.atleast_2d(coordinates), clamped=False)
        means = np.einsum("mc,mcnd->mnd", weights, self.means_[indices])
        return cast(Floats, means[0] if coordinates.ndim == 1 else means)

    def progress_mean(self, theta: ArrayLike, tau: float | Floats) -> Floats:
        """Mean pose at progress tau (6.2). Shape (D,); for many theta (M, P) and tau (M,): (M, D)."""
        return self._at_progress(self.means_, theta, tau, clamped=False)

    def progress_covariance(self, theta: ArrayLike, tau: float | Floats) -> Floats:
        """Covariance of the pose at progress tau (6.3). Shape (D, D); for many theta and tau: (M, D, D)."""
        return self._at_progress(self.covariances_, theta, tau, clamped=True)

    def estimate(self, sequence: ArrayLike, *, finished: bool = True) -> ParameterEstimate:
        """Maximum likelihood theta; its covariance from the differences of whole training executions from their local
        model.

        A model made of given local HMMs has no executions: its covariance is the inverse information, which is far too
        small.

        Raises ValueError for `finished=False`: a grid of local models does not model beginnings.
        """
        if not finished:
            raise ValueError(
                "an InterpolativePHMM estimates theta of complete movements; a QuadraticPHMM also of beginnings"
            )
        recorded = checked_sequence(sequence, self._learned_dimensions())
        checked = self._resampled(recorded)
        check_length(len(checked), self.n_states, self.d_min_, self.d_max_)
        model = self._expecting_noise_of(recorded)
        if model is not self:
            return model.estimate(recorded)
        best, value, cell = interpolation_search.likeliest(
            self.search_margin, SMOOTHING, np.ascontiguousarray(checked.T), *self._kernel_arrays()
        )
        widest = 1.0 + 2.0 * self.search_margin
        if self.spread_ is not None:
            sensitivity = self._sensitivity(best, cell, len(checked))
            bends = bending(self.grid_, self.means_, best, sensitivity.gain)
            covariance = self.spread_.covariance(sensitivity, widest, bends)
        else:
            covariance = self._curvature_covariance(checked, best, cell, widest)
        edges = self.grid_.edges
        theta_covariance = self.covariance_inflation * (edges.T @ covariance @ edges)
        return ParameterEstimate(self.grid_.theta(best), theta_covariance, float(value))

    def _expect(self, noise: AddedNoise) -> None:
        self.covariances_ = self.covariances_ + noise.of_states
        self._prepared = None
        if self.spread_ is not None:
            gamma = expected_responsibilities(self.durations_.mean(axis=0), noise.n_model_frames)
            of_states = noise.of_averages(lambda frames: state_averages(gamma, frames)[0])
            self.spread_ = replace(self.spread_, own=self.spread_.own + np.diagonal(of_states))

    def _learned_dimensions(self) -> int:
        self._check_trained()
        return int(self.means_.shape[-1])

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

    def _sensitivity(self, coordinates: Floats, cell: Ints, n_frames: int) -> Sensitivity:
        knots, counts, *_ = self._kernel_arrays()
        numbers = interpolation_kernels.corner_numbers(cell, counts)
        slopes = interpolation_kernels.corner_weights(coordinates, cell, knots, False)[1]
        moved = np.einsum("cp,cnd->ndp", slopes, self.means_[numbers])
        return Sensitivity.of(self._interpolated(coordinates), moved, n_frames)

    def _curvature_covariance(self, sequence: Floats, position: Floats, cell: Ints, widest: float) -> Floats:
        """Inverse information of the likelihood: far too small, but all that is known without executions."""
        columns, arrays = np.ascontiguousarray(sequence.T), self._kernel_arrays()
        information = interpolation_kernels.expectation_at(position, cell, 1.0, columns, *arrays)[2]
        values, vectors = np.linalg.eigh(information)
        result: Floats = (vectors / np.maximum(values, 1.0 / widest**2)) @ vectors.T
        return result

    def _coordinates(self, theta: ArrayLike) -> Floats:
        values = np.asarray(theta, dtype=np.float64)
        self._check_trained()
        if values.shape[-1:] != (self.grid_.dimension,) or values.ndim > 2 or not np.isfinite(values).all():
            raise ValueError(
                f"theta has {self.grid_.dimension} finite components, found shape {values.shape}: {values}"
            )
        return self.grid_.coordinates(values)

    def _interpolated(self, coordinates: Floats) -> Parameters:
        indices, weights = self.grid_.weights(coordinates[None, :], clamped=False)
        means = np.tensordot(weights[0], self.means_[indices[0]], axes=1)
        indices, weights = self.grid_.weights(coordinates[None, :], clamped=True)
        covariances = np.tensordot(weights[0], self.covariances_[indices[0]], axes=1)
        durations = np.tensordot(weights[0], self.durations_[indices[0]], axes=1)
        return Parameters(means, covariances, durations, self.d_min_)

    def _at_progress(self, values: Floats, theta: ArrayLike, tau: float | Floats, clamped: bool) -> Floats:
        coordinates = self._coordinates(theta)
        progress = np.asarray(tau, dtype=np.float64)
        if not ((progress >= 0.0) & (progress <= 1.0)).all():
            raise ValueError(f"progress lies in [0, 1], found {progress.min():.3g} to {progress.max():.3g}")
        rows, progress = np.atleast_2d(coordinates), np.atleast_1d(progress)
        n_rows = max(len(rows), len(progress))
        rows, progress = np.broadcast_to(rows, (n_rows, rows.shape[1])), np.broadcast_to(progress, n_rows)
        position = progress * (self.n_states - 1)
        lower, upper = np.floor(position).astype(np.int64), np.ceil(position).astype(np.int64)
        indices, weights = self.grid_.weights(rows, clamped)
        fraction = (position - lower)[:, None]
        result = np.einsum("mc,mc...->m...", weights * (1.0 - fraction), values[indices, lower[:, None]])
        result += np.einsum("mc,mc...->m...", weights * fraction, values[indices, upper[:, None]])
        single = coordinates.ndim == 1 and np.ndim(tau) == 0
        return cast(Floats, result[0] if single else result)

    def _arrays(self) -> dict[str, Floats]:
        knots = {f"knots_{number}": line for number, line in enumerate(self.grid_.knots)}
        grid = {"grid_origin": self.grid_.origin, "grid_edges": self.grid_.edges, **knots}
        local = {"means": self.means_, "covariances": self.covariances_, "durations": self.durations_}
        return local | grid | (self.spread_.arrays() if self.spread_ is not None else {})

    def _set_arrays(self, arrays: dict[str, Floats]) -> None:
        knots = tuple(arrays[f"knots_{number}"] for number in range(len(arrays["grid_origin"])))
        self.grid_ = ParameterGrid(arrays["grid_origin"], arrays["grid_edges"], knots)
        self.means_, self.covariances_ = arrays["means"], arrays["covariances"]
        self.durations_ = arrays["durations"]
        dim, theta_dim = self.means_.shape[-1], self.grid_.dimension
        states = (self.grid_.size, self.n_states)
        expected = {"means": (*states, dim), "covariances": (*states, dim, dim), "durations": (*states, self.d_max_)}
        expected |= {"grid_origin": (theta_dim,), "grid_edges": (theta_dim, theta_dim)}
        for name, shape in expected.items():
            if arrays[name].shape != shape:
                raise ValueError(f"expected {name} of shape {shape}, found {arrays[name].shape}")
        check_local_models(self.means_, self.covariances_, self.durations_, self.d_min_)
        self._prepared = None
        known = "spread_factor" in arrays  # models made of given local HMMs have no executions
        self.spread_ = ExecutionCovariance.from_arrays(arrays, self.n_states * dim) if known else None


def grouped(sequences: list[Floats], theta: Floats, grid: ParameterGrid) -> list[list[Floats]]:
    """Sequences per grid point. Raises ValueError naming labels off the grid and grid points without sequences."""
    if theta.shape[1] != grid.dimension:
        raise ValueError(f"theta has {theta.shape[1]} components, the grid has {grid.dimension}")
    index, distance = grid.nearest(theta)
    if (distance > 0.1).any():
        worst = int(distance.argmax())
        nearest = np.round(grid.points()[index[worst]], 4).tolist()
        raise ValueError(
            f"{int((distance > 0.1).sum())} sequences are not at a grid point; sequence {worst} has theta "
            f"{np.round(theta[worst], 4).tolist()}, its nearest point is {nearest}"
        )
    groups: list[list[Floats]] = [[] for _ in range(grid.size)]
    for number, sequence in zip(index, sequences, strict=True):
        groups[number].append(sequence)
    empty = [np.round(grid.points()[number], 4).tolist() for number, group in enumerate(groups) if not group]
    if empty:
        shape = " x ".join(map(str, grid.shape))
        raise ValueError(f"no training sequences at {len(empty)} of {grid.size} points of the {shape} grid: {empty}")
    return groups


def bending(grid: ParameterGrid, means: Floats, coordinates: Floats, gain: Floats) -> Floats:
    """Covariance of theta in grid coordinates (P, P) at a position (P,), from the error of interpolation.

    Interpolation between lines h apart misses s (1 - s) h^2 f'' / 2, with s the fraction between them; f'' follows from
    three neighbouring lines.

    Args:
        means: of the local models, (G, N, D). gain: change of theta with the averages of the states, (P, N D).
    """
    shaped = means.reshape(*grid.shape, -1)
    total = np.zeros((grid.dimension, grid.dimension))
    for p, knots in enumerate(grid.knots):
        line = int(np.clip(np.searchsorted(knots, coordinates[p], side="right") - 1, 0, len(knots) - 2))
        width = knots[line + 1] - knots[line]
        fraction = float(np.clip((coordinates[p] - knots[line]) / width, 0.0, 1.0))
        if len(knots) == 2:
            total[p, p] += (4.0 * UNSEEN_BEND * fraction * (1.0 - fraction)) ** 2
            continue
        for middle in {max(1, line), min(line + 1, len(knots) - 2)}:
            moved = (
                0.5
                * fraction
                * (1.0 - fraction)
                * width**2
                * gain
                @ _second_derivative(shaped, grid, p, middle, coordinates)
            )
            total += np.outer(moved, moved)
    return total


def _second_derivative(shaped: Floats, grid: ParameterGrid, p: int, middle: int, coordinates: Floats) -> Floats:
    """Of the means along dimension p at an inner line, at the nearest lines of the other dimensions. (N D,)."""
    position = [int(np.abs(knots - at).argmin()) for knots, at in zip(grid.knots, coordinates, strict=True)]
    before, here, after = (shaped[(*position[:p], middle + step, *position[p + 1 :])] for step in (-1, 0, 1))
    knots = grid.knots[p]
    low, high = knots[middle] - knots[middle - 1], knots[middle + 1] - knots[middle]
    result: Floats = 2.0 * ((after - here) / high - (here - before) / low) / (low + high)
    return result
