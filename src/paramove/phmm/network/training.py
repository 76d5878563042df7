"""Generalised EM of HMMs whose state means are networks of theta (thesis 3.3.2.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from paramove.documents import Floats
from paramove.hmm import (
    ConvergenceMonitor,
    Evaluator,
    Parameters,
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
from paramove.phmm.network.networks import INNER_DEVIATION, StateNetworks, StateTargets


@dataclass(frozen=True)
class SequenceMoments:
    """Expected sums of each sequence, with residuals r of the means (K, N, D) with which they were gathered.

    Attributes:
        means: those means. weights: gamma, (K, N). firsts: gamma r, (K, N, D). squared: gamma r r' of all, (N, D, D).
        durations: expected counts, (N, d_max). log_likelihood: of all sequences.
    """

    means: Floats
    weights: Floats
    firsts: Floats
    squared: Floats
    durations: Floats
    log_likelihood: float

    @classmethod
    def gathered(cls, parameters: Parameters, sequences: Sequence[Floats], means: Floats) -> SequenceMoments:
        """E-step with the means (K, N, D) of the sequences, and the covariances and durations of the parameters."""
        common = Evaluator.of(parameters)
        weights, firsts = np.zeros(means.shape[:2]), np.zeros(means.shape)
        squared, durations = np.zeros_like(parameters.covariances), np.zeros_like(parameters.durations)
        log_likelihood = 0.0
        for k, sequence in enumerate(sequences):
            evaluator = replace(common, means=np.ascontiguousarray(means[k]))
            value, gamma, counts = evaluator.expectation(sequence)
            log_likelihood += value
            durations += counts
            ends = evaluator.ends(len(sequence))
            kernels.add_moments(sequence, gamma, ends, evaluator.means, weights[k], firsts[k], squared)
        squared = squared + np.swapaxes(np.tril(squared, -1), 1, 2)
        return cls(means, weights, firsts, squared, durations, log_likelihood)

    @property
    def averages(self) -> Floats:
        """Mean of the frames in each state of each sequence. Shape (K, N, D)."""
        result: Floats = self.means + self.firsts / np.maximum(self.weights, 1e-300)[:, :, None]
        return result

    def scatter(self, means: Floats) -> Floats:
        """Sum of gamma (x - mu)(x - mu)' about other means (K, N, D). Shape (N, D, D)."""
        change = means - self.means
        cross = np.einsum("knd,kne->nde", self.firsts, change, optimize=True)
        moved = np.einsum("kn,knd,kne->nde", self.weights, change, change, optimize=True)
        result: Floats = self.squared - cross - np.swapaxes(cross, 1, 2) + moved
        return 0.5 * (result + np.swapaxes(result, 1, 2))


@dataclass(frozen=True)
class NetworkPrior:
    """Regularisation of Z and W2, in a metric (D, D) that does not change while covariances do.

    Attributes:
        metric: a covariance; ridge: of each column of Z and W2, (F + H,).
    """

    metric: Floats
    ridge: Floats

    def log_density(self, networks: StateNetworks) -> float:
        """Up to a constant."""
        columns = np.concatenate([networks.skip, networks.outer], axis=2)
        pulled = np.linalg.solve(self.metric, columns)
        penalty_of_columns = float((self.ridge * (columns * pulled).sum(axis=(0, 1))).sum())
        return -0.5 * penalty_of_columns - 0.5 * float((networks.inner**2).sum()) / INNER_DEVIATION**2

    def targets(
        self, positions: Floats, features: Floats, moments: SequenceMoments, covariances: Floats
    ) -> StateTargets:
        """Targets of an M-step of the networks: dimensions rotated so that metric and covariance are diagonal."""
        rotation, precision = np.empty_like(covariances), np.empty(covariances.shape[:2])
        for i, covariance in enumerate(covariances):
            values, vectors = eigh(covariance, self.metric)  # vectors' metric vectors = 1
            rotation[i], precision[i] = vectors.T, 1.0 / values
        rotated = np.einsum("nde,kne->knd", rotation, moments.averages, optimize=True)
        return StateTargets(positions, features, moments.weights, rotated, rotation, precision, self.ridge)


def train_networks(
    networks: StateNetworks,
    parameters: Parameters,
    prior: NetworkPrior,
    sequences: Sequence[Floats],
    positions: Floats,
    features: Floats,
    options: TrainingOptions,
    gradient_steps: int,
) -> tuple[StateNetworks, Parameters, TrainingSummary]:
    """Iterate until the objective converges: few gradient steps in each iteration raise it without maximising it.

    Args:
        networks: to begin with.
        parameters: covariances, which need no more annealing, and durations of all theta; means of any one.
        positions: scaled theta, (K, P). features: monomials, (K, F).
    """
    monitor = ConvergenceMonitor(options.tolerance, sum(len(sequence) for sequence in sequences))
    scale, target = root_mean_deviation(sequences), None
    for _ in range(options.max_iterations):
        means = networks.means(positions, features)
        moments = SequenceMoments.gathered(parameters, sequences, means)
        if target is None:
            target = pooled_covariance(moments.scatter(means), moments.weights.sum(axis=0))
        regularisation = regularisation_at(options.annealing_iterations, options, scale, target)  # annealing is over
        objective = moments.log_likelihood + prior.log_density(networks)
        objective += penalty(parameters, regularisation)
        monitor.add(moments.log_likelihood, objective)
        if monitor.converged:
            break
        targets = prior.targets(positions, features, moments, parameters.covariances)
        networks = targets.networks(targets.improved(networks.inner, gradient_steps))
        scatter = moments.scatter(networks.means(positions, features))
        parameters = replace(
            parameters,
            covariances=covariances_of(scatter, moments.weights.sum(axis=0), regularisation),
            durations=durations_of(moments.durations, parameters.d_min, options.duration_pseudocount),
        )
    return networks, parameters, monitor.summary(len(sequences))
