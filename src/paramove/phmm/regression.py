"""Baum-Welch of HMMs whose state means are linear in features of theta (thesis 3.3.1, corrected (3.3)-(3.4))."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from paramove.documents.array_types import Floats, Ints
from paramove.hmm import kernels
from paramove.hmm.estimation import Evaluator, Parameters, covariances_of, durations_of, penalty, pooled_covariance
from paramove.hmm.options import TrainingOptions, TrainingSummary
from paramove.hmm.sequences import Stack
from paramove.hmm.training import ConvergenceMonitor, regularisation_at, root_mean_deviation
from paramove.phmm.slope_prior import SlopePrior

EVIDENCE_ITERATIONS = 8
"""The prior's strength follows the evidence while covariances anneal, but at least so long; then it is constant."""


@dataclass(frozen=True)
class RegressedParameters:
    """A family of HMMs with the means Z_i phi.

    Attributes:
        coefficients: Z, shape (N, D, F).
        covariances: shape (N, D, D).
        durations: p_i(d) in column d - 1, shape (N, d_max).
        d_min: least number of frames of a state.
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
        found = RegressionStatistics.gathered(parameters, stacks, features)
        if smoothness is not None and iteration <= settled:
            prior = _prior(prior, parameters, found, degrees, smoothness, n_frames / len(sequences))
        change = _change(parameters, found, prior)
        scatter = found.scatter(change)
        annealing = iteration < settled
        if annealing or target is None or iteration == settled:
            target = pooled_covariance(scatter, found.weight)
        regularisation = regularisation_at(iteration, options, scale, target)
        objective = None
        if not annealing:
            objective = found.log_likelihood + penalty(parameters.at(features[0]), regularisation)
            objective += prior.log_density(parameters.coefficients) if prior is not None else 0.0
        monitor.add(found.log_likelihood, objective)
        parameters = RegressedParameters(
            parameters.coefficients + change,
            covariances_of(scatter, found.weight, regularisation),
            durations_of(found.durations, parameters.d_min, options.duration_pseudocount),
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
    found = RegressionStatistics.gathered(parameters, Stack.parts(sequences, len(coefficients)), features)
    scatter = found.scatter(coefficients - parameters.coefficients)
    target = pooled_covariance(scatter, found.weight)
    regularisation = regularisation_at(options.max_iterations, options, root_mean_deviation(sequences), target)
    return RegressedParameters(
        coefficients,
        covariances_of(scatter, found.weight, regularisation),
        durations_of(found.durations, parameters.d_min, options.duration_pseudocount),
        parameters.d_min,
    )


def _prior(
    prior: SlopePrior | None,
    parameters: RegressedParameters,
    found: RegressionStatistics,
    degrees: Ints,
    smoothness: float,
    mean_frames: float,
) -> SlopePrior:
    n_states = len(parameters.coefficients)
    pooled = found.squared.sum(axis=0) / found.weight.sum()
    pooled = pooled + 1e-6 * np.trace(pooled) / len(pooled) * np.eye(len(pooled))
    fresh = SlopePrior.weak(n_states, degrees, smoothness, pooled, max(1.0, mean_frames / n_states))
    if prior is None:
        return fresh
    renewed = replace(fresh, strength=prior.strength)
    return renewed.with_evidence(parameters.coefficients, found.weights, degrees)


def _change(parameters: RegressedParameters, found: RegressionStatistics, prior: SlopePrior | None) -> Floats:
    """What the M-step adds to the coefficients. Shape (N, D, F)."""
    if prior is not None:
        improved = prior.improved(parameters.coefficients, found.weights, found.crossed, parameters.covariances)
        return improved - parameters.coefficients
    try:
        solved = np.linalg.solve(found.weights, np.swapaxes(found.crossed, 1, 2))  # Equation (3.3), corrected
    except np.linalg.LinAlgError as error:
        raise ValueError(
            "the labels do not determine the model and it has no prior: give more different theta"
        ) from error
    return np.swapaxes(solved, 1, 2)
