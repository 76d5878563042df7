"""E-step and M-step of plain chains over many sequences (thesis 2.1, 2.2.1, corrected (2.21)-(2.24))."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, Ints
from paramove.hmm import chain_kernels
from paramove.hmm.estimation import Covariance, Moments, covariances_of, log_prior, whitened
from paramove.hmm.gaussians import stacked_log_outputs, stacked_moments
from paramove.hmm.options import Regularisation
from paramove.hmm.sequences import Stack

Flags = NDArray[np.bool_]
TopologyName = Literal["ergodic", "left_right", "left_right_skips"]


@dataclass(frozen=True)
class Topology:
    """Which transitions exist (thesis 2.2.1), and where a path starts and ends.

    Attributes:
        name: "ergodic" goes anywhere; "left_right" to the same and the next state (figure 2.2); "left_right_skips" also
            over up to `max_skip` states. Left-right paths start in the first state.
        max_skip: maximum number of states that one step skips.
        self_transitions: without them a path leaves its state with each frame (figure 2.3).
        finish_state: a path ends in state N + 1 (2.2.3.1), which is entered from the last state of a left-right chain.
    """

    name: TopologyName
    max_skip: int = 1
    self_transitions: bool = True
    finish_state: bool = False

    def __post_init__(self) -> None:
        if self.name not in get_args(TopologyName):
            raise ValueError(f"topology is one of {', '.join(get_args(TopologyName))}, found {self.name!r}")
        if self.max_skip < 1:
            raise ValueError(f"max_skip is at least 1 (topology 'left_right' skips none), found {self.max_skip}")
        if self.name == "ergodic" and not self.self_transitions:
            raise ValueError("an ergodic chain has self-transitions; give a left-right topology or leave them in")

    @property
    def step(self) -> int:
        """Maximum number of states that a left-right path goes forward in one frame; 0 if it may go anywhere."""
        return {"ergodic": 0, "left_right": 1, "left_right_skips": 1 + self.max_skip}[self.name]

    def transitions(self, n_states: int) -> Flags:
        """Which transitions exist. Shape (N, N)."""
        if self.name == "ergodic":
            return np.ones((n_states, n_states), dtype=bool)
        forward = np.arange(n_states)[None, :] - np.arange(n_states)[:, None]
        return (forward >= (0 if self.self_transitions else 1)) & (forward <= self.step)

    def starts(self, n_states: int) -> Flags:
        """In which states a path can start. Shape (N,)."""
        result: Flags = (np.arange(n_states) == 0) | (self.name == "ergodic")
        return result

    def exits(self, n_states: int) -> Flags:
        """From which states the finish state can be entered. Shape (N,)."""
        last = (np.arange(n_states) == n_states - 1) | (self.name == "ergodic")
        result: Flags = last & self.finish_state
        return result

    def lengths(self, n_states: int) -> tuple[int, int | None]:
        """Minimum and maximum number of frames of a path; None if there is no maximum."""
        fewest = 1 + -(-(n_states - 1) // self.step) if self.finish_state and self.step else 1
        return fewest, None if self.self_transitions else n_states


@dataclass(frozen=True)
class ChainParameters:
    """A chain lambda = (A, B, pi), with exits to the finish state where there is one.

    Attributes:
        start: pi, shape (N,).
        transitions: A, shape (N, N); rows of A and the exit together sum to one.
        exits: a_{i, N+1}, shape (N,); zero without a finish state.
        means: shape (N, D).
        covariances: shape (N, D, D), of each kind.
    """

    start: Floats
    transitions: Floats
    exits: Floats
    means: Floats
    covariances: Floats


def check_parameters(parameters: ChainParameters, topology: Topology) -> None:
    """Raise ValueError for distributions that do not sum to one or do not fit the topology."""
    n_states = len(parameters.means)
    for name, values, allowed in (
        ("start", parameters.start, topology.starts(n_states)),
        ("transitions", parameters.transitions, topology.transitions(n_states)),
        ("exits", parameters.exits, topology.exits(n_states)),
    ):
        if values.shape != allowed.shape or not np.isfinite(values).all() or (values < 0).any():
            raise ValueError(f"{name} has shape {allowed.shape} and no entry below 0, found shape {values.shape}")
        if (values[~allowed] > 0).any():
            raise ValueError(f"{name} has a probability where topology {topology.name!r} has no transition")
    if topology.finish_state and not parameters.exits.any():
        raise ValueError("no state has a transition into the finish state; give exits, or a topology without it")
    sums = np.append(parameters.transitions.sum(axis=1) + parameters.exits, parameters.start.sum())
    # The last state of a chain that never stays has nowhere to go.
    excused = np.append(~topology.transitions(n_states).any(axis=1) & ~topology.exits(n_states), False)
    if (np.abs(sums - 1.0)[~excused] > 1e-6).any():
        raise ValueError(f"each row of transitions with its exit, and start, sum to 1, found sums {sums.tolist()}")


@dataclass(frozen=True)
class ChainEvaluator:
    """Whitening matrices and logarithms for the kernels; computed once per set of parameters."""

    parameters: ChainParameters
    topology: Topology
    whitening: Floats
    log_norm: Floats
    log_start: Floats
    log_transitions: Floats
    log_exits: Floats
    diagonal: bool

    @classmethod
    def of(cls, parameters: ChainParameters, topology: Topology, kind: Covariance) -> "ChainEvaluator":
        """Prepare the parameters. Raises ValueError naming a state whose covariance is not positive definite."""
        whitening, log_norm = whitened(parameters.covariances)
        with np.errstate(divide="ignore"):
            log_start, log_transitions = np.log(parameters.start), np.log(parameters.transitions)
            log_exits = np.log(parameters.exits) if topology.finish_state else np.zeros(len(parameters.start))
        return cls(parameters, topology, whitening, log_norm, log_start, log_transitions, log_exits, kind == "diagonal")

    def windows(self, stack: Stack) -> Ints:
        """First column that a state can have in each sequence, and the one after the last. Shape (K, N, 2)."""
        topology = self.topology
        return chain_kernels.chain_windows(
            stack.offsets, len(self.log_norm), topology.step, topology.self_transitions, topology.finish_state
        )

    def log_outputs(self, stack: Stack) -> Floats:
        """ln b_i of the frames in the windows; other entries are undefined. Shape (N, frames)."""
        means = self.parameters.means[None]
        return stacked_log_outputs(
            stack.columns, self.windows(stack), means, self.whitening, self.log_norm, self.diagonal
        )

    def band(self) -> Floats:
        """ln a_{j-k, j} in [j, k]. Shape (N, step + 1)."""
        band = np.full((len(self.log_norm), self.topology.step + 1), -np.inf)
        for k in range(min(band.shape)):
            band[k:, k] = np.diagonal(self.log_transitions, k)
        return band

    def expectation(self, stack: Stack) -> tuple[Floats, Floats, "Counts"]:
        """Log-likelihoods (K,), responsibilities (N, frames) within the windows, and expected counts."""
        n_states, step = len(self.log_norm), self.topology.step
        gamma, starts, exits = np.empty((n_states, stack.n_frames)), np.zeros(n_states), np.zeros(n_states)
        outputs = self.log_outputs(stack)
        if step == 0:
            counts = np.zeros((n_states, n_states))
            values = chain_kernels.stacked_dense(
                outputs, stack.offsets, self.log_start, self.parameters.transitions, self.log_transitions,
                self.log_exits, gamma, counts, starts, exits,
            )  # fmt: skip
            return values, gamma, Counts(starts, counts, exits)
        banded = np.zeros((n_states, step + 1))
        values = chain_kernels.stacked_banded(
            outputs, stack.offsets, self.windows(stack), self.log_start, self.band(), self.log_exits,
            gamma, banded, starts, exits,
        )  # fmt: skip
        counts = np.zeros((n_states, n_states))
        for k in range(min(banded.shape)):
            np.einsum("ii->i", counts[: n_states - k, k:])[:] = banded[k:, k]
        return values, gamma, Counts(starts, counts, exits)


@dataclass(frozen=True)
class Counts:
    """Expected numbers of starts (N,), transitions (N, N) and last frames (N,) of each state."""

    starts: Floats
    transitions: Floats
    exits: Floats


@dataclass(frozen=True)
class ChainStatistics(Moments):
    """Pooled sufficient statistics of a chain."""

    counts: Counts

    @classmethod
    def of(
        cls, parameters: ChainParameters, stacks: Sequence[Stack], topology: Topology, kind: Covariance
    ) -> "ChainStatistics":
        """E-step over all stacks. Raises ValueError naming a sequence whose likelihood is zero."""
        evaluator = ChainEvaluator.of(parameters, topology, kind)
        moments = Moments.none(parameters.means)
        n_states = len(parameters.means)
        counts = Counts(np.zeros(n_states), np.zeros((n_states, n_states)), np.zeros(n_states))
        before = 0
        for stack in stacks:
            values, gamma, expected = evaluator.expectation(stack)
            if not np.isfinite(values).all():
                index = before + int(np.argmin(np.isfinite(values)))
                raise ValueError(
                    f"the model gives sequence {index} the likelihood zero: no path has its length and frames; "
                    "leave it out or train with duration_pseudocount > 0"
                )
            windows = evaluator.windows(stack)
            sums = stacked_moments(stack.columns, windows, gamma, parameters.means[None], kind == "diagonal")
            moments = moments.plus(*sums, values)
            counts = Counts(
                counts.starts + expected.starts,
                counts.transitions + expected.transitions,
                counts.exits + expected.exits,
            )
            before += len(values)
        return cls(**vars(moments), counts=counts)


def maximised(
    old: ChainParameters,
    statistics: ChainStatistics,
    regularisation: Regularisation,
    topology: Topology,
    kind: Covariance,
) -> ChainParameters:
    """M-step. A state that no path visits keeps its old values."""
    n_states = len(old.means)
    means = statistics.means()
    scatter = statistics.scatter(means)
    covariances = covariances_of(scatter, np.maximum(statistics.weight, 1e-300), regularisation, kind)
    if kind != "tied" and regularisation.target_frames == 0:
        unseen = statistics.unseen()
        covariances[unseen] = old.covariances[unseen]
    pseudocount = regularisation.duration_pseudocount
    start = statistics.counts.starts + pseudocount * topology.starts(n_states)
    transitions = statistics.counts.transitions + pseudocount * topology.transitions(n_states)
    exits = statistics.counts.exits * topology.finish_state + pseudocount * topology.exits(n_states)
    total = transitions.sum(axis=1) + exits
    known = total > 1e-300
    total = np.where(known, total, 1.0)
    return ChainParameters(
        start / start.sum(),
        np.where(known[:, None], transitions / total[:, None], old.transitions),
        np.where(known, exits / total, old.exits),
        means,
        covariances,
    )


def chain_penalty(parameters: ChainParameters, regularisation: Regularisation, topology: Topology) -> float:
    """Term that, added to the log-likelihood, gives the objective of the M-step (inverse Wishart, Dirichlet priors)."""
    total = log_prior(parameters.covariances, regularisation)
    pseudocount, n_states = regularisation.duration_pseudocount, len(parameters.means)
    if pseudocount > 0:
        for values, allowed in (
            (parameters.start, topology.starts(n_states)),
            (parameters.transitions, topology.transitions(n_states)),
            (parameters.exits, topology.exits(n_states)),
        ):
            total += pseudocount * float(np.log(values[allowed]).sum())
    return total
