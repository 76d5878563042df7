"""Linear discriminants of actions: one of complete movements, and some of beginnings, for the time that has passed.

Likelihoods of complete movements do not apply to beginnings: the progress of the movement is unknown. Its duration so
far is known, so it is compared with all training movements that last at least as long, after the same time, by their
increments since the first frame. All actions have one covariance: few movements of an action would not determine its
own, and densities of movements that lie far from every action (another person's) would compare the widths of the
actions instead of the distances from them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.special import logsumexp

from paramove.documents import Floats, Ints
from paramove.hmm import resample
from paramove.phmm.beginnings import FIRST_FRAMES, check_beginning
from paramove.phmm.left_out import folds_of
from paramove.phmm.performance import movement_parts
from paramove.phmm.predictive_distribution import PredictiveDistribution
from paramove.phmm.storage import check_shapes

SHRINKAGE, WHOLE_SHRINKAGE = 0.1, 0.02
"""Fraction of each variance that counts as independent, of beginnings and of complete movements."""
FLOOR = 1e-3
"""Smallest variance, as a fraction of the mean one of features of the same unit."""
LEAST_DURATION_DEVIATION = 0.05
"""Of the logarithm of a duration: scripts and robots may have shown one duration alone."""
TEMPERS = (1.0, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.05)
"""Candidates for the factor on distances: features are not as normally distributed as the model assumes."""
WHOLE = 0
"""Number of frames that stands for complete movements."""
POINTS, GROWTH = 5, 1.25
"""Beginnings are described by 5 points, at 5 frames and then at every length a quarter longer."""


@dataclass(frozen=True)
class Discriminant:
    """A linear discriminant of all actions, of complete movements or after n frames.

    Attributes:
        n_frames: that have passed; 0 for complete movements.
        means: of the features, one row per action; zero for an action that never lasts so long. Shape (A, n).
        root: triangular root of the common covariance, shape (n, n).
        log_priors: logarithm of each action's fraction of the training movements of that length; -inf for none, (A,).
        temper: factor on the distances.
        usual: of the logarithm of the squared distance of a genuine movement from its action's mean, one per action.
    """

    n_frames: int
    means: Floats
    root: Floats
    log_priors: Floats
    temper: float = 1.0
    usual: tuple[PredictiveDistribution, ...] = ()

    @classmethod
    def fitted(cls, sequences: Sequence[Floats], actions: Ints, n_actions: int, groups: Ints, n_frames: int) -> Self:
        """From movements that last so long, their actions (K,) and groups (K,)."""
        features = np.stack([discriminant_features(sequence, n_frames) for sequence in sequences])
        scores, distances = np.zeros(len(TEMPERS)), np.full(len(features), np.nan)
        for tested, others in folds_of(groups):
            left_out = cls._estimated(features[others], actions[others], n_actions, n_frames)
            squared = left_out.distances(features[tested])
            distances[tested] = squared[np.arange(len(tested)), actions[tested]]
            for index, temper in enumerate(TEMPERS):
                log_probabilities = left_out._normalised(squared, temper)
                scores[index] += np.maximum(log_probabilities[np.arange(len(tested)), actions[tested]], -20.0).sum()
        known = [np.flatnonzero((actions == action) & np.isfinite(distances)) for action in range(n_actions)]
        usual = tuple(PredictiveDistribution.of(np.log(distances[own] + 1e-9), groups[own]) for own in known)
        everything = cls._estimated(features, actions, n_actions, n_frames)
        return replace(everything, temper=TEMPERS[int(scores.argmax())], usual=usual)

    @classmethod
    def _estimated(cls, features: Floats, actions: Ints, n_actions: int, n_frames: int) -> Self:
        counts = np.bincount(actions, minlength=n_actions)
        means = np.zeros((n_actions, features.shape[1]))
        np.add.at(means, actions, features)
        means /= np.maximum(counts, 1)[:, None]
        deviations, n_parts = features - means[actions], features.shape[1] - (n_frames == WHOLE)
        scale = np.full(features.shape[1], deviations[:, :n_parts].std() + 1e-12)
        scale[n_parts:] = features[:, n_parts:].std(axis=0) + 1e-12
        deviations /= scale
        moments = deviations.T @ deviations / max(1, len(features) - int((counts > 0).sum()))
        shrinkage = WHOLE_SHRINKAGE if n_frames == WHOLE else SHRINKAGE
        moments[n_parts:, n_parts:] += (LEAST_DURATION_DEVIATION / scale[n_parts:]) ** 2
        moments += shrinkage * (np.diag(np.diagonal(moments)) - moments) + FLOOR * np.eye(len(moments))
        root = (scale[:, None] * np.linalg.cholesky(moments)).astype(np.float64)
        with np.errstate(divide="ignore"):
            log_priors = np.log(counts / counts.sum()).astype(np.float64)
        return cls(n_frames, means, root, log_priors)

    def log_probabilities(self, sequence: Floats) -> Floats:
        """Of the actions, for a movement that has lasted at least `n_frames`. Shape (A,)."""
        result: Floats = self._normalised(self._distances_of(sequence), self.temper)[0]
        return result

    def p_value(self, sequence: Floats, action: int) -> float:
        """Probability that a genuine movement of the action lies at least as far from its mean; NaN if unknown."""
        return float(
            np.exp(self.usual[action].log_above(float(np.log(self._distances_of(sequence)[0, action] + 1e-9))))
        )

    def _distances_of(self, sequence: Floats) -> Floats:
        features = discriminant_features(sequence, self.n_frames)
        if len(features) != len(self.root):
            raise ValueError(f"expected frames with the coordinates of the training, found {sequence.shape[1]}")
        return self.distances(features[None])

    def distances(self, features: Floats) -> Floats:
        """Squared, of movements with features (K, n) from the means of the actions. Shape (K, A)."""
        missed = (features[:, None] - self.means[None]).reshape(-1, features.shape[1])
        white = np.linalg.solve(self.root, missed.T)
        result: Floats = (white**2).sum(axis=0).reshape(len(features), -1)
        return result

    def _normalised(self, distances: Floats, temper: float) -> Floats:
        """Log-probabilities of the actions from distances (K, A)."""
        scores = self.log_priors - 0.5 * temper * distances
        result: Floats = scores - logsumexp(scores, axis=1, keepdims=True)
        return result

    def arrays(self, number: int) -> dict[str, Floats]:
        """Everything learned, for a file, by names with a number."""
        rows = [(one.mean, 1.0 / one.deviation, one.freedom) for one in self.usual]
        scalars = np.array([self.n_frames, self.temper, *np.exp(self.log_priors)])
        return {
            f"means{number}": self.means, f"root{number}": self.root, f"scalars{number}": scalars,
            f"usual{number}": np.array(rows),
        }  # fmt: skip

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Floats], number: int, n_actions: int) -> Self:
        """From the result of `arrays`. Raises KeyError for a missing array, ValueError for shapes that do not fit."""
        means, root, scalars, usual = (arrays[f"{name}{number}"] for name in ("means", "root", "scalars", "usual"))
        check_shapes(arrays, {f"means{number}": (n_actions, root.shape[-1]), f"root{number}": (means.shape[-1],) * 2})
        check_shapes(arrays, {f"scalars{number}": (2 + n_actions,), f"usual{number}": (n_actions, 3)})
        with np.errstate(divide="ignore"):
            log_priors, deviations = np.log(scalars[2:]), 1.0 / usual[:, 1]
        rows = zip(usual[:, 0].tolist(), deviations.tolist(), usual[:, 2].tolist(), strict=True)
        known = tuple(PredictiveDistribution(*row) for row in rows)
        return cls(int(scalars[0]), means, root, log_priors, float(scalars[1]), known)


def discriminants(sequences: Sequence[Floats], actions: Ints, n_actions: int, groups: Ints) -> tuple[Discriminant, ...]:
    """Of complete movements, and of beginnings of every number of frames of a geometric grid, up to the lengths."""
    lengths = np.array([len(sequence) for sequence in sequences])
    result, n_frames = [Discriminant.fitted(sequences, actions, n_actions, groups, WHOLE)], float(FIRST_FRAMES)
    while round(n_frames) <= np.quantile(lengths, 0.95):
        long = np.flatnonzero(lengths >= round(n_frames))
        own = [sequences[k] for k in long.tolist()]
        result.append(Discriminant.fitted(own, actions[long], n_actions, groups[long], round(n_frames)))
        n_frames *= GROWTH
    return tuple(result)


def discriminant_for(every: Sequence[Discriminant], n_frames: int, finished: bool) -> Discriminant:
    """That of complete movements, or the last one of beginnings of no more than so many frames.

    Raises ValueError if there is none, and for fewer frames than any beginning has.
    """
    if finished:
        return every[0]
    if len(every) < 2:
        raise ValueError("only a classifier trained with `fit` on all actions together classifies beginnings")
    check_beginning(n_frames, every[1].n_frames)
    return [one for one in every[1:] if one.n_frames <= n_frames][-1]


def discriminant_features(sequence: Floats, n_frames: int) -> Floats:
    """Parts of a complete movement and the logarithm of its length, (6 D + 1,); of a beginning its increments (4 D,).

    The latter do not depend on where it begins.
    """
    if n_frames == WHOLE:
        return np.append(movement_parts(sequence), np.log(len(sequence)))
    return np.diff(resample(sequence[:n_frames], POINTS), axis=0).ravel()
