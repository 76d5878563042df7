"""Classification of movements into actions, with theta and rejection of unknown ones (thesis 4.1.2.3, 2.2.5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import logsumexp

from paramove.documents import Floats, InputError, checked_name, renamed_attribute
from paramove.hmm import checked_sequence, checked_sequences, not_fitted
from paramove.phmm.discriminant import Discriminant, discriminant_for, discriminants
from paramove.phmm.estimates import ParameterEstimate
from paramove.phmm.parametric import ParametricHMM, has_p_values
from paramove.phmm.performance import groups_of
from paramove.phmm.polynomial import QuadraticPHMM
from paramove.phmm.storage import ModelFileError, ModelRecord, read_record, write_record

INDEX_FILE = "classifier.npz"


@dataclass(frozen=True)
class Classification:
    """Result of classifying a movement.

    Attributes:
        action: the most probable action.
        posterior: probability of each action.
        estimates: of theta under each action that has one.
        p_value: probability that a genuine movement of this action has at least this outlier score; a small one is a
            reason to reject the movement. 1 from models without a distribution of executions.
    """

    action: str
    posterior: dict[str, float]
    estimates: dict[str, ParameterEstimate]
    p_value: float

    typicality = renamed_attribute("typicality", "p_value")


class MovementClassifier:
    """Classifies movements, complete or just begun, by one discriminant of all actions; models give theta.

    Args:
        model: untrained model of every action that has theta, or a mapping from actions to untrained models. Without
            one: `QuadraticPHMM()`.

    Attributes:
        classes_: names of the actions, sorted.
        models_: the trained model of each action that has theta.
    """

    def __init__(self, model: ParametricHMM | Mapping[str, ParametricHMM] | None = None) -> None:
        self.model = model
        self.models_: dict[str, ParametricHMM] = {}
        self.classes_: tuple[str, ...] = ()
        self._discriminants: tuple[Discriminant, ...] = ()

    @classmethod
    def from_models(cls, models: Mapping[str, ParametricHMM]) -> Self:
        """From trained models of several actions. Their p-values compete; they do not classify beginnings."""
        if not models:
            raise ValueError("expected at least one model, found none")
        classifier = cls()
        classifier.classes_ = tuple(sorted(models))
        classifier.models_ = {action: models[action] for action in classifier.classes_}
        return classifier

    def fit(
        self,
        sequences: Sequence[ArrayLike],
        theta: ArrayLike | None,
        labels: Sequence[str],
        groups: ArrayLike | None = None,
    ) -> Self:
        """Train on sequences (T_k, D) with theta (K, P), names of the actions, and groups as in a model's `fit`.

        Actions without theta, such as waving, have NaN in theta; None if no action has any. They get no model.

        Raises ValueError for labels whose number differs, or for which there is no model.
        """
        checked = checked_sequences(sequences)
        parameters = np.full((len(checked), 1), np.nan) if theta is None else np.asarray(theta, dtype=np.float64)
        parameters = parameters.reshape(len(checked), -1)
        names = np.asarray(labels)
        if names.shape != (len(checked),):
            raise ValueError(f"labels has one action per sequence: expected {len(checked)}, found {names.shape}")
        self.classes_ = tuple(sorted({str(name) for name in names}))
        with_theta = ~np.isnan(parameters).all(axis=1)
        numbers = np.arange(len(checked)) + len(checked) if groups is None else groups_of(groups, parameters)
        if groups is None and with_theta.any():
            numbers[with_theta] = groups_of(None, parameters[with_theta])
        self.models_ = {}
        for action in self.classes_:
            own = np.flatnonzero(names == action)
            if not with_theta[own].any():
                continue
            model = self._untrained(action)
            try:
                self.models_[action] = model.fit([checked[k] for k in own.tolist()], parameters[own], numbers[own])
            except ValueError as error:
                raise ValueError(f"action {action!r}: {error}") from error
        actions = np.searchsorted(self.classes_, names)
        self._discriminants = discriminants(checked, actions, len(self.classes_), numbers)
        return self

    def classify(self, sequence: ArrayLike, *, finished: bool = True) -> Classification:
        """Classifies a movement, or, with `finished=False`, the beginning of one.

        Raises ValueError for a beginning that is shorter than those modelled, or if there were no training movements.
        """
        self._check_trained()
        checked = checked_sequence(sequence)
        results = {action: _result(model, checked, finished) for action, model in self.models_.items()}
        if self._discriminants or not finished:
            discriminant = discriminant_for(self._discriminants, len(checked), finished)
            log_posterior = discriminant.log_probabilities(checked)
        else:  # every action has a model
            scores = np.array([score for _, score, _ in results.values()])
            log_posterior = scores - logsumexp(scores)
        number = int(log_posterior.argmax())
        best = self.classes_[number]
        if best in self.models_:
            self.models_[best]._warn(checked, finished)
        p_value = results[best][2] if best in results else discriminant.p_value(checked, number)
        posterior = {action: float(np.exp(value)) for action, value in zip(self.classes_, log_posterior, strict=True)}
        return Classification(best, posterior, {action: one for action, (one, _, _) in results.items()}, p_value)

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
        """Write a folder with a model file per action, each usable alone, and an index.

        Raises InputError, and writes nothing, for the name of an action that no file can have.
        """
        self._check_trained()
        path = Path(folder)
        files = {action: path / _file_name(action) for action in self.models_}
        path.mkdir(parents=True, exist_ok=True)
        for action, model in self.models_.items():
            model.save(files[action])
        arrays: dict[str, Floats] = {}
        for number, one in enumerate(self._discriminants):
            arrays |= one.arrays(number)
        actions = {"actions": list(self.classes_), "without_theta": sorted(set(self.classes_) - set(self.models_))}
        write_record(path / INDEX_FILE, ModelRecord(type(self).__name__, actions, None, arrays))

    @classmethod
    def load(cls, folder: str | Path) -> Self:
        """Read what `save` wrote. Raises ModelFileError for missing, damaged or foreign files."""
        path = Path(folder)
        record = read_record(path / INDEX_FILE)
        if record.class_name != cls.__name__:
            raise ModelFileError(f"{path / INDEX_FILE}: expected a {cls.__name__}, found a {record.class_name}")
        actions, without = (record.parameters.get(name) for name in ("actions", "without_theta"))
        if not _are_names(actions) or not _are_names(without) or not actions:
            raise ModelFileError(f"{path / INDEX_FILE}: expected the names of actions, found {actions!r:.80}")
        classifier = cls()
        classifier.classes_ = tuple(sorted(actions))
        with_theta = [action for action in classifier.classes_ if action not in without]
        files = {action: path / _file_name(action, ModelFileError) for action in with_theta}
        classifier.models_ = {action: ParametricHMM.load(file) for action, file in files.items()}
        try:
            classifier._discriminants = tuple(
                Discriminant.from_arrays(record.arrays, number, len(actions))
                for number in range(len(record.arrays) // 4)
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

    def _check_trained(self) -> None:
        if not self.classes_:
            raise not_fitted("this classifier is not trained yet: call fit, or load a folder")


def _result(model: ParametricHMM, sequence: Floats, finished: bool) -> tuple[ParameterEstimate, float, float]:
    """Estimate of theta, score of a complete movement, and p-value.

    Scores of models with correlated residuals are logarithms of p-values: densities of movements that lie far from
    every model (another person's) would compare the widths of the models instead of the distances from them.
    """
    recorded = checked_sequence(sequence, model.covariances_.shape[-1])
    if has_p_values(model):
        examination = model._expecting_noise_of(recorded)._examined(recorded, finished)
        score = 0.0 if np.isnan(examination.log_p_value) else examination.log_p_value
        return examination.estimate, score, examination.p_value
    estimate = model._estimate(recorded, finished)
    # Neighbouring frames are redundant: the frames of a state count as one.
    frames = model.resampled_frames_ or len(sequence)
    return estimate, estimate.log_likelihood * model.n_states / frames, float("nan")


def _are_names(value: object) -> TypeGuard[tuple[str, ...]]:
    return isinstance(value, tuple) and all(isinstance(one, str) for one in value)


def _file_name(action: str, raising: type[InputError] = InputError) -> str:
    return f"{checked_name(action, 'action', raising)}.model.npz"
