"""E-step statistics and M-step of Baum-Welch over many sequences (thesis 2.1.6, 2.2.3.2, corrected).

Corrected (2.21)-(2.24): responsibilities are already normalised per sequence, so no factor 1/p_k.
Corrected 2.2.3.2: the statistics of tied sub-states are pooled; with explicit durations they are never apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paramove.hmm import kernels
from paramove.hmm.options import Regularisation

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Parameters:
    """One left-right HMM with explicit durations.

    Attributes:
        means: shape (N, D).
        covariances: shape (N, D, D).
        durations: p_i(d) in column d - 1, zero for d < d_min; shape (N, d_max).
        d_min: least number of frames of a state.
    """

    means: Floats
    covariances: Floats
    durations: Floats
    d_min: int


@dataclass(frozen=True)
class Evaluator:
    """Whitening matrices and log densities ready for the kernels; made once per set of parameters."""

    means: Floats
    whitening: Floats
    log_norm: Floats
    log_duration: Floats
    d_min: int

    @classmethod
    def of(cls, parameters: Parameters) -> "Evaluator":
        """Prepare the parameters. Raises ValueError naming a state whose covariance is not positive definite."""
        means, covariances = parameters.means, parameters.covariances
        dim = means.shape[1]
        try:
            factors = np.linalg.cholesky(covariances)
        except np.linalg.LinAlgError as error:
            least = np.linalg.eigvalsh(covariances)[:, 0]
            raise ValueError(
                f"the covariance of state {int(least.argmin())} is not positive definite (least eigenvalue "
                f"{least.min():.3g}); train with a floor or with more sequences"
            ) from error
        whitening = np.ascontiguousarray(np.linalg.inv(factors))
        log_determinant = 2.0 * np.log(np.diagonal(factors, axis1=1, axis2=2)).sum(axis=1)
        with np.errstate(divide="ignore"):
            log_duration = np.log(parameters.durations)
        log_norm = -0.5 * (dim * np.log(2.0 * np.pi) + log_determinant)
        return cls(np.ascontiguousarray(means), whitening, log_norm, log_duration, parameters.d_min)

    def ends(self, n_frames: int) -> NDArray[np.int64]:
        """Feasible numbers of frames used after each state. Shape (N + 1, 2)."""
        return kernels.feasible_ends(len(self.means), self.d_min, self.log_duration.shape[1], n_frames)

    def log_outputs(self, sequence: Floats) -> Floats:
        """ln b_i(x_t) of the feasible pairs. Shape (T, N)."""
        return kernels.log_outputs(sequence, self.means, self.whitening, self.log_norm, self.ends(len(sequence)))

    def log_likelihood(self, sequence: Floats) -> float:
        """ln p(X | lambda) with the finish state."""
        ends = self.ends(len(sequence))
        outputs = kernels.log_outputs(sequence, self.means, self.whitening, self.log_norm, ends)
        return float(kernels.forward(outputs, self.log_duration, self.d_min, ends)[-1, -1])

    def expectation(self, sequence: Floats) -> tuple[float, Floats, Floats]:
        """Log-likelihood, responsibilities (T, N) and expected duration counts (N, d_max).

        Raises ValueError where the likelihood is zero, since there are no responsibilities then.
        """
        ends = self.ends(len(sequence))
        outputs = kernels.log_outputs(sequence, self.means, self.whitening, self.log_norm, ends)
        ending = kernels.forward(outputs, self.log_duration, self.d_min, ends)
        if not np.isfinite(ending[-1, -1]):
            raise ValueError(f"the model gives a sequence of {len(sequence)} frames the likelihood zero: its durations "
                             "exclude this length; train with duration_pseudocount > 0")  # fmt: skip
        following = kernels.backward(outputs, self.log_duration, self.d_min, ends)
        gamma, counts = kernels.posteriors(outputs, self.log_duration, self.d_min, ends, ending, following)
        return float(ending[-1, -1]), gamma, counts


@dataclass(frozen=True)
class Statistics:
    """Pooled sufficient statistics; moments are taken about `reference`, shape (N, D)."""

    reference: Floats
    weight: Floats
    first: Floats
    second: Floats
    durations: Floats
    log_likelihood: float

    @classmethod
    def gathered(cls, parameters: Parameters, sequences: Sequence[Floats]) -> "Statistics":
        """E-step over all sequences."""
        evaluator = Evaluator.of(parameters)
        n_states, dim = parameters.means.shape
        weight, first, second = np.zeros(n_states), np.zeros((n_states, dim)), np.zeros((n_states, dim, dim))
        durations = np.zeros_like(parameters.durations)
        log_likelihood = 0.0
        for sequence in sequences:
            value, gamma, counts = evaluator.expectation(sequence)
            log_likelihood += value
            durations += counts
            ends = evaluator.ends(len(sequence))
            kernels.add_moments(sequence, gamma, ends, evaluator.means, weight, first, second)
        lower = np.tril(second, -1)
        second = second + np.swapaxes(lower, 1, 2)
        return cls(evaluator.means, weight, first, second, durations, log_likelihood)

    def means(self) -> Floats:
        """Weighted means, corrected (2.23) and (3.7). Shape (N, D)."""
        result: Floats = self.reference + self.first / self.weight[:, None]
        return result

    def scatter(self, means: Floats) -> Floats:
        """Sum of gamma (x - mu)(x - mu)^T about the given means. Shape (N, D, D)."""
        shift = means - self.reference
        cross = self.first[:, :, None] * shift[:, None, :]
        squared = self.weight[:, None, None] * shift[:, :, None] * shift[:, None, :]
        result: Floats = self.second - cross - np.swapaxes(cross, 1, 2) + squared
        return result


def covariances_of(scatter: Floats, weight: Floats, regularisation: Regularisation) -> Floats:
    """Covariances with prior, shrinkage and floor; the exact M-step of the penalised objective once sigma is zero.

    Sigma_i = (scatter_i + kappa target_i) / (weight_i + kappa) + sigma^2 I, eigenvalues not below the floor.
    """
    kappa = regularisation.target_frames
    pooled = scatter + kappa * regularisation.target
    covariances: Floats = pooled / (weight + kappa)[:, None, None]
    covariances += regularisation.added_variance * np.eye(scatter.shape[1])
    return floored(covariances, regularisation.floor_variance)


def floored(covariances: Floats, floor_variance: float) -> Floats:
    """The covariances with every eigenvalue at least `floor_variance`. Shape (N, D, D)."""
    values, vectors = np.linalg.eigh(0.5 * (covariances + np.swapaxes(covariances, 1, 2)))
    if (values >= floor_variance).all():
        return covariances
    lifted = np.maximum(values, floor_variance)
    result: Floats = (vectors * lifted[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    return 0.5 * (result + np.swapaxes(result, 1, 2))


def pooled_covariance(scatter: Floats, weight: Floats) -> Floats:
    """Mean covariance over the states, repeated for each state. Shape (N, D, D)."""
    return np.broadcast_to(scatter.sum(axis=0) / weight.sum(), scatter.shape)


def durations_of(counts: Floats, d_min: int, pseudocount: float) -> Floats:
    """Duration distributions from expected counts. Shape (N, d_max)."""
    raised = counts.copy()
    raised[:, d_min - 1 :] += pseudocount
    result: Floats = raised / raised.sum(axis=1, keepdims=True)
    return result


def penalty(parameters: Parameters, regularisation: Regularisation) -> float:
    """What makes the log-likelihood the objective that the M-step maximises (inverse Wishart, Dirichlet terms)."""
    total = 0.0
    if regularisation.duration_pseudocount > 0:
        allowed = parameters.durations[:, parameters.d_min - 1 :]
        total += regularisation.duration_pseudocount * float(np.log(allowed).sum())
    if regularisation.target_frames > 0:
        log_determinants = np.linalg.slogdet(parameters.covariances)[1]
        ratio = np.linalg.solve(parameters.covariances, regularisation.target)
        traces = np.trace(ratio, axis1=1, axis2=2)
        total -= 0.5 * regularisation.target_frames * float((log_determinants + traces).sum())
    return total
