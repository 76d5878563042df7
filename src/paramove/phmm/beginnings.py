"""Which action a movement is going to be, from its first frames: discriminants by the time that has passed.

Likelihoods of complete movements do not serve here: nobody knows how far a movement has come. What is known is how long
it has lasted, so all training movements that lasted as long are compared with it after the same time, by how they went
on since their first frame, with one covariance for all actions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from paramove.documents.array_types import Floats, Ints
from paramove.phmm.left_out import fold_numbers
from paramove.phmm.performance import BEGINNING_POINTS, FIRST_FRAMES, GROWTH, beginning_features

SHRINKAGE = 0.1
"""Share of each variance that is taken for independent."""
TEMPERS = (1.0, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.05)
"""Candidates for the share of the distances that counts: features are not as normal as the model says."""


@dataclass(frozen=True)
class BeginningDiscriminant:
    """A linear discriminant of all actions after n frames.

    Attributes:
        n_frames: that have passed.
        means: of the features, one row per action; NaN-free, zero for an action that never lasts so long. Shape (A, n).
        root: triangular root of the common covariance, shape (n, n).
        log_shares: logarithm of each action's share of the training movements that last so long; -inf for none, (A,).
        temper: share of the distances that counts.
    """

    n_frames: int
    means: Floats
    root: Floats
    log_shares: Floats
    temper: float

    @classmethod
    def fitted(
        cls, features: Floats, actions: Ints, n_actions: int, groups: Ints, n_frames: int
    ) -> BeginningDiscriminant:
        """From features (K, n) of movements that last so long, their actions (K,) and groups (K,)."""
        start = cls._estimated(features, actions, n_actions, n_frames)
        folds = fold_numbers(groups)
        scores = np.zeros(len(TEMPERS))
        for fold in np.unique(folds):
            tested = folds == fold
            if not (~tested).any():
                continue
            other = cls._estimated(features[~tested], actions[~tested], n_actions, n_frames)
            for place, temper in enumerate(TEMPERS):
                found = other._log_probabilities(features[tested], temper)
                scores[place] += np.maximum(found[np.arange(len(found)), actions[tested]], -20.0).sum()
        return cls(n_frames, start.means, start.root, start.log_shares, TEMPERS[int(scores.argmax())])

    @classmethod
    def _estimated(cls, features: Floats, actions: Ints, n_actions: int, n_frames: int) -> BeginningDiscriminant:
        counts = np.bincount(actions, minlength=n_actions)
        means = np.zeros((n_actions, features.shape[1]))
        np.add.at(means, actions, features)
        means /= np.maximum(counts, 1)[:, None]
        deviations = features - means[actions]
        moments = deviations.T @ deviations / max(1, len(features) - int((counts > 0).sum()))
        diagonal = np.diagonal(moments)
        moments = (1.0 - SHRINKAGE) * moments + SHRINKAGE * np.diag(diagonal)
        moments += 1e-3 * diagonal.mean() * np.eye(len(moments)) + 1e-12 * np.eye(len(moments))
        root = np.linalg.cholesky(moments).astype(np.float64)
        with np.errstate(divide="ignore"):
            log_shares = np.log(counts / counts.sum()).astype(np.float64)
        return cls(n_frames, means, root, log_shares, 1.0)

    def log_probabilities(self, sequence: Floats) -> Floats:
        """Of the actions, for a movement that has lasted at least `n_frames`. Shape (A,)."""
        features = growth_features(sequence, self.n_frames)[None]
        result: Floats = self._log_probabilities(features, self.temper)[0]
        return result

    def _log_probabilities(self, features: Floats, temper: float) -> Floats:
        white_means = np.linalg.solve(self.root, self.means.T).T
        white = np.linalg.solve(self.root, features.T).T
        distances = ((white[:, None] - white_means[None]) ** 2).sum(axis=2)
        scores = self.log_shares - 0.5 * temper * distances
        result: Floats = scores - logsumexp(scores, axis=1, keepdims=True)
        return result


def growth_features(sequence: Floats, n_frames: int) -> Floats:
    """How a movement goes on in its first frames, wherever it began: increments. Shape (4 D,)."""
    features = beginning_features(sequence, n_frames).reshape(BEGINNING_POINTS, -1)
    return features[1:].ravel()


def discriminants(
    sequences: Sequence[Floats], actions: Ints, n_actions: int, groups: Ints
) -> tuple[BeginningDiscriminant, ...]:
    """One for every number of frames of a geometric raster, as long as movements of training last."""
    lengths = np.array([len(sequence) for sequence in sequences])
    result, n_frames = [], float(FIRST_FRAMES)
    while round(n_frames) <= np.quantile(lengths, 0.95):
        count = round(n_frames)
        long = np.flatnonzero(lengths >= count)
        features = np.stack([growth_features(sequences[k], count) for k in long.tolist()])
        result.append(BeginningDiscriminant.fitted(features, actions[long], n_actions, groups[long], count))
        n_frames *= GROWTH
    return tuple(result)
