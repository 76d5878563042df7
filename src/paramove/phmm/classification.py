"""Classification of movements into actions, with theta and rejection of unknown ones (thesis 4.1.2.3, 2.2.5).

The beginning of a movement is classified from its first frames, by discriminants for the time that has passed.

Likelihoods of complete movements do not apply to beginnings: the progress of the movement is unknown. Its duration so
far is known, so it is compared with all training movements that last at least as long, after the same time, by their
increments since the first frame, with one covariance for all actions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import logsumexp

from paramove.documents import Floats, Ints, renamed_attribute
from paramove.hmm import checked_sequence, checked_sequences, not_fitted, resample
from paramove.phmm.beginnings import FIRST_FRAMES, check_beginning
from paramove.phmm.examining import has_p_values
from paramove.phmm.left_out import fold_numbers
from paramove.phmm.parametric import ParameterEstimate, ParametricHMM
from paramove.phmm.performance import groups_of
from paramove.phmm.polynomial import QuadraticPHMM
from paramove.phmm.storage import ModelFileError, ModelRecord, read_record, write_record

SHRINKAGE = 0.1
"""Fraction of each variance that counts as independent."""
TEMPERS = (1.0, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.05)
"""Candidates for the factor on distances: features are not as normally distributed as the model assumes."""
POINTS, GROWTH = 5, 1.25
"""Beginnings are described by 5 points, at 5 frames and then at every length a quarter longer."""
INDEX_FILE = "classifier.npz"


@dataclass(frozen=True)
class Classification:
    """Result of classifying a movement.

    Attributes:
        action: the most probable action.
        posterior: probability of each action.
        estimates: of theta under each action.
        p_value: probability that a genuine movement of this action has at least this outlier score; a small one is a
            reason to reject the movement. 1 from models without a distribution of executions.
    """

    action: str
    posterior: dict[str, float]
    estimates: dict[str, ParameterEstimate]
    p_value: float

    typicality = renamed_attribute("typicality", "p_value")


class MovementClassifier:
    """Classifies movements, complete or just begun, by competing movement models.

    Args:
        model: untrained model of every action, or a mapping from actions to untrained models. Without one:
            `QuadraticPHMM()`.

    Attributes:
        classes_: names of the actions, sorted.
        models_: the trained model of each action.
    """

    def __init__(self, model: ParametricHMM | Mapping[str, ParametricHMM] | None = None) -> None:
        self.model = model
        self.models_: dict[str, ParametricHMM] = {}
        self.classes_: tuple[str, ...] = ()
        self._beginnings: tuple[BeginningDiscriminant, ...] = ()

    @classmethod
    def from_models(cls, models: Mapping[str, ParametricHMM]) -> Self:
        """From trained models of several actions. They classify complete movements, but not beginnings."""
        if not models:
            raise ValueError("expected at least one model, found none")
        classifier = cls()
        classifier.classes_ = tuple(sorted(models))
        classifier.models_ = {action: models[action] for action in classifier.classes_}
        return classifier

    def fit(
        self, sequences: Sequence[ArrayLike], theta: ArrayLike, labels: Sequence[str], groups: ArrayLike | None = None
    ) -> Self:
        """Train on sequences (T_k, D) with theta (K, P), names of the actions, and groups as in a model's `fit`.

        Raises ValueError for labels whose number differs, or for which there is no model.
        """
        checked = checked_sequences(sequences)
        parameters = np.asarray(theta, dtype=np.float64).reshape(len(checked), -1)
        names = np.asarray(labels)
        if names.shape != (len(checked),):
            raise ValueError(f"labels has one action per sequence: expected {len(checked)}, found {names.shape}")
        self.classes_ = tuple(sorted({str(name) for name in names}))
        numbers = groups_of(groups, parameters)
        self.models_ = {}
        for action in self.classes_:
            own = np.flatnonzero(names == action)
            model = self._untrained(action)
            try:
                self.models_[action] = model.fit([checked[k] for k in own.tolist()], parameters[own], numbers[own])
            except ValueError as error:
                raise ValueError(f"action {action!r}: {error}") from error
        actions = np.searchsorted(self.classes_, names)
        self._beginnings = discriminants(checked, actions, len(self.classes_), numbers)
        return self

    def classify(self, sequence: ArrayLike, *, finished: bool = True) -> Classification:
        """Classifies a movement, or, with `finished=False`, the beginning of one.

        Raises ValueError for a beginning that is shorter than those modelled, or if there were no training movements.
        """
        checked = checked_sequence(sequence)
        results = {action: _result(model, checked, finished) for action, model in self._trained().items()}
        if finished:
            scores = np.array([score for _, score, _ in results.values()])
            log_posterior = scores - logsumexp(scores)
        else:
            log_posterior = self._discriminant(len(checked)).log_probabilities(checked)
        best = self.classes_[int(log_posterior.argmax())]
        return Classification(
            best,
            {action: float(np.exp(value)) for action, value in zip(self.classes_, log_posterior, strict=True)},
            {action: estimate for action, (estimate, _, _) in results.items()},
            results[best][2],
        )

    def predict(self, sequences: Sequence[ArrayLike], *, finished: bool = True) -> NDArray[np.str_]:
        """The most probable action of each sequence."""
        return np.array([self.classify(sequence, finished=finished).action for sequence in sequences])

    def score(self, sequences: Sequence[ArrayLike], labels: Sequence[str], *, finished: bool = True) -> float:
        """Fraction of sequences whose action is correct."""
        return float(np.mean(self.predict(sequences, finished=finished) == np.asarray(labels)))

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Constructor arguments, and as `model__name` those of the model, as scikit-learn expects."""
        nested = self.model.get_params() if deep and isinstance(self.model, ParametricHMM) else {}
        return {"model": self.model} | {f"model__{name}": value for name, value in nested.items()}

    def set_params(self, **parameters: Any) -> Self:
        """Change constructor arguments. Raises ValueError for an unknown name."""
        self.model = parameters.pop("model", self.model)
        for name, value in parameters.items():
            if not name.startswith("model__") or not isinstance(self.model, ParametricHMM):
                raise ValueError(
                    f"a {type(self).__name__} has the parameters {sorted(self.get_params())}, found {name!r}"
                )
            self.model.set_params(**{name.removeprefix("model__"): value})
        return self

    def save(self, folder: str | Path) -> None:
        """Write a folder with a model file per action, each usable alone, and an index."""
        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        for action, model in self._trained().items():
            model.save(path / _file_name(action))
        arrays: dict[str, Floats] = {}
        for number, one in enumerate(self._beginnings):
            arrays[f"means{number}"], arrays[f"root{number}"] = one.means, one.root
            arrays[f"scalars{number}"] = np.array([one.n_frames, one.temper, *np.exp(one.log_priors)])
        write_record(
            path / INDEX_FILE, ModelRecord(type(self).__name__, {"actions": list(self.classes_)}, None, arrays)
        )

    @classmethod
    def load(cls, folder: str | Path) -> Self:
        """Read what `save` wrote. Raises ModelFileError for missing, damaged or foreign files."""
        path = Path(folder)
        record = read_record(path / INDEX_FILE)
        if record.class_name != cls.__name__:
            raise ModelFileError(f"{path / INDEX_FILE}: expected a {cls.__name__}, found a {record.class_name}")
        actions = record.parameters.get("actions")
        if not isinstance(actions, tuple) or not all(isinstance(action, str) for action in actions) or not actions:
            raise ModelFileError(f"{path / INDEX_FILE}: expected the names of actions, found {actions!r:.80}")
        classifier = cls.from_models({action: ParametricHMM.load(path / _file_name(action)) for action in actions})
        try:
            classifier._beginnings = tuple(
                _discriminant_from(record.arrays, number, len(actions)) for number in range(len(record.arrays) // 3)
            )
        except (KeyError, ValueError) as error:
            raise ModelFileError(f"{path / INDEX_FILE}: {error}") from error
        return classifier

    def _untrained(self, action: str) -> ParametricHMM:
        if isinstance(self.model, Mapping):
            if action not in self.model:
                raise ValueError(f"there are models for {sorted(self.model)}, found sequences of {action!r}")
            return self.model[action]
        if self.model is None:
            return QuadraticPHMM()
        return type(self.model)(**self.model.get_params())

    def _trained(self) -> dict[str, ParametricHMM]:
        if not self.models_:
            raise not_fitted("this classifier is not trained yet: call fit, or load a folder")
        return self.models_

    def _discriminant(self, n_frames: int) -> BeginningDiscriminant:
        if not self._beginnings:
            raise ValueError("only a classifier trained with `fit` on all actions together classifies beginnings")
        check_beginning(n_frames, self._beginnings[0].n_frames)
        return [one for one in self._beginnings if one.n_frames <= n_frames][-1]


def _result(model: ParametricHMM, sequence: Floats, finished: bool) -> tuple[ParameterEstimate, float, float]:
    """Estimate of theta, score of a complete movement, and p-value.

    Scores of models with correlated residuals are logarithms of p-values: densities of movements that lie far from
    every model (another person's) would compare the widths of the models instead of the distances from them.
    """
    if has_p_values(model):
        examination = model.examine(sequence, finished=finished)
        return examination.estimate, examination.log_p_value, examination.p_value
    estimate = model.estimate(sequence, finished=finished)
    # Neighbouring frames are redundant: the frames of a state count as one.
    frames = model.resampled_frames_ or len(sequence)
    return estimate, estimate.log_likelihood * model.n_states / frames, 1.0


def _file_name(action: str) -> str:
    if not action or not all(letter.isalnum() or letter in " _-." for letter in action) or action.startswith("."):
        raise ValueError(f"the name of an action that is saved has letters, digits, ' _-.' only, found {action!r}")
    return f"{action}.model.npz"


def _discriminant_from(arrays: Mapping[str, Floats], number: int, n_actions: int) -> BeginningDiscriminant:
    means, root, scalars = arrays[f"means{number}"], arrays[f"root{number}"], arrays[f"scalars{number}"]
    if means.ndim != 2 or len(means) != n_actions or root.shape != (means.shape[1],) * 2:
        raise ValueError(f"expected means of {n_actions} actions and a square root, found {means.shape}, {root.shape}")
    if scalars.shape != (2 + n_actions,):
        raise ValueError(f"expected {2 + n_actions} numbers in scalars{number}, found shape {scalars.shape}")
    with np.errstate(divide="ignore"):
        log_priors = np.log(scalars[2:])
    return BeginningDiscriminant(int(scalars[0]), means, root, log_priors, float(scalars[1]))


@dataclass(frozen=True)
class BeginningDiscriminant:
    """A linear discriminant of all actions after n frames.

    Attributes:
        n_frames: that have passed.
        means: of the features, one row per action; NaN-free, zero for an action that never lasts so long. Shape (A, n).
        root: triangular root of the common covariance, shape (n, n).
        log_priors: logarithm of each action's fraction of the training movements of that length; -inf for none, (A,).
        temper: factor on the distances.
    """

    n_frames: int
    means: Floats
    root: Floats
    log_priors: Floats
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
            for index, temper in enumerate(TEMPERS):
                log_probabilities = other._log_probabilities(features[tested], temper)
                own = log_probabilities[np.arange(len(log_probabilities)), actions[tested]]
                scores[index] += np.maximum(own, -20.0).sum()
        return cls(n_frames, start.means, start.root, start.log_priors, TEMPERS[int(scores.argmax())])

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
            log_priors = np.log(counts / counts.sum()).astype(np.float64)
        return cls(n_frames, means, root, log_priors, 1.0)

    def log_probabilities(self, sequence: Floats) -> Floats:
        """Of the actions, for a movement that has lasted at least `n_frames`. Shape (A,)."""
        features = growth_features(sequence, self.n_frames)[None]
        result: Floats = self._log_probabilities(features, self.temper)[0]
        return result

    def _log_probabilities(self, features: Floats, temper: float) -> Floats:
        white_means = np.linalg.solve(self.root, self.means.T).T
        white = np.linalg.solve(self.root, features.T).T
        distances = ((white[:, None] - white_means[None]) ** 2).sum(axis=2)
        scores = self.log_priors - 0.5 * temper * distances
        result: Floats = scores - logsumexp(scores, axis=1, keepdims=True)
        return result


def growth_features(sequence: Floats, n_frames: int) -> Floats:
    """Increments of a movement over its first frames, independent of its starting point. Shape (4 D,)."""
    return np.diff(resample(sequence[:n_frames], POINTS), axis=0).ravel()


def discriminants(
    sequences: Sequence[Floats], actions: Ints, n_actions: int, groups: Ints
) -> tuple[BeginningDiscriminant, ...]:
    """One for every number of frames of a geometric grid, up to the lengths of the training movements."""
    lengths = np.array([len(sequence) for sequence in sequences])
    result, n_frames = [], float(FIRST_FRAMES)
    while round(n_frames) <= np.quantile(lengths, 0.95):
        count = round(n_frames)
        long = np.flatnonzero(lengths >= count)
        features = np.stack([growth_features(sequences[k], count) for k in long.tolist()])
        result.append(BeginningDiscriminant.fitted(features, actions[long], n_actions, groups[long], count))
        n_frames *= GROWTH
    return tuple(result)
