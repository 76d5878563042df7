"""Rejection of movements that do not belong to a model: the log-likelihood distribution test (thesis 2.2.5)."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.hmm.gaussian import GaussianHMM
from paramove.hmm.left_right import LeftRightHMM
from paramove.hmm.sequences import SequenceLengthError

Model = GaussianHMM | LeftRightHMM


@dataclass(frozen=True)
class LikelihoodTest:
    """Compares ln p(X' | lambda) with the values of sequences that belong to the model.

    The p-value of X' is the fraction of (K + 1) values, including its own, that are not above its own: if X' is like
    the K others, a p-value of at most `a` has probability at most `a` for any model. It is never below 1 / (K + 1).

    The thesis draws the K sequences from the model (`of_samples`). Frames of drawn sequences are independent, those of
    people are not, so people's movements should be compared with people's movements: held out of
    training (`of_sequences`), or all of them by training without each in turn (`cross_validated`).

    Attributes:
        model: lambda.
        values: the K log-likelihoods, in increasing order.
    """

    model: Model
    values: Floats

    @classmethod
    def of_sequences(cls, model: Model, sequences: Sequence[ArrayLike]) -> Self:
        """Compare with sequences that the model was not trained on. Raises ValueError if there are none."""
        if len(sequences) == 0:
            raise ValueError("no sequences to compare with: give at least one, 19 for a level of 5 %")
        return cls(model, np.sort([_value(model, sequence) for sequence in sequences]))

    @classmethod
    def of_samples(cls, model: Model, rng: np.random.Generator, n_sequences: int = 1000) -> Self:
        """Compare with sequences drawn from the model (method A) to its finish state, as the thesis does."""
        return cls.of_sequences(model, [model.sample(rng) for _ in range(n_sequences)])

    @classmethod
    def cross_validated(cls, model: Model, sequences: Sequence[ArrayLike], n_parts: int | None = None) -> Self:
        """Compare with the training sequences, each judged by a copy of the model trained without it.

        Args:
            model: trained on all sequences; it is not changed.
            sequences: its training sequences.
            n_parts: leave out one of this many parts at a time; None leaves out single sequences.

        Raises:
            ValueError: fewer than 2 sequences or parts.
        """
        n_parts = len(sequences) if n_parts is None else n_parts
        if not 2 <= n_parts <= len(sequences):
            raise ValueError(f"n_parts is 2 to the number of sequences ({len(sequences)}), found {n_parts}")
        values = []
        for part in range(n_parts):
            without = copy.copy(model)
            without.fit([sequence for index, sequence in enumerate(sequences) if index % n_parts != part])
            values += [_value(without, sequence) for sequence in sequences[part::n_parts]]
        return cls(model, np.sort(values))

    def p_value(self, sequence: ArrayLike) -> float:
        """p(L <= L') of a new sequence, including its own value. A sequence of impossible length has the minimum."""
        not_above = int(np.searchsorted(self.values, _value(self.model, sequence), side="right"))
        return (1 + not_above) / (1 + len(self.values))

    def accepts(self, sequence: ArrayLike, level: float = 0.05) -> bool:
        """Whether the p-value is above `level`, the fraction of genuine movements that may be rejected.

        Raises ValueError if there are too few values to reject anything at this level.
        """
        if 1.0 / (1 + len(self.values)) > level:
            raise ValueError(
                f"{len(self.values)} sequences can reject nothing at level {level:g}; give at least "
                f"{int(np.ceil(1.0 / level)) - 1}, or a level of at least {1.0 / (1 + len(self.values)):.3g}"
            )
        return self.p_value(sequence) > level


def _value(model: Model, sequence: ArrayLike) -> float:
    try:
        return model.log_likelihood(sequence)
    except SequenceLengthError:
        return -np.inf
