"""Options of training an HMM: iterations, covariance prior, floor, shrinkage."""

from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats


@dataclass(frozen=True)
class TrainingOptions:
    """Options of Baum-Welch training (thesis 2.2.2, corrected by a permanent floor and shrinkage).

    Deviations are fractions of the data's root mean variance per dimension, so they need no unit.

    Attributes:
        max_iterations: maximum number of EM iterations.
        tolerance: stop when the objective gains less than this per frame.
        annealing_iterations: iterations over which the prior falls linearly to zero.
        prior_fraction: initial deviation sigma; sigma^2 I is added after each M-step while it lasts.
        floor_fraction: smallest standard deviation of an output distribution in any direction, in all iterations.
        shrinkage_frames: weight, in frames, of the pooled covariance in each covariance.
        duration_pseudocount: added to the count of each duration, so that no allowed duration becomes impossible; for a
            plain chain, to the count of each allowed transition, start and exit.
        floor_deviation: smallest standard deviation in the data's unit; the larger of the two floors holds. With it,
            dimensions that never change may be trained.
    """

    max_iterations: int = 20
    tolerance: float = 1e-3
    annealing_iterations: int = 5
    prior_fraction: float = 0.1
    floor_fraction: float = 0.005
    shrinkage_frames: float = 10.0
    duration_pseudocount: float = 0.5
    floor_deviation: float = 0.0

    def __post_init__(self) -> None:
        if self.max_iterations < 1:
            raise ValueError(f"max_iterations is at least 1, found {self.max_iterations}")
        for name, value in vars(self).items():
            if not 0 <= value < np.inf:
                raise ValueError(f"{name} is finite and not negative, found {value}")

    @classmethod
    def maximum_likelihood(cls, max_iterations: int = 20) -> "TrainingOptions":
        """No prior, floor, shrinkage or pseudocount: plain EM, whose likelihood never falls."""
        return cls(max_iterations, 0.0, 0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Regularisation:
    """The options of one iteration, in the data's unit.

    Attributes:
        added_variance: sigma^2 of the annealed prior.
        floor_variance: smallest eigenvalue of a covariance.
        target: covariances towards which each state is shrunk, shape (N, D, D).
        target_frames: weight of the target in frames.
        duration_pseudocount: added to each duration count.
    """

    added_variance: float
    floor_variance: float
    target: Floats
    target_frames: float
    duration_pseudocount: float


@dataclass(frozen=True)
class TrainingSummary:
    """Summary of a training: objective and log-likelihood per iteration, frames, sequences, whether it converged."""

    log_likelihoods: tuple[float, ...]
    objectives: tuple[float, ...]
    n_sequences: int
    n_frames: int
    converged: bool
