"""The left-right no-skip HMM with explicit durations and a finish state (thesis 2.2)."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.hmm import kernels, synthesis
from paramove.hmm.estimation import Covariance, Evaluator, Parameters, check_kind
from paramove.hmm.filtering import DurationFilter
from paramove.hmm.options import TrainingOptions, TrainingSummary
from paramove.hmm.sequences import (
    Stack,
    check_demonstrations,
    check_length,
    checked_sequence,
    checked_sequences,
    not_fitted,
)
from paramove.hmm.training import equal_segments, train


class LeftRightHMM:
    """A movement as N states passed in order, each for d_min to d_max frames, with Gaussian outputs.

    Thesis 2.2.3.1 (finish state) and 2.2.3.2 (explicit time restrictions), in the explicit-duration form, which gives
    the same likelihood as the expanded states (corrected statistics, see `paramove.hmm.estimation`).

    Args:
        n_states: N.
        d_min, d_max: minimum and maximum frames of each state.
        covariance: "full"; "diagonal", with independent dimensions; "tied", one for all states.
        options: of the training.

    Attributes:
        means_: shape (N, D), in the unit of the sequences.
        covariances_: shape (N, D, D).
        durations_: p_i(d) in column d - 1, shape (N, d_max).
        training_: summary of the training; None if the parameters were given.

    Raises:
        ValueError: for counts below 1, d_min > d_max or an unknown covariance.
    """

    def __init__(
        self,
        n_states: int,
        d_min: int,
        d_max: int,
        *,
        covariance: Covariance = "full",
        options: TrainingOptions | None = None,
    ) -> None:
        if n_states < 1 or not 1 <= d_min <= d_max:
            raise ValueError(
                "n_states is at least 1 and 1 <= d_min <= d_max, found "
                f"n_states={n_states}, d_min={d_min}, d_max={d_max}"
            )
        check_kind(covariance)
        self.n_states, self.d_min, self.d_max, self.covariance = n_states, d_min, d_max, covariance
        self.options = options if options is not None else TrainingOptions()
        self.training_: TrainingSummary | None = None
        self._parameters: Parameters | None = None
        self._evaluator: Evaluator | None = None

    @classmethod
    def from_parameters(cls, parameters: Parameters, options: TrainingOptions | None = None) -> Self:
        """A model with known parameters."""
        hmm = cls(len(parameters.means), parameters.d_min, parameters.durations.shape[1], options=options)
        hmm._parameters = parameters
        return hmm

    @property
    def parameters(self) -> Parameters:
        """Means, covariances and durations together. Raises NotFittedError before training."""
        if self._parameters is None:
            raise not_fitted("this HMM has no parameters yet: call fit, or use from_parameters")
        return self._parameters

    @property
    def means_(self) -> Floats:
        """State means. Shape (N, D)."""
        return self.parameters.means

    @property
    def covariances_(self) -> Floats:
        """State covariances. Shape (N, D, D)."""
        return self.parameters.covariances

    @property
    def durations_(self) -> Floats:
        """Duration distributions p_i(d) in column d - 1. Shape (N, d_max)."""
        return self.parameters.durations

    def fit(self, sequences: Sequence[ArrayLike], initial: Parameters | None = None) -> Self:
        """Train by Baum-Welch on sequences of shape (T_k, D), lengths between N d_min and N d_max.

        It begins with `initial`, by default with equal segments.

        Raises SequenceLengthError for an impossible length and ValueError for bad values, copies and dimensions that
        never change; the sequence or dimension is named.
        """
        checked = checked_sequences(sequences)
        for index, sequence in enumerate(checked):
            check_length(len(sequence), self.n_states, self.d_min, self.d_max, f"sequence {index}: ")
        check_demonstrations(checked, self.options.floor_deviation)
        if initial is None:
            initial = equal_segments(checked, self.n_states, self.d_min, self.d_max, self.options, self.covariance)
        self._parameters, self.training_ = train(initial, checked, self.options, self.covariance)
        self._evaluator = None
        return self

    def log_likelihood(self, sequence: ArrayLike) -> float:
        """ln p(X | lambda), every path ending in the finish state.

        Raises SequenceLengthError for an impossible length.
        """
        return self._ready().log_likelihood(self._checked(sequence))

    def responsibilities(self, sequence: ArrayLike) -> Floats:
        """gamma_i(t) = p(q_t = i | X, lambda) (2.14). Shape (T, N), rows sum to one."""
        return self._ready().expectation(self._checked(sequence))[1]

    def decode(self, sequence: ArrayLike) -> Ints:
        """State of each frame in the best segmentation (Viterbi). Shape (T,), counted from 0."""
        return np.repeat(np.arange(self.n_states), np.diff(self.segment_borders(sequence)))

    def segment_borders(self, sequence: ArrayLike) -> Ints:
        """First frame of each state in the best segmentation, then T. Shape (N + 1,)."""
        checked, ready = self._checked(sequence), self._ready()
        outputs, ends = ready.log_outputs(Stack.of([checked])), ready.ends(len(checked))
        return kernels.best_segmentation(outputs, ready.log_duration, self.d_min, ends)[1]

    def filter(self) -> DurationFilter:
        """State probabilities of a new movement, frame by frame without lookahead."""
        ready = self._ready()
        return DurationFilter(self.durations_, ready.means, ready.whitening, ready.log_norm)

    def expected_durations(self) -> Floats:
        """Expected number of frames of each state (2.28). Shape (N,)."""
        return synthesis.expected_durations(self.durations_)

    def synthesize(
        self, n_samples: int | None = None, timing: synthesis.Timing = "uniform", path: synthesis.Path = "linear"
    ) -> Floats:
        """The prototype movement (method D): means in order, see `synthesis.prototype`. Shape (n_samples, D)."""
        return synthesis.prototype(self.means_, self.expected_durations(), n_samples, timing, path)

    def sample(self, rng: np.random.Generator) -> Floats:
        """One sequence drawn from the model (method A). Shape (T, D)."""
        return synthesis.emitted(self._path(rng), self.means_, self.covariances_, rng)

    def sample_average(self, rng: np.random.Generator, n_sequences: int = 100) -> Floats:
        """The average of many drawn sequences (method B). Shape (T, D)."""
        return synthesis.averaged([self.sample(rng) for _ in range(n_sequences)])

    def sample_spline(self, rng: np.random.Generator) -> Floats:
        """A spline through one drawn output per state (method C). Shape (T, D)."""
        return synthesis.splined(self._path(rng), self.means_, self.covariances_, rng)

    def _path(self, rng: np.random.Generator) -> Ints:
        return np.repeat(np.arange(self.n_states), synthesis.drawn_durations(self.durations_, rng))

    def _ready(self) -> Evaluator:
        if self._evaluator is None:
            self._evaluator = Evaluator.of(self.parameters)
        return self._evaluator

    def _checked(self, sequence: ArrayLike) -> Floats:
        checked = checked_sequence(sequence, self.means_.shape[1])
        check_length(len(checked), self.n_states, self.d_min, self.d_max)
        return checked
