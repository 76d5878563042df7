"""Synchronised local HMMs: states of all grid points model the same part of the movement (thesis 3.4.1)."""

from collections.abc import Sequence

import numpy as np

from paramove.documents import Floats
from paramove.hmm import (
    Parameters,
    Statistics,
    TrainingOptions,
    covariances_of,
    durations_of,
    regularisation_at,
    root_mean_deviation,
)

AFTER_ANNEALING = 10**6


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
    regularisation = regularisation_at(AFTER_ANNEALING, options, scale, target)
    return [
        Parameters(
            mean,
            covariances_of(scatter, weight, regularisation),
            durations_of(one.durations, d_min, options.duration_pseudocount),
            d_min,
        )
        for one, mean, scatter, weight in zip(gathered, means, scatters, weights, strict=True)
    ]
