"""Baum-Welch training: initialisation, iterations, convergence monitor (thesis 2.1.6, 2.2.2)."""

import logging
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm.estimation import (
    Covariance,
    Moments,
    Parameters,
    Statistics,
    covariances_of,
    durations_of,
    penalty,
    pooled_covariance,
)
from paramove.hmm.options import Regularisation, TrainingOptions, TrainingSummary
from paramove.hmm.sequences import Stack

logger = logging.getLogger(__name__)


class LikelihoodDecreaseWarning(RuntimeWarning):
    """The objective fell although every step should raise it: a sign of numerical trouble."""


@dataclass
class ConvergenceMonitor:
    """Monitors the objective that EM maximises, warns when it falls, detects convergence."""

    tolerance_per_frame: float
    n_frames: int
    objectives: list[float] = field(default_factory=list)
    log_likelihoods: list[float] = field(default_factory=list)
    converged: bool = False

    def add(self, log_likelihood: float, objective: float | None) -> None:
        """Note one iteration; `objective` is None while the prior is still being annealed."""
        self.log_likelihoods.append(log_likelihood)
        if objective is None:
            return
        if self.objectives:
            gain = objective - self.objectives[-1]
            if gain < -1e-8 * max(1.0, abs(objective)):
                warnings.warn(
                    f"the training objective fell by {-gain:.3g} to {objective:.6g} in iteration "
                    f"{len(self.log_likelihoods)}; more shrinkage or a higher floor helps",
                    LikelihoodDecreaseWarning,
                    stacklevel=3,
                )
            self.converged = gain < self.tolerance_per_frame * self.n_frames
        self.objectives.append(objective)

    def summary(self, n_sequences: int) -> TrainingSummary:
        """The summary so far."""
        history, objectives = tuple(self.log_likelihoods), tuple(self.objectives)
        return TrainingSummary(history, objectives, n_sequences, self.n_frames, self.converged)


def root_mean_deviation(sequences: Sequence[Floats]) -> float:
    """Square root of the mean variance per dimension over all frames: the unit of the option fractions."""
    frames = np.concatenate(list(sequences))
    frames -= frames.mean(axis=0)
    return float(np.sqrt(np.vdot(frames, frames) / frames.size))


def equal_segments(
    sequences: Sequence[Floats],
    n_states: int,
    d_min: int,
    d_max: int,
    options: TrainingOptions,
    kind: Covariance = "full",
) -> Parameters:
    """Initial parameters from cutting each sequence into N equal parts; durations uniform over d_min..d_max."""
    labels = [np.arange(len(sequence)) * n_states // len(sequence) for sequence in sequences]
    means, covariances = segment_outputs(sequences, labels, n_states, options, kind)
    durations = np.zeros((n_states, d_max))
    durations[:, d_min - 1 :] = 1.0 / (d_max - d_min + 1)
    return Parameters(means, covariances, durations, d_min)


def segment_outputs(
    sequences: Sequence[Floats], labels: Sequence[Ints], n_states: int, options: TrainingOptions,
    kind: Covariance,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Means (N, D) and covariances (N, D, D) of frames with known states; each state has at least one frame."""
    dim = sequences[0].shape[1]
    frames, states = np.concatenate(list(sequences)), np.concatenate(labels)
    frames = frames[np.argsort(states, kind="stable")]
    weight = np.bincount(states, minlength=n_states).astype(np.float64)
    means, scatter = np.empty((n_states, dim)), np.empty((n_states, dim, dim))
    for i, part in enumerate(np.split(frames, np.cumsum(weight[:-1]).astype(np.int64))):
        means[i] = part.mean(axis=0)
        scatter[i] = (part - means[i]).T @ (part - means[i])
    # The first E-step needs covariances that are safe with any options, hence the pooled one underneath.
    scale = root_mean_deviation(sequences)
    target = pooled_covariance(scatter, weight) + (1e-3 * scale) ** 2 * np.eye(dim)
    added, shrinkage = (options.prior_fraction * scale) ** 2, max(dim, options.shrinkage_frames)
    start = Regularisation(added, floor_variance(options, scale), target, shrinkage, 0.0)
    return means, covariances_of(scatter, weight, start, kind)


def train(
    initial: Parameters, sequences: Sequence[Floats], options: TrainingOptions, kind: Covariance = "full"
) -> tuple[Parameters, TrainingSummary]:
    """Iterate Baum-Welch from `initial` until the objective converges or the iterations are used up.

    Warns (LikelihoodDecreaseWarning) if the objective falls after the annealing.
    """
    expect = partial(Statistics.of, stacks=Stack.parts(sequences, len(initial.means)), kind=kind)
    return iterate(initial, sequences, options, expect, partial(_maximised, kind=kind), penalty)


def _maximised(old: Parameters, statistics: Statistics, regularisation: Regularisation, kind: Covariance) -> Parameters:
    """M-step."""
    means = statistics.means()
    covariances = covariances_of(statistics.scatter(means), statistics.weight, regularisation, kind)
    durations = durations_of(statistics.durations, old.d_min, regularisation.duration_pseudocount)
    return Parameters(means, covariances, durations, old.d_min)


Model = TypeVar("Model")
Expected = TypeVar("Expected", bound=Moments)


def iterate(
    initial: Model,
    sequences: Sequence[Floats],
    options: TrainingOptions,
    expect: Callable[[Model], Expected],
    maximise: Callable[[Model, Expected, Regularisation], Model],
    penalise: Callable[[Model, Regularisation], float],
) -> tuple[Model, TrainingSummary]:
    """Expectation maximisation with annealed prior and convergence monitor, for any kind of HMM."""
    scale = root_mean_deviation(sequences)
    monitor = ConvergenceMonitor(options.tolerance, sum(len(sequence) for sequence in sequences))
    parameters = initial
    target: Floats | None = None
    for iteration in range(options.max_iterations):
        statistics = expect(parameters)
        annealing = iteration < options.annealing_iterations
        # The target moves while the prior does and then stays, which makes the objective a fixed function.
        if annealing or target is None or iteration == options.annealing_iterations:
            target = pooled_covariance(statistics.scatter(statistics.means()), statistics.weight)
        regularisation = regularisation_at(iteration, options, scale, target)
        objective = None if annealing else statistics.log_likelihood + penalise(parameters, regularisation)
        monitor.add(statistics.log_likelihood, objective)
        parameters = maximise(parameters, statistics, regularisation)
        if monitor.converged:
            break
    logger.debug("trained on %d sequences in %d iterations", len(sequences), iteration + 1)
    return parameters, monitor.summary(len(sequences))


def regularisation_at(iteration: int, options: TrainingOptions, scale: float, target: Floats) -> Regularisation:
    """The options in the data's unit; the prior's deviation falls linearly to zero (thesis 2.2.2)."""
    remaining = max(0.0, 1.0 - iteration / options.annealing_iterations) if options.annealing_iterations else 0.0
    added = (options.prior_fraction * scale * remaining) ** 2
    return Regularisation(
        added, floor_variance(options, scale), target, options.shrinkage_frames, options.duration_pseudocount
    )


def floor_variance(options: TrainingOptions, scale: float) -> float:
    """Smallest variance of an output distribution in any direction, in the data's unit squared."""
    return max(options.floor_fraction * scale, options.floor_deviation) ** 2
