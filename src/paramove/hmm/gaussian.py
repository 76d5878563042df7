"""The plain HMM with one Gaussian per state: ergodic or left-right, with or without finish state (thesis 2.1, 2.2).

Baum-Welch begins with equal parts of each sequence, of an ergodic chain with clusters, or with drawn parameters.
"""

from collections.abc import Sequence
from functools import partial
from typing import Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.hmm import synthesis
from paramove.hmm.chain import (
    ChainEvaluator,
    ChainParameters,
    ChainStatistics,
    Topology,
    TopologyName,
    chain_penalty,
    check_parameters,
    maximised,
)
from paramove.hmm.chain_kernels import best_path
from paramove.hmm.estimation import Covariance, check_kind
from paramove.hmm.filtering import ChainFilter
from paramove.hmm.options import TrainingOptions, TrainingSummary
from paramove.hmm.sequences import (
    SequenceLengthError,
    Stack,
    check_demonstrations,
    checked_sequence,
    checked_sequences,
    not_fitted,
    resample,
)
from paramove.hmm.training import iterate, segment_outputs

Initialisation = Literal["segments", "random"]
CLUSTER_STARTS = 10
"""k-means depends on where it starts; the clusters with the smallest spread are taken."""


def initial_chain(
    sequences: Sequence[Floats],
    n_states: int,
    topology: Topology,
    kind: Covariance,
    options: TrainingOptions,
    initialisation: Initialisation,
    seed: int,
) -> ChainParameters:
    """First parameters.

    "segments" cuts each sequence into N equal parts and lets each state last as long as its part; an ergodic chain,
    whose states may return, takes N clusters of frames instead. "random" draws the cuts of each sequence and all
    probabilities that the topology leaves open.
    """
    # A sequence with fewer frames than states is stretched, for each state needs a frame to begin with.
    stretched = [one if len(one) >= n_states else resample(one, n_states) for one in sequences]
    mean_length = float(np.mean([len(sequence) for sequence in sequences]))
    starts, exits = topology.starts(n_states).astype(np.float64), topology.exits(n_states).astype(np.float64)
    allowed = topology.transitions(n_states).astype(np.float64)
    if initialisation == "random":
        rng = np.random.default_rng(seed)
        labels = [_drawn_labels(len(sequence), n_states, rng) for sequence in stretched]
        starts, exits, allowed = (rng.exponential(size=one.shape) * one for one in (starts, exits, allowed))
    else:
        labels = [np.arange(len(sequence)) * n_states // len(sequence) for sequence in stretched]
        if topology.name == "ergodic":
            labels = _clusters(stretched, labels, n_states, seed)
        if topology.self_transitions:
            leaving = allowed.sum(axis=1) - 1.0 + exits
            stay = max(mean_length / n_states - 1.0, 0.5)  # a_ii / (1 - a_ii) of the expected duration
            np.einsum("ii->i", allowed)[:] = np.where(leaving > 0, stay * leaving, 1.0)
    means, covariances = segment_outputs(stretched, labels, n_states, options, kind)
    total = allowed.sum(axis=1) + exits
    total[total == 0] = 1.0
    return ChainParameters(starts / starts.sum(), allowed / total[:, None], exits / total, means, covariances)


def _clusters(sequences: Sequence[Floats], parts: list[Ints], n_states: int, seed: int) -> list[Ints]:
    """The cluster of each frame (k-means++, in units of the coordinates' deviations).

    `parts` where one stays empty, as it must with fewer different frames than states.
    """
    from scipy.cluster.vq import ClusterError, kmeans2  # a tenth of a second, for ergodic chains only

    frames = np.concatenate(list(sequences))
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = (frames - frames.mean(axis=0)) / np.maximum(frames.std(axis=0), 1e-12)
    if not np.isfinite(scaled).all() or len(np.unique(scaled.round(6), axis=0)) < n_states:
        return parts
    best: Ints | None = None
    smallest = np.inf
    for start in range(CLUSTER_STARTS):
        try:
            centres, numbers = kmeans2(
                scaled, n_states, minit="++", missing="raise", rng=np.random.default_rng(seed + start)
            )
        except ClusterError:
            continue
        spread = float(((scaled - centres[numbers]) ** 2).sum())
        if len(np.unique(numbers)) == n_states and spread < smallest:
            best = np.asarray(numbers, dtype=np.int64)
            smallest = spread
    if best is None:
        return parts
    return np.split(best, np.cumsum([len(sequence) for sequence in sequences])[:-1])


def _drawn_labels(n_frames: int, n_states: int, rng: np.random.Generator) -> Ints:
    cuts = np.sort(rng.choice(np.arange(1, n_frames), n_states - 1, replace=False))
    return np.searchsorted(cuts, np.arange(n_frames), side="right").astype(np.int64)


class GaussianHMM:
    """A hidden Markov model lambda = (A, B, pi) with Gaussian outputs, trained by Baum-Welch on several sequences.

    Args:
        n_states: N.
        topology: "left_right" (figure 2.2), "left_right_skips" or "ergodic".
        max_skip: maximum number of states that one step of "left_right_skips" skips.
        self_transitions: False for left-right paths that leave a state with each frame (figure 2.3).
        finish_state: whether each path ends in the finish state N + 1 (2.2.3.1).
        covariance: "full", "diagonal" or "tied" (one for all states).
        initialisation: "segments" cuts each sequence into N equal parts, or of an ergodic chain takes N clusters of all
            frames; "random" draws the cuts.
        seed: of what is drawn.
        options: of the training.

    Attributes:
        start_: pi, shape (N,).
        transitions_: A, shape (N, N).
        exits_: a_{i, N+1}, shape (N,); zero without finish state.
        means_: shape (N, D), in the unit of the sequences.
        covariances_: shape (N, D, D) for each kind of covariance.
        training_: summary of the training; None if the parameters were given.

    Raises:
        ValueError: for a count below 1 or an unknown name.
    """

    def __init__(
        self,
        n_states: int,
        *,
        topology: TopologyName = "left_right",
        max_skip: int = 1,
        self_transitions: bool = True,
        finish_state: bool = False,
        covariance: Covariance = "full",
        initialisation: Initialisation = "segments",
        seed: int = 0,
        options: TrainingOptions | None = None,
    ) -> None:
        if n_states < 1:
            raise ValueError(f"n_states is at least 1, found {n_states}")
        check_kind(covariance)
        if initialisation not in get_args(Initialisation):
            raise ValueError(
                f"initialisation is one of {', '.join(get_args(Initialisation))}, found {initialisation!r}"
            )
        self.n_states, self.covariance, self.initialisation, self.seed = n_states, covariance, initialisation, seed
        self.topology = Topology(topology, max_skip, self_transitions, finish_state)
        self.options = options if options is not None else TrainingOptions()
        self.training_: TrainingSummary | None = None
        self._evaluator: ChainEvaluator | None = None

    def with_parameters(self, parameters: ChainParameters) -> Self:
        """Set parameters that were trained elsewhere. Raises ValueError if they do not fit the topology."""
        check_parameters(parameters, self.topology)
        if len(parameters.means) != self.n_states:
            raise ValueError(f"the model has {self.n_states} states, the parameters {len(parameters.means)}")
        self._evaluator = ChainEvaluator.of(parameters, self.topology, self.covariance)
        self.training_ = None
        return self

    @property
    def parameters(self) -> ChainParameters:
        """All parameters together. Raises NotFittedError before training."""
        return self._ready().parameters

    @property
    def start_(self) -> Floats:
        """pi. Shape (N,)."""
        return self.parameters.start

    @property
    def transitions_(self) -> Floats:
        """A. Shape (N, N)."""
        return self.parameters.transitions

    @property
    def exits_(self) -> Floats:
        """Probabilities of the transitions into the finish state. Shape (N,)."""
        return self.parameters.exits

    @property
    def means_(self) -> Floats:
        """State means. Shape (N, D)."""
        return self.parameters.means

    @property
    def covariances_(self) -> Floats:
        """State covariances. Shape (N, D, D)."""
        return self.parameters.covariances

    def fit(self, sequences: Sequence[ArrayLike], initial: ChainParameters | None = None) -> Self:
        """Train by Baum-Welch on sequences of shape (T_k, D), of any lengths that the topology has paths for.

        Args:
            sequences: the demonstrations.
            initial: where to begin, instead of the initialisation.

        Raises:
            SequenceLengthError: no path has the length of a sequence.
            ValueError: bad values, copies, dimensions that never change, or initial parameters that do not fit; the
                sequence or dimension is named.
        """
        checked = checked_sequences(sequences)
        for index, sequence in enumerate(checked):
            self._check_length(len(sequence), f"sequence {index}: ")
        check_demonstrations(checked, self.options.floor_deviation)
        if initial is None:
            initial = initial_chain(
                checked, self.n_states, self.topology, self.covariance, self.options, self.initialisation, self.seed
            )
        check_parameters(initial, self.topology)
        stacks = Stack.parts(checked, self.n_states)
        parameters, summary = iterate(
            initial,
            checked,
            self.options,
            partial(ChainStatistics.of, stacks=stacks, topology=self.topology, kind=self.covariance),
            partial(maximised, topology=self.topology, kind=self.covariance),
            partial(chain_penalty, topology=self.topology),
        )
        self.with_parameters(parameters)
        self.training_ = summary
        return self

    def log_likelihood(self, sequence: ArrayLike) -> float:
        """ln p(X | lambda); with a finish state over the paths that end in it.

        -inf if the probabilities exclude the sequence. Raises SequenceLengthError where no path has its length.
        """
        return float(self._ready().expectation(self._stacked(sequence))[0][0])

    def responsibilities(self, sequence: ArrayLike) -> Floats:
        """gamma_i(t) = p(q_t = i | X, lambda) (2.14). Shape (T, N), rows sum to one.

        Raises ValueError for a sequence of likelihood zero.
        """
        stack = self._stacked(sequence)
        ready = self._ready()
        values, gamma, _ = ready.expectation(stack)
        if not np.isfinite(values[0]):
            raise ValueError("the model excludes this sequence (likelihood zero), so no state is responsible for it")
        windows, frames = ready.windows(stack)[0], np.arange(stack.n_frames)[:, None]
        return np.where((frames >= windows[:, 0]) & (frames < windows[:, 1]), gamma.T, 0.0)

    def decode(self, sequence: ArrayLike) -> Ints:
        """State of each frame on the likeliest path (Viterbi). Shape (T,), counted from 0."""
        ready, stack = self._ready(), self._stacked(sequence)
        windows, frames = ready.windows(stack)[0], np.arange(stack.n_frames)
        feasible = (frames >= windows[:, :1]) & (frames < windows[:, 1:])
        outputs = np.where(feasible, ready.log_outputs(stack), -np.inf)
        width = self.topology.step + 1 if self.topology.step else 0
        return best_path(outputs, ready.log_start, ready.log_transitions, ready.log_exits, width)[1]

    def filter(self) -> ChainFilter:
        """State probabilities of a new movement, frame by frame without lookahead."""
        return ChainFilter(self._ready())

    def expected_durations(self) -> Floats:
        """Expected number of consecutive frames of each state, 1 / (1 - a_ii) (2.2.4). Shape (N,).

        Infinite for a state that is never left, such as the last one of a left-right chain without finish state.
        """
        leaving = 1.0 - np.diagonal(self.transitions_)
        with np.errstate(divide="ignore"):
            return np.where(leaving > 1e-12, 1.0 / leaving, np.inf)

    def synthesize(
        self, n_samples: int | None = None, timing: synthesis.Timing = "uniform", path: synthesis.Path = "linear"
    ) -> Floats:
        """The prototype movement (method D): means in order, see `synthesis.prototype`. Shape (n_samples, D).

        A last state that is never left counts as long as the mean of the others. Raises ValueError for an ergodic
        chain, whose states have no order.
        """
        if self.topology.name == "ergodic":
            raise ValueError("method D needs the states in order; an ergodic chain has none: draw with sample instead")
        lengths = self.expected_durations()
        endless = ~np.isfinite(lengths)
        lengths[endless] = lengths[~endless].mean() if not endless.all() else 2.0
        return synthesis.prototype(self.means_, lengths, n_samples, timing, path)

    def sample(self, rng: np.random.Generator, n_frames: int | None = None) -> Floats:
        """One sequence drawn from the model (method A), to the finish state or of `n_frames`. Shape (T, D).

        Raises ValueError if there is neither.
        """
        return synthesis.emitted(self._path(rng, n_frames), self.means_, self.covariances_, rng)

    def sample_average(self, rng: np.random.Generator, n_sequences: int = 100, n_frames: int | None = None) -> Floats:
        """The average of many drawn sequences, each stretched to the mean length (method B). Shape (T, D)."""
        return synthesis.averaged([self.sample(rng, n_frames) for _ in range(n_sequences)])

    def sample_spline(self, rng: np.random.Generator, n_frames: int | None = None) -> Floats:
        """A spline through one drawn output per stay in a state (method C). Shape (T, D)."""
        return synthesis.splined(self._path(rng, n_frames), self.means_, self.covariances_, rng)

    def _path(self, rng: np.random.Generator, n_frames: int | None) -> Ints:
        if n_frames is None and not self.topology.finish_state:
            raise ValueError("without finish state a path has no end: give n_frames")
        own = self.parameters
        return synthesis.drawn_path(own.start, own.transitions, own.exits, n_frames, rng)

    def _ready(self) -> ChainEvaluator:
        if self._evaluator is None:
            raise not_fitted("this HMM has no parameters yet: call fit or with_parameters")
        return self._evaluator

    def _stacked(self, sequence: ArrayLike) -> Stack:
        checked = checked_sequence(sequence, self.means_.shape[1])
        self._check_length(len(checked), "")
        return Stack.of([checked])

    def _check_length(self, n_frames: int, prefix: str) -> None:
        minimum, maximum = self.topology.lengths(self.n_states)
        if n_frames < minimum or (maximum is not None and n_frames > maximum):
            allowed = f"at least {minimum}" if maximum is None else f"{minimum} to {maximum}"
            raise SequenceLengthError(
                f"{prefix}a sequence of {n_frames} frames has no path through {self.n_states} states of this topology: "
                f"allowed are {allowed} frames; resample it, or change n_states"
            )
