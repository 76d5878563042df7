"""Left-right HMMs of hmmlearn: one per action, or one per target."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import logsumexp

from paramove.documents import Floats
from paramove.hmm import resample
from studies.movements.method import FRAMES, OUTLIERS, THETA, Estimate, Examples, NotAble
from studies.peers.library import library


def left_right(n_states: int) -> Floats:
    """Transition probabilities of a chain that stays or moves on by one. Shape (N, N)."""
    stay = 1.0 - n_states / FRAMES
    matrix = stay * np.eye(n_states) + (1.0 - stay) * np.eye(n_states, k=1)
    matrix[-1, -1] = 1.0
    return matrix


def trained_hmm(sequences: list[Floats], n_states: int) -> Any:
    """A GaussianHMM with diagonal covariances on resampled movements."""
    frames = [resample(x, FRAMES) for x in sequences]
    model = library("hmmlearn.hmm", "hmmlearn").GaussianHMM(
        n_states,
        "diag",
        init_params="",
        params="tmc",
        n_iter=15,
        min_covar=1e-6,
        covars_prior=1e-5,
    )
    model.startprob_ = np.eye(n_states)[0]
    model.transmat_ = left_right(n_states)
    parts = [np.concatenate(group) for group in zip(*(np.array_split(x, n_states) for x in frames), strict=True)]
    model.means_ = np.array([part.mean(axis=0) for part in parts])
    model.covars_ = np.array([part.var(axis=0) + 1e-5 for part in parts])
    return model.fit(np.vstack(frames), [len(x) for x in frames])


class GaussianHMM(NotAble):
    """One HMM of an action; knows no parameters."""

    can = frozenset({OUTLIERS})

    def __init__(self, *, n_states: int = 20) -> None:
        self.n_states = n_states

    def fit(self, examples: Examples) -> None:
        """Learn from movements of one action."""
        self.model = trained_hmm(examples.sequences, self.n_states)

    def score(self, x: Floats) -> float:
        """Log-likelihood of the movement resampled."""
        return float(self.model.score(resample(x, FRAMES)))


class CellHMMs(NotAble):
    """One HMM per target (group); theta is the mean over the targets' thetas, weighted by likelihood."""

    can = frozenset({THETA, OUTLIERS})

    def __init__(self, *, n_states: int = 20) -> None:
        self.n_states = n_states

    def fit(self, examples: Examples) -> None:
        """Learn one model of each group."""
        self.models, targets = [], []
        for group in np.unique(examples.groups):
            own = examples.chosen(examples.groups == group)
            self.models.append(trained_hmm(own.sequences, self.n_states))
            targets.append(own.theta.mean(axis=0))
        self.targets = np.array(targets)

    def _scores(self, x: Floats) -> Floats:
        return np.array([model.score(resample(x, FRAMES)) for model in self.models])

    def estimate(self, x: Floats) -> Estimate:
        """Mean and covariance of theta under the posterior of the targets."""
        scores = self._scores(x)
        weights = np.exp(scores - logsumexp(scores))
        theta = weights @ self.targets
        off = self.targets - theta
        return Estimate(theta, np.einsum("k,ki,kj->ij", weights, off, off) + 1e-12 * np.eye(len(theta)))

    def score(self, x: Floats) -> float:
        """Log-likelihood under the best target's model."""
        return float(self._scores(x).max())
