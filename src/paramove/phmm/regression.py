"""Baum-Welch of HMMs whose state means are linear in features of theta (thesis 3.3.1, corrected (3.3)-(3.4)).

A prior on how state means depend on theta: weak slopes, similar in neighbouring states.

With few demonstrations the coefficients of a polynomial model are poorly determined and differ from state to state, so
that synthesised movements wobble. Coefficients z of monomials of degree g have the prior precision
lambda_g (I + l^4 D'D) across the states, D the second difference and l a length in states, in the metric of the pooled
covariance. lambda_g follows from the evidence of the training data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm import (
    ConvergenceMonitor,
    Evaluator,
    Parameters,
    Stack,
    TrainingOptions,
    TrainingSummary,
    covariances_of,
    durations_of,
    kernels,
    penalty,
    pooled_covariance,
    regularisation_at,
    root_mean_deviation,
)

MIN_STRENGTH, MAX_STRENGTH = 1e-8, 1e8
CONJUGATE_STEPS = 6
EVIDENCE_ITERATIONS = 8
"""The prior's strength follows the evidence while covariances anneal, but at least this many; then it is constant."""


@dataclass(frozen=True)
class RegressedParameters:
    """A family of HMMs with the means Z_i phi.

    Attributes:
        coefficients: Z, shape (N, D, F).
        covariances: shape (N, D, D).
        durations: p_i(d) in column d - 1, shape (N, d_max).
        d_min: smallest number of frames of a state.
    """

    coefficients: Floats
    covariances: Floats
    durations: Floats
    d_min: int

    def at(self, features: Floats) -> Parameters:
        """The member with these features (F,)."""
        return Parameters(self.coefficients @ features, self.covariances, self.durations, self.d_min)


@dataclass(frozen=True)
class RegressionStatistics:
    """Expected sums over all sequences; r are residuals of the coefficients with which they were gathered.

    Attributes:
        weights: gamma phi phi', shape (N, F, F).
        crossed: gamma r phi', shape (N, D, F).
        squared: gamma r r', shape (N, D, D).
        weight: gamma, shape (N,).
        durations: expected counts, shape (N, d_max).
        log_likelihood: of all sequences.
    """

    weights: Floats
    crossed: Floats
    squared: Floats
    weight: Floats
    durations: Floats
    log_likelihood: float

    @classmethod
    def gathered(
        cls, parameters: RegressedParameters, stacks: Sequence[Stack], features: Floats
    ) -> RegressionStatistics:
        """E-step with the features (K, F) of the sequences in the stacks.

        Moments of residuals and features together, [r; phi][r; phi]', hold all sums: features are rows whose reference
        is zero.
        """
        evaluator = Evaluator.of(parameters.at(features[0]))
        n_states, dim, n_features = parameters.coefficients.shape
        means = np.zeros((len(features), n_states, dim + n_features))
        np.einsum("ndf,kf->knd", parameters.coefficients, features, out=means[..., :dim])
        total, durations = np.zeros((n_states, dim + n_features, dim + n_features)), np.zeros_like(parameters.durations)
        weight, log_likelihood, before = np.zeros(n_states), 0.0, 0
        gamma = np.empty((n_states, max(stack.n_frames for stack in stacks)))
        for stack in stacks:
            own = slice(before, before + len(stack.lengths))
            values = evaluator.stacked_expectation(
                stack, gamma, durations, before=before, means=np.ascontiguousarray(means[own, :, :dim])
            )
            joined = np.concatenate([stack.columns, np.repeat(features[own], stack.lengths, axis=0).T])
            some, _, second = kernels.stacked_moments(joined, evaluator.windows(stack), gamma, means[own], False)
            weight, total, log_likelihood = weight + some, total + second, log_likelihood + float(values.sum())
            before += len(values)
        return cls(
            np.ascontiguousarray(total[:, dim:, dim:]),
            np.ascontiguousarray(total[:, :dim, dim:]),
            np.ascontiguousarray(total[:, :dim, :dim]),
            weight,
            durations,
            log_likelihood,
        )

    def scatter(self, change: Floats) -> Floats:
        """Sum of gamma (x - mu)(x - mu)' after the coefficients have changed (3.4), corrected. Shape (N, D, D)."""
        cross = change @ np.swapaxes(self.crossed, 1, 2)
        result: Floats = self.squared - cross - np.swapaxes(cross, 1, 2)
        result += change @ self.weights @ np.swapaxes(change, 1, 2)
        return 0.5 * (result + np.swapaxes(result, 1, 2))


def train_regressed(
    initial: RegressedParameters,
    sequences: Sequence[Floats],
    features: Floats,
    degrees: Ints,
    options: TrainingOptions,
    smoothness: float | None,
) -> tuple[RegressedParameters, TrainingSummary]:
    """Iterate until the objective converges; without `smoothness` the coefficients have no prior (maximum likelihood).

    Args:
        initial: where to start.
        sequences: (T_k, D) each.
        features: phi of each sequence, (K, F); degrees: of the monomials, (F,).
        options: as for an HMM; the objective is the log-likelihood plus the logarithms of all priors.
        smoothness: see `SlopePrior.weak`.

    Raises:
        ValueError: The labels do not determine the coefficients and there is no prior.
    """
    n_frames = sum(len(sequence) for sequence in sequences)
    monitor = ConvergenceMonitor(options.tolerance, n_frames)
    scale = root_mean_deviation(sequences)
    settled = max(options.annealing_iterations, EVIDENCE_ITERATIONS if smoothness is not None else 0)
    parameters, prior, target = initial, None, None
    stacks = Stack.parts(sequences, len(initial.coefficients))
    for iteration in range(options.max_iterations):
        statistics = RegressionStatistics.gathered(parameters, stacks, features)
        if smoothness is not None and iteration <= settled:
            prior = _prior(prior, parameters, statistics, degrees, smoothness, n_frames / len(sequences))
        change = _change(parameters, statistics, prior)
        scatter = statistics.scatter(change)
        annealing = iteration < settled
        if annealing or target is None or iteration == settled:
            target = pooled_covariance(scatter, statistics.weight)
        regularisation = regularisation_at(iteration, options, scale, target)
        objective = None
        if not annealing:
            objective = statistics.log_likelihood + penalty(parameters.at(features[0]), regularisation)
            objective += prior.log_density(parameters.coefficients) if prior is not None else 0.0
        monitor.add(statistics.log_likelihood, objective)
        parameters = RegressedParameters(
            parameters.coefficients + change,
            covariances_of(scatter, statistics.weight, regularisation),
            durations_of(statistics.durations, parameters.d_min, options.duration_pseudocount),
            parameters.d_min,
        )
        if monitor.converged:
            break
    return parameters, monitor.summary(len(sequences))


def with_coefficients(
    parameters: RegressedParameters,
    coefficients: Floats,
    sequences: Sequence[Floats],
    features: Floats,
    options: TrainingOptions,
) -> RegressedParameters:
    """The family with other coefficients (N, D, F); covariances and durations follow by one more M-step."""
    statistics = RegressionStatistics.gathered(parameters, Stack.parts(sequences, len(coefficients)), features)
    scatter = statistics.scatter(coefficients - parameters.coefficients)
    target = pooled_covariance(scatter, statistics.weight)
    regularisation = regularisation_at(options.max_iterations, options, root_mean_deviation(sequences), target)
    return RegressedParameters(
        coefficients,
        covariances_of(scatter, statistics.weight, regularisation),
        durations_of(statistics.durations, parameters.d_min, options.duration_pseudocount),
        parameters.d_min,
    )


def _prior(
    prior: SlopePrior | None,
    parameters: RegressedParameters,
    statistics: RegressionStatistics,
    degrees: Ints,
    smoothness: float,
    mean_frames: float,
) -> SlopePrior:
    n_states = len(parameters.coefficients)
    pooled = statistics.squared.sum(axis=0) / statistics.weight.sum()
    pooled = pooled + 1e-6 * np.trace(pooled) / len(pooled) * np.eye(len(pooled))
    fresh = SlopePrior.weak(n_states, degrees, smoothness, pooled, max(1.0, mean_frames / n_states))
    if prior is None:
        return fresh
    renewed = replace(fresh, strength=prior.strength)
    return renewed.with_evidence(parameters.coefficients, statistics.weights, degrees)


def _change(parameters: RegressedParameters, statistics: RegressionStatistics, prior: SlopePrior | None) -> Floats:
    """Change of the coefficients in the M-step. Shape (N, D, F)."""
    if prior is not None:
        improved = prior.improved(
            parameters.coefficients, statistics.weights, statistics.crossed, parameters.covariances
        )
        return improved - parameters.coefficients
    try:
        solved = np.linalg.solve(statistics.weights, np.swapaxes(statistics.crossed, 1, 2))  # Equation (3.3), corrected
    except np.linalg.LinAlgError as error:
        raise ValueError(
            "the labels do not determine the model and it has no prior: give more different theta"
        ) from error
    return np.swapaxes(solved, 1, 2)


@dataclass(frozen=True)
class SlopePrior:
    """Gaussian prior on the coefficients of all states.

    Attributes:
        coupling: I + l^4 D'D, shape (N, N).
        strength: lambda of each monomial, 0 for the constant, shape (F,).
        whitening: inverse Cholesky factor of the pooled covariance, shape (D, D).
        frames: how many frames count as one observation; neighbouring frames are redundant.
    """

    coupling: Floats
    strength: Floats
    whitening: Floats
    frames: float

    @classmethod
    def weak(cls, n_states: int, degrees: Ints, smoothness: float, pooled: Floats, frames: float) -> SlopePrior:
        """A start for the evidence. `smoothness` is l as a fraction of all states; `pooled` covariance (D, D)."""
        length = smoothness * n_states
        second = np.diff(np.eye(n_states), n=2, axis=0) if n_states > 2 else np.zeros((0, n_states))
        coupling = np.eye(n_states) + length**4 * second.T @ second
        strength = np.where(degrees > 0, 1e-3, 0.0)
        return cls(coupling, strength, np.asarray(np.linalg.inv(np.linalg.cholesky(pooled))), frames)

    def log_density(self, coefficients: Floats) -> float:
        """Logarithm of the prior at coefficients (N, D, F), up to a constant; times the frames of an observation."""
        white = self.whitening @ coefficients
        pulled = np.einsum("ij,jdf->idf", self.coupling, white)
        return -0.5 * self.frames * float((self.strength * (white * pulled).sum(axis=(0, 1))).sum())

    def with_evidence(self, coefficients: Floats, weights: Floats, degrees: Ints) -> SlopePrior:
        """Strengths that the data make most likely, one step of their fixed point.

        Args:
            coefficients: of the states now, (N, D, F).
            weights: sum of gamma phi phi' in each state, (N, F, F).
            degrees: of the monomials, (F,).
        """
        n_states, dim, n_monomials = coefficients.shape
        white = self.whitening @ coefficients
        size = np.einsum("idf,ij,jdf->f", white, self.coupling, white)
        posterior = np.linalg.inv(self._precision(weights / self.frames)).reshape((n_states, n_monomials) * 2)
        remaining = np.einsum("ij,jfif->f", self.coupling, posterior) * dim
        strength = np.zeros(n_monomials)
        for degree in range(1, int(degrees.max()) + 1):
            same = degrees == degree
            value = n_states * dim * same.sum() / (size[same].sum() + remaining[same].sum())
            strength[same] = np.clip(value, MIN_STRENGTH, MAX_STRENGTH)
        return SlopePrior(self.coupling, strength, self.whitening, self.frames)

    def improved(self, coefficients: Floats, weights: Floats, crossed: Floats, covariances: Floats) -> Floats:
        """Coefficients that raise the expected log-likelihood plus prior, by conjugate gradients from those given.

        Every step raises the objective, so that training with the prior never makes it fall.

        Args:
            coefficients: Z now, (N, D, F).
            weights: sum of gamma phi phi', (N, F, F).
            crossed: sum of gamma r phi' with r the residuals of Z, (N, D, F).
            covariances: of the states, (N, D, D).

        Returns:
            Z, (N, D, F).
        """
        unwhitening = np.linalg.inv(self.whitening)
        curvature = unwhitening.T @ np.linalg.solve(covariances, unwhitening[None])  # (N, D, D), 1 if all are pooled
        mean_curvature = np.trace(curvature, axis1=1, axis2=2) / curvature.shape[1]
        factor = np.linalg.inv(self._precision(mean_curvature[:, None, None] * weights))
        white = self.whitening @ coefficients

        def pulled(direction: Floats) -> Floats:
            return np.asarray(self.frames * self.strength * np.einsum("ij,jdf->idf", self.coupling, direction))

        def preconditioned(gradient: Floats) -> Floats:
            stacked = np.swapaxes(gradient, 1, 2).reshape(-1, gradient.shape[1])
            return np.swapaxes((factor @ stacked).reshape(gradient.shape[0], -1, gradient.shape[1]), 1, 2)

        gradient = curvature @ (self.whitening @ crossed) - pulled(white)
        step = direction = preconditioned(gradient)
        slope = float((gradient * step).sum())
        for _ in range(CONJUGATE_STEPS):
            if slope <= 0.0:
                break
            bent = curvature @ direction @ weights + pulled(direction)
            length = slope / float((direction * bent).sum())
            white = white + length * direction
            gradient = gradient - length * bent
            step = preconditioned(gradient)
            previous, slope = slope, float((gradient * step).sum())
            direction = step + slope / previous * direction
        result: Floats = unwhitening @ white
        return result

    def _precision(self, weights: Floats) -> Floats:
        """Posterior precision of one whitened dimension, (N F, N F), with the data's part (N, F, F)."""
        n_states, n_monomials, _ = weights.shape
        total = np.zeros((n_states, n_monomials, n_states, n_monomials))
        index = np.arange(n_states)
        total[index, :, index, :] = weights
        each = np.arange(n_monomials)
        total[:, each, :, each] += (self.strength * self.frames)[:, None, None] * self.coupling[None]
        return total.reshape(n_states * n_monomials, -1)
