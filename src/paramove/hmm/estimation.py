"""E-step statistics and M-step of Baum-Welch over many sequences (thesis 2.1.6, 2.2.3.2, corrected).

Output covariances are full, diagonal or tied, with prior, shrinkage and floor (thesis 2.2.2).

Corrected (2.21)-(2.24): responsibilities are already normalised per sequence, so no factor 1/p_k.
Corrected 2.2.3.2: the statistics of tied sub-states are pooled; with explicit durations they are never separate.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, Ints
from paramove.hmm import kernels
from paramove.hmm.gaussians import whitening_of
from paramove.hmm.options import Regularisation
from paramove.hmm.sequences import Stack

Covariance = Literal["full", "diagonal", "tied"]
UNSEEN = 1e-20  # frames; responsibilities below 1e-30 are left out of the moments


@dataclass(frozen=True)
class Parameters:
    """One left-right HMM with explicit durations.

    Attributes:
        means: shape (N, D).
        covariances: shape (N, D, D).
        durations: p_i(d) in column d - 1, zero for d < d_min; shape (N, d_max).
        d_min: smallest number of frames of a state.
    """

    means: Floats
    covariances: Floats
    durations: Floats
    d_min: int


def whitened(covariances: Floats) -> tuple[Floats, Floats]:
    """Inverse Cholesky factors, shape (N, D, D), and ln of the densities at the means, shape (N,).

    Raises ValueError naming a state whose covariance is not positive definite.
    """
    whitening, log_determinant, bad = whitening_of(np.ascontiguousarray(covariances))
    if bad >= 0 or not np.isfinite(log_determinant).all():
        state = max(bad, 0) if bad >= 0 else int(np.argmin(np.isfinite(log_determinant)))
        finite = np.isfinite(covariances[state]).all()
        minimum = f"smallest eigenvalue {np.linalg.eigvalsh(covariances[state])[0]:.3g}" if finite else "not finite"
        raise ValueError(
            f"the covariance of state {state} is not positive definite ({minimum}); train with a floor, with more "
            "sequences or with fewer states"
        )
    return whitening, -0.5 * (covariances.shape[1] * np.log(2.0 * np.pi) + log_determinant)


@dataclass(frozen=True)
class Evaluator:
    """Whitening matrices and log densities for the kernels; computed once per set of parameters."""

    means: Floats
    whitening: Floats
    log_norm: Floats
    log_duration: Floats
    d_min: int

    @classmethod
    def of(cls, parameters: Parameters) -> "Evaluator":
        """Prepare the parameters. Raises ValueError naming a state whose covariance is not positive definite."""
        means = parameters.means
        whitening, log_norm = whitened(parameters.covariances)
        with np.errstate(divide="ignore"):
            log_duration = np.log(parameters.durations)
        return cls(np.ascontiguousarray(means), whitening, log_norm, log_duration, parameters.d_min)

    def ends(self, n_frames: int) -> Ints:
        """Feasible numbers of frames used after each state. Shape (N + 1, 2)."""
        return kernels.feasible_ends(len(self.means), self.d_min, self.log_duration.shape[1], n_frames)

    def log_outputs(self, stack: Stack, diagonal: bool = False, means: Floats | None = None) -> Floats:
        """ln b_i(x_t) of the feasible pairs; other entries are undefined. Shape (N, frames).

        Sequences may have means of their own, (K, N, D).
        """
        means = self.means[None] if means is None else means
        return kernels.stacked_log_outputs(
            stack.columns, self.windows(stack), means, self.whitening, self.log_norm, diagonal
        )

    def log_likelihood(self, sequence: Floats) -> float:
        """ln p(X | lambda) with the finish state."""
        outputs = self.log_outputs(Stack.of([sequence]))
        return float(kernels.segments_log_likelihood(outputs, self.log_duration, self.d_min))

    def expectation(self, sequence: Floats) -> tuple[float, Floats, Floats]:
        """Log-likelihood, responsibilities (T, N) and expected duration counts (N, d_max).

        Raises ValueError where the likelihood is zero, since there are no responsibilities then.
        """
        gamma, counts = np.zeros((len(self.means), len(sequence))), np.zeros_like(self.log_duration)
        values = self.stacked_expectation(Stack.of([sequence]), gamma, counts)
        return float(values[0]), gamma.T, counts

    def stacked_expectation(
        self,
        stack: Stack,
        gamma: Floats,
        counts: Floats,
        diagonal: bool = False,
        before: int = 0,
        means: Floats | None = None,
    ) -> Floats:
        """Log-likelihood of each sequence, shape (K,).

        Writes the responsibilities within the feasible windows to gamma (N, frames), adds to counts (N, d_max).
        Sequences may have means of their own, (K, N, D).
        Raises ValueError naming a sequence whose likelihood is zero, since there are no responsibilities then; `before`
        sequences are in other stacks.
        """
        outputs = self.log_outputs(stack, diagonal, means)
        values = kernels.stacked_segments(outputs, stack.offsets, self.log_duration, self.d_min, gamma, counts)
        if not np.isfinite(values).all():
            index = int(np.argmin(np.isfinite(values)))
            raise ValueError(
                f"the model gives sequence {before + index} of {stack.lengths[index]} frames the likelihood zero: "
                "its durations exclude this length; train with duration_pseudocount > 0"
            )
        return values

    def windows(self, stack: Stack) -> Ints:
        """First column that a state can have in each sequence, and the one after the last. Shape (K, N, 2)."""
        return kernels.segment_windows(stack.offsets, len(self.means), self.d_min, self.log_duration.shape[1])


@dataclass(frozen=True)
class Moments:
    """Sums over frames of gamma, gamma (x - ref) and gamma (x - ref)(x - ref)^T for each state.

    Attributes:
        reference: shape (N, D).
        weight: shape (N,).
        first: shape (N, D).
        second: shape (N, D, D).
        log_likelihood: of all sequences.
    """

    reference: Floats
    weight: Floats
    first: Floats
    second: Floats
    log_likelihood: float

    @classmethod
    def none(cls, reference: Floats) -> "Moments":
        """Of no frames."""
        n_states, dim = reference.shape
        return Moments(reference, np.zeros(n_states), np.zeros((n_states, dim)), np.zeros((n_states, dim, dim)), 0.0)

    def plus(self, weight: Floats, first: Floats, second: Floats, values: Floats) -> "Moments":
        """With those of more frames, whose sequences have the log-likelihoods `values`, shape (K,)."""
        return Moments(
            self.reference,
            self.weight + weight,
            self.first + first,
            self.second + second,
            self.log_likelihood + float(values.sum()),
        )

    def unseen(self) -> NDArray[np.bool_]:
        """States that practically no frame belongs to. Shape (N,)."""
        return self.weight < UNSEEN

    def means(self) -> Floats:
        """Weighted means, corrected (2.23) and (3.7); of an unseen state the reference. Shape (N, D)."""
        unseen = self.unseen()
        return self.reference + self.first * (~unseen / np.where(unseen, 1.0, self.weight))[:, None]

    def scatter(self, means: Floats) -> Floats:
        """Sum of gamma (x - mu)(x - mu)^T about the given means. Shape (N, D, D)."""
        shift = means - self.reference
        cross = self.first[:, :, None] * shift[:, None, :]
        squared = self.weight[:, None, None] * shift[:, :, None] * shift[:, None, :]
        return self.second - cross - np.swapaxes(cross, 1, 2) + squared


@dataclass(frozen=True)
class Statistics(Moments):
    """Pooled sufficient statistics, with expected counts of durations (N, d_max)."""

    durations: Floats

    @classmethod
    def gathered(cls, parameters: Parameters, sequences: Sequence[Floats]) -> "Statistics":
        """E-step over all sequences."""
        return cls.of(parameters, Stack.parts(sequences, len(parameters.means)))

    @classmethod
    def of(cls, parameters: Parameters, stacks: Sequence[Stack], kind: Covariance = "full") -> "Statistics":
        """E-step over all stacks; of diagonal covariances the second moments are diagonals alone."""
        evaluator, diagonal = Evaluator.of(parameters), kind == "diagonal"
        moments, durations = Moments.none(evaluator.means), np.zeros_like(parameters.durations)
        gamma = np.empty((len(parameters.means), max(stack.n_frames for stack in stacks)))
        before = 0
        for stack in stacks:
            values = evaluator.stacked_expectation(stack, gamma, durations, diagonal, before)
            windows = evaluator.windows(stack)
            sums = kernels.stacked_moments(stack.columns, windows, gamma, evaluator.means[None], diagonal)
            moments = moments.plus(*sums, values)
            before += len(values)
        return cls(**vars(moments), durations=durations)


def check_kind(kind: str) -> None:
    """Raise ValueError for a kind of covariance that does not exist."""
    if kind not in get_args(Covariance):
        raise ValueError(f"covariance is one of {', '.join(get_args(Covariance))}, found {kind!r}")


def covariances_of(
    scatter: Floats, weight: Floats, regularisation: Regularisation, kind: Covariance = "full"
) -> Floats:
    """Covariances with prior, shrinkage and floor; the exact M-step of the penalised objective once sigma is zero.

    Sigma_i = (scatter_i + kappa target_i) / (weight_i + kappa) + sigma^2 I, eigenvalues not below the floor. "diagonal"
    keeps the diagonals of scatter and target, "tied" takes sums over all states. Shape (N, D, D) for each kind.
    """
    kappa = regularisation.target_frames
    pooled = scatter + kappa * regularisation.target
    frames = weight + kappa
    if kind == "diagonal":
        pooled = pooled * np.eye(scatter.shape[1])
    elif kind == "tied":
        pooled, frames = pooled.sum(axis=0, keepdims=True), frames.sum(keepdims=True)
    covariances: Floats = pooled / frames[:, None, None]
    if regularisation.added_variance > 0:
        covariances += regularisation.added_variance * np.eye(scatter.shape[1])
    lifted = floored(covariances, regularisation.floor_variance)
    return np.repeat(lifted, len(scatter), axis=0) if kind == "tied" else lifted


def floored(covariances: Floats, floor_variance: float) -> Floats:
    """The covariances with every eigenvalue at least `floor_variance`. Shape (N, D, D)."""
    # Where the difference to the floor has a Cholesky factor, no eigenvalue is below it: a tenth of the work.
    if floor_variance <= 0 or whitening_of(covariances - floor_variance * np.eye(covariances.shape[1]))[2] < 0:
        return covariances
    values, vectors = np.linalg.eigh(0.5 * (covariances + np.swapaxes(covariances, 1, 2)))
    if (values >= floor_variance).all():
        return covariances
    lifted = np.maximum(values, floor_variance)
    result: Floats = (vectors * lifted[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    return 0.5 * (result + np.swapaxes(result, 1, 2))


def pooled_covariance(scatter: Floats, weight: Floats) -> Floats:
    """Mean covariance over the states, repeated for each state. Shape (N, D, D)."""
    return np.broadcast_to(scatter.sum(axis=0) / weight.sum(), scatter.shape)


def log_prior(covariances: Floats, regularisation: Regularisation) -> float:
    """The shrinkage as the logarithm of an inverse Wishart prior, up to a constant."""
    if regularisation.target_frames == 0:
        return 0.0
    whitening, log_determinant, bad = whitening_of(covariances)
    if bad >= 0:
        return -np.inf
    traces = ((whitening @ regularisation.target) * whitening).sum()
    return -0.5 * regularisation.target_frames * float(log_determinant.sum() + traces)


def durations_of(counts: Floats, d_min: int, pseudocount: float) -> Floats:
    """Duration distributions from expected counts. Shape (N, d_max)."""
    raised = counts.copy()
    raised[:, d_min - 1 :] += pseudocount
    result: Floats = raised / raised.sum(axis=1, keepdims=True)
    return result


def penalty(parameters: Parameters, regularisation: Regularisation) -> float:
    """Term that, added to the log-likelihood, gives the objective of the M-step (inverse Wishart, Dirichlet priors)."""
    total = log_prior(parameters.covariances, regularisation)
    if regularisation.duration_pseudocount > 0:
        allowed = parameters.durations[:, parameters.d_min - 1 :]
        total += regularisation.duration_pseudocount * float(np.log(allowed).sum())
    return total
