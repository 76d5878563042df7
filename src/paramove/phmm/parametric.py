"""What all parametric HMMs have in common: trained on labelled movements, they estimate theta and synthesise movements.

They also learn how whole executions vary: that gives theta an honest region, and movements an outlier score and a
p-value.
"""

from __future__ import annotations

import importlib
import inspect
import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import astuple
from math import ceil
from numbers import Integral
from pathlib import Path
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.hmm import (
    LeftRightHMM,
    SequenceLengthError,
    Timing,
    TrainingOptions,
    TrainingSummary,
    at_progress,
    check_demonstrations,
    check_length,
    checked_sequence,
    checked_sequences,
    minimum_jerk,
    not_fitted,
    resample,
)
from paramove.hmm import Path as PathKind
from paramove.phmm.adaptation import Adaptation
from paramove.phmm.conditioning import passing
from paramove.phmm.description import MovementDescription
from paramove.phmm.estimates import Examination, ParameterEstimate
from paramove.phmm.features import Monomials
from paramove.phmm.noise import AddedNoise, NoiseLevel
from paramove.phmm.performance import Performances, groups_of, movement_parts, state_averages
from paramove.phmm.plausibility import (
    ExtrapolationWarning,
    TrainingRange,
    UnlikelyMovementWarning,
    far_outside,
)
from paramove.phmm.ridge import smoothed
from paramove.phmm.storage import ModelFileError, ModelRecord, read_numbers, read_record, write_record

MAX_FRAMES = 100_000
DEFAULT_FRAMES, STATE_MARGIN = 100, 0.2
Residuals = Literal["independent", "correlated"]
INDEPENDENT = "this model has independent residuals: train it with residuals='correlated'"


class ParametricHMM(ABC):
    """A family of left-right HMMs lambda^theta (thesis chapter 3); theta in the user's unit, shape (P,).

    Theta is estimated by generalised least squares of whole executions, complete or just begun.

    Args:
        n_states, d_min, d_max: as in `LeftRightHMM`. Without d_min and d_max states last as long as the frames allow,
            up to a fifth shorter or longer; with one of them alone, from one frame, or up to twice d_min.
        options: training options.
        resampled_frames: every sequence is first resampled to this many frames (thesis 4.1.2.1). Without it, to 100, or
            with d_min and d_max to none: they then count recorded frames.
        description: labels that are saved with the model.

    Attributes:
        residuals: "correlated", or "independent" if the model does not learn how whole executions vary.
        search_margin: how far outside the training's bounds `estimate` searches, as a fraction of their width.
        d_min_, d_max_, resampled_frames_: those in use.
        monomials_: features of theta.
        covariances_: of the states, shape (..., N, D, D).
        performances_: distribution of whole executions; None with independent residuals.
        parameter_bounds_: minimum and maximum theta of the training, shape (2, P).
        training_theta_: the different theta of the training, shape (K, P); None in files without them.
        log_frames_: coefficients of the logarithm of a movement's number of frames, linear in theta, (P + 1,); None in
            files without them.
        flat_theta_: whether theta of the training was (K,), which `predict` then returns.
        training_noise_: noise of the training; None in files without it, which then ignore noise.
        training_range_: unit, durations and speeds of the training; None in files without them.
        training_: summary of the training.
    """

    monomials_: Monomials
    covariances_: Floats
    performances_: Performances | None = None
    residuals: Residuals = "correlated"
    search_margin: float

    def __init__(
        self,
        n_states: int = 20,
        d_min: int | None = None,
        d_max: int | None = None,
        *,
        options: TrainingOptions | None = None,
        resampled_frames: int | None = None,
        description: MovementDescription | None = None,
    ) -> None:
        self.n_states = n_states
        self.d_min = d_min
        self.d_max = d_max
        self.options = options
        self.resampled_frames = resampled_frames
        self.description = description
        self.parameter_bounds_: Floats | None = None
        self.training_theta_: Floats | None = None
        self.training_noise_: NoiseLevel | None = None
        self.training_range_: TrainingRange | None = None
        self.flat_theta_ = False
        self.log_frames_: Floats | None = None
        self.training_: TrainingSummary | None = None

    @property
    def resampled_frames_(self) -> int | None:
        """Number of frames that every sequence is resampled to; None if sequences keep their own time."""
        following = self.d_min is None and self.d_max is None
        return DEFAULT_FRAMES if following and self.resampled_frames is None else self.resampled_frames

    @property
    def d_min_(self) -> int:
        """Minimum frames of a state."""
        if self.d_min is None:
            return 1 if self.d_max is not None else max(1, int((1.0 - STATE_MARGIN) * self._frames_per_state))
        return self.d_min

    @property
    def d_max_(self) -> int:
        """Maximum frames of a state."""
        if self.d_max is None:
            return 2 * self.d_min if self.d_min is not None else ceil((1.0 + STATE_MARGIN) * self._frames_per_state)
        return self.d_max

    @property
    def _frames_per_state(self) -> float:
        return (self.resampled_frames or DEFAULT_FRAMES) / max(1, self.n_states)

    @abstractmethod
    def at(self, theta: ArrayLike) -> LeftRightHMM:
        """The HMM for one parameter."""

    @abstractmethod
    def state_means(self, theta: ArrayLike) -> Floats:
        """Means of all states for one theta (P,) or many (M, P). Shape (N, D) or (M, N, D)."""

    @abstractmethod
    def _log_likelihood_at(self, resampled: Floats, theta: Floats) -> float:
        """ln p(X | lambda^theta) of a sequence as the HMM takes it."""

    @abstractmethod
    def _move_means(self, change: Floats) -> None:
        """Add coefficients of the monomials (N, D, F) to the means; changes a copy of a trained model."""

    @abstractmethod
    def _fit(self, sequences: list[Floats], theta: Floats, groups: Ints) -> None:
        """Train on checked sequences, resampled to `resampled_frames_`, theta (K, P), and the group of each (K,)."""

    @abstractmethod
    def _arrays(self) -> dict[str, Floats]:
        """Everything learned, for a file."""

    @abstractmethod
    def _set_arrays(self, arrays: dict[str, Floats]) -> None:
        """Take over what was learned from a file. Raises ValueError for shapes that do not fit."""

    def fit(self, sequences: Sequence[ArrayLike], theta: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Train on sequences (T_k, D) labelled with theta (K, P).

        `groups` (K,) defines which sequences belong together (such as those of one person): cross-validation leaves out
        whole groups. Without them sequences with the same theta belong together.

        Raises SequenceLengthError for impossible lengths, ValueError for labels or values that do not fit.
        """
        self._check_parameters()
        recorded = checked_sequences(sequences)
        checked = [self._resampled(sequence) for sequence in recorded]
        labels = checked_theta(theta, len(checked))
        self._check_training(recorded, checked, labels)
        numbers = groups_of(groups, labels)
        self._fit(checked, labels, numbers)
        self.performances_ = None
        if self.residuals == "correlated":
            self.performances_ = Performances.fitted(recorded, labels, self._features_of_executions(), numbers)
        self.parameter_bounds_ = np.stack([labels.min(axis=0), labels.max(axis=0)])
        self.training_theta_ = np.unique(labels, axis=0)
        self.training_noise_ = NoiseLevel.of(recorded)
        self.training_range_ = TrainingRange.of(recorded)
        self.flat_theta_ = np.ndim(theta) == 1
        linear, log_frames = Monomials.of_degree(1, labels), np.log([[len(sequence)] for sequence in recorded])
        self.log_frames_ = smoothed(linear.at(labels), linear.degrees, log_frames, numbers)[0]
        return self

    def log_likelihood(self, sequence: ArrayLike, theta: ArrayLike) -> float:
        """ln p(X | lambda^theta)."""
        return self.at(theta).log_likelihood(self._resampled(checked_sequence(sequence)))

    def estimate(self, sequence: ArrayLike, *, finished: bool = True) -> ParameterEstimate:
        """The most likely theta, its covariance, and the log-likelihood there, of a movement or of its beginning.

        Theta follows from `movement_parts` by generalised least squares; with independent residuals it is the maximum
        of the likelihood of frames (thesis 4.1.2.3). A beginning (`finished=False`) has the frame rate of the training;
        its log-likelihood is that of its points.

        Raises ValueError for another unit than that of the training. Warns (`UnlikelyMovementWarning`) of sequences
        that seem to have another frame rate, or to be no complete movement.
        """
        return self._estimate(self._recorded(sequence, finished), finished)

    def examine(self, sequence: ArrayLike, *, finished: bool = True) -> Examination:
        """Estimate of theta, outlier score and p-value of the sequence.

        Raises ValueError for a model with independent residuals, which has no distribution of executions, and for a
        beginning of fewer frames than are modelled.
        """
        recorded = self._recorded(sequence, finished)
        return self._expecting_noise_of(recorded)._examined(recorded, finished)

    def remarks(self, sequence: ArrayLike, *, finished: bool = True) -> tuple[str, ...]:
        """What makes a sequence hardly a movement, or the beginning of one, at the frame rate of the training."""
        if self.training_range_ is None:
            return ()
        return self.training_range_.remarks(checked_sequence(sequence), finished)

    def adapt(self, sequences: Sequence[ArrayLike], theta: ArrayLike | None = None) -> Self:
        """This model of other persons, adapted to a person of whom there are a few movements: about three suffice.

        Args:
            sequences: movements of the person, (T_k, D) each.
            theta: their labels, (K, P). Without them only what is synthesised adapts, since a habit of the person and
                an effect of theta cannot be distinguished: estimates and regions stay those of an unknown person.

        Raises NotFittedError before training, ValueError for sequences and labels that do not fit.
        """
        self._check_trained()
        recorded = [self._recorded(one, finished=True) for one in checked_sequences(sequences)]
        known = np.array([self._estimate(one, finished=True).theta for one in recorded]) if theta is None else theta
        labels = self._checked_theta(checked_theta(known, len(recorded)))
        averages = []
        for sequence, one in zip(recorded, labels, strict=True):
            frames = self._resampled_for_states(sequence)
            averages.append(state_averages(self.at(one).responsibilities(frames).T, frames))
        adaptation = Adaptation.of(self.monomials_, labels)
        missed = np.stack(averages) - self.state_means(labels)
        change = adaptation.change(missed.reshape(len(labels), -1))
        model = copy(self)
        model._move_means(change.reshape(*missed.shape[1:], -1))
        if self.log_frames_ is not None:
            linear = Monomials.of_degree(1, np.asarray(self.parameter_bounds_)).at(labels)
            late = np.log([[len(sequence)] for sequence in recorded]) - (linear @ self.log_frames_)[:, None]
            model.log_frames_ = self.log_frames_ + adaptation.change(late)[0, : linear.shape[1]]
        if theta is not None and self.performances_ is not None:
            whole = Adaptation.of(self.performances_.complete.monomials, labels)
            model.performances_ = self.performances_.adapted(recorded, labels, whole)
        return model

    def predict(self, sequences: Sequence[ArrayLike], return_cov: bool = False) -> Floats | tuple[Floats, Floats]:
        """Theta of many movements, (K, P), or (K,) if labels were; with `return_cov` also covariances (K, P, P)."""
        self._check_trained()
        found = [self.estimate(sequence) for sequence in sequences]
        theta = np.array([one.theta for one in found]).reshape(len(found), -1)
        theta = theta[:, 0] if self.flat_theta_ else theta
        return (theta, np.array([one.covariance for one in found])) if return_cov else theta

    def score(self, sequences: Sequence[ArrayLike], theta: ArrayLike) -> float:
        """R² of the predicted theta, the mean over its components, as scikit-learn's regressors have it.

        That of a component with one value for all sequences is 0, or 1 for an exact prediction.
        """
        labels = np.asarray(theta, dtype=np.float64)
        labels = labels.reshape(len(labels), -1)
        left = ((np.reshape(self.predict(sequences), labels.shape) - labels) ** 2).sum(axis=0)
        whole = ((labels - labels.mean(axis=0)) ** 2).sum(axis=0)
        varies = whole > 1e-24 * (labels**2).sum(axis=0)
        return float(np.where(varies, 1.0 - left / np.where(varies, whole, 1.0), left <= 0.0).mean())

    def synthesize(
        self, theta: ArrayLike, n_samples: int | None = None, *, duration: float | None = None,
        sample_rate: float = 60.0, timing: Timing = "uniform", path: PathKind = "smooth"
    ) -> Floats:  # fmt: skip
        """The prototype movement for theta (thesis 4.1.2.2), by number of samples or by duration in s. Shape (n, D).

        path "linear" interpolates the means as the thesis does; "smooth" does not cut corners, see
        `paramove.hmm.synthesis.prototype`. Warns (`ExtrapolationWarning`) of theta far outside the training.
        """
        if duration is not None:
            if n_samples is not None:
                raise ValueError("give n_samples or duration, not both")
            n_samples = max(2, round(duration * sample_rate) + 1)
        model = self.at(theta)
        self._warn_of_extrapolation(theta)
        return model.synthesize(n_samples, timing, path)

    def _warn_of_extrapolation(self, theta: ArrayLike) -> None:
        if self.parameter_bounds_ is None:
            return
        values = np.ravel(np.asarray(theta, dtype=np.float64))
        for index in far_outside(values, self.parameter_bounds_):
            low, high = self.parameter_bounds_[:, index]
            warnings.warn(
                f"component {index + 1} of theta is {values[index]:.4g}, in the training {low:.4g} to {high:.4g}: the "
                "movement is extrapolated far beyond what was demonstrated",
                ExtrapolationWarning,
                stacklevel=3,
            )

    def synthesize_through(self, theta: ArrayLike, via: Mapping[float, ArrayLike], n_samples: int) -> Floats:
        """The most likely movement for theta (P,) that passes given poses. Shape (n_samples, D).

        It deviates from `synthesize` as whole executions do: along the model's covariance, smooth to the acceleration.

        Args:
            theta: (P,).
            via: poses (D,) by the fraction of the movement at which they are passed, 0 to 1; NaN leaves a coordinate
                free. More than about five are met approximately. Without one at the start it starts as usual.
            n_samples: of the movement.

        Raises ValueError for poses and fractions that do not fit, and for independent residuals, which know no
        executions.
        """
        mean = self.synthesize(theta, n_samples)
        if self.performances_ is None:
            raise ValueError(INDEPENDENT)
        return passing(mean, via, self.performances_.complete)

    def redirect(self, movement: ArrayLike, theta: ArrayLike, at: float, within: float = 0.3) -> Floats:
        """A movement (n, D) that from a fraction `at` of it on turns to another theta (P,). Shape (n, D).

        Within a further fraction, at most what is left, it becomes the movement of the new theta, by a minimum-jerk
        transition: continuous to the acceleration, and never outside both.

        Raises ValueError for fractions that do not fit.
        """
        made = checked_sequence(movement, self._dimension())
        if not 0.0 <= at < 1.0 or not within > 0.0:
            raise ValueError(f"expected 0 <= at < 1 and within > 0, found {at} and {within}")
        turned = minimum_jerk(np.linspace(0.0, 1.0, len(made)), at, min(at + within, 1.0))[:, None]
        result: Floats = made + turned * (self.synthesize(theta, len(made)) - made)
        return result

    def natural_frames(self, theta: ArrayLike) -> Any:
        """How many frames a movement of theta takes, at the frame rate of the training.

        A whole number for one theta (P,), an array (M,) for many (M, P). Of the nearest theta within the bounds of the
        training. Raises NotFittedError before training and for a model that was made of given HMMs.
        """
        if self.parameter_bounds_ is None or self.log_frames_ is None:
            raise not_fitted("this model has seen no movements, so it knows no durations: call fit")
        inside = np.clip(np.asarray(theta, dtype=np.float64), *self.parameter_bounds_)
        logarithms = Monomials.of_degree(1, self.parameter_bounds_).at(inside) @ self.log_frames_
        frames = np.maximum(2, np.round(np.exp(logarithms))).astype(np.int64)
        return frames if frames.ndim else int(frames)

    def progress_mean(self, theta: ArrayLike, tau: float | Floats) -> Floats:
        """Mean pose for theta (P,) at progress tau in [0, 1] (6.2). Shape tau.shape + (D,)."""
        return at_progress(self.state_means(theta), tau)

    def progress_covariance(self, theta: ArrayLike, tau: float | Floats) -> Floats:
        """Covariance of the pose for theta (P,) at progress tau in [0, 1] (6.3). Shape tau.shape + (D, D)."""
        return at_progress(self.at(theta).covariances_, tau)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Constructor arguments, as scikit-learn expects."""
        return {name: getattr(self, name) for name in self._parameter_names()}

    def set_params(self, **parameters: Any) -> Self:
        """Change constructor arguments. Raises ValueError for an unknown name."""
        known = self._parameter_names()
        for name, value in parameters.items():
            if name not in known:
                raise ValueError(f"{type(self).__name__} has the parameters {known}, found {name!r}")
            setattr(self, name, value)
        return self

    def __sklearn_tags__(self) -> Any:
        """Tags for scikit-learn's model selection, where it is installed: a regressor of sequences."""
        from sklearn.utils import InputTags, RegressorTags, Tags, TargetTags

        targets = TargetTags(required=True, multi_output=True)
        inputs = InputTags(two_d_array=False, three_d_array=True)
        return Tags(estimator_type="regressor", target_tags=targets, regressor_tags=RegressorTags(), input_tags=inputs)

    def __sklearn_is_fitted__(self) -> bool:
        """For scikit-learn's `check_is_fitted`."""
        return self.parameter_bounds_ is not None

    def __repr__(self) -> str:
        """The constructor's arguments that differ from their defaults."""
        defaults = type(self)().get_params()
        changed = [f"{name}={value!r}" for name, value in self.get_params().items() if value != defaults[name]]
        return f"{type(self).__name__}({', '.join(changed)})"

    def save(self, path: str | Path) -> None:
        """Write the trained model to one .npz file. Raises NotFittedError before training."""
        self._check_trained()
        arrays = {"parameter_bounds": np.asarray(self.parameter_bounds_), **self._arrays()}
        if self.performances_ is not None:
            arrays |= self.performances_.arrays()
        optional = {
            "flat_theta": np.ones(1) if self.flat_theta_ else None,
            "log_frames": self.log_frames_,
            "training_theta": self.training_theta_,
            "training_noise": None if self.training_noise_ is None else np.array(astuple(self.training_noise_)),
            "training_range": None if self.training_range_ is None else np.array(astuple(self.training_range_)),
        }
        arrays |= {name: array for name, array in optional.items() if array is not None}
        write_record(Path(path), ModelRecord(type(self).__name__, self.get_params(), self.training_, arrays))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a model of this class, or of any class when called on ParametricHMM.

        Raises ModelFileError for a missing or damaged file, a wrong version, class, shape or value, with what was
        expected and found.
        """
        record = read_record(Path(path))
        if record.class_name not in _CLASSES:
            _load_all_classes()
        known = {name: kind for name, kind in _CLASSES.items() if issubclass(kind, cls)}
        if record.class_name not in known:
            raise ModelFileError(f"{path}: expected one of {sorted(known)}, found a {record.class_name}")
        try:
            model = known[record.class_name](**record.parameters)
            model._check_parameters()
            arrays = dict(record.arrays)
            model.parameter_bounds_ = arrays["parameter_bounds"]
            model.training_theta_ = arrays.get("training_theta")
            model.flat_theta_ = "flat_theta" in arrays
            model.log_frames_ = arrays.get("log_frames")
            if model.log_frames_ is not None and model.log_frames_.shape != (model.parameter_bounds_.shape[-1] + 1,):
                raise ValueError(f"expected one more log_frames than parameters, found {model.log_frames_.shape}")
            if noise := read_numbers(arrays, "training_noise", 2):
                model.training_noise_ = NoiseLevel(*noise)
            if seen := read_numbers(arrays, "training_range", 4):
                model.training_range_ = TrainingRange(*seen)
            model._set_arrays(arrays)
            if model.residuals == "correlated":
                model.performances_ = Performances.from_arrays(arrays, model._features_of_executions())
        except KeyError as error:
            names = ", ".join(sorted(record.arrays)) or "none"
            raise ModelFileError(f"{path}: expected an array {error}, found {names}") from error
        except (ArithmeticError, AttributeError, IndexError, TypeError, ValueError) as error:
            raise ModelFileError(f"{path}: {error}") from error
        model.training_ = record.training
        return model

    def _expecting_noise_of(self, recorded: Floats) -> Self:
        """This model, or if a recorded sequence has more noise than the training, one that expects this noise."""
        known = self.training_noise_
        noise = None if known is None else known.added(recorded, self.resampled_frames_)
        if noise is None:
            return self
        model = copy(self)
        model.training_noise_ = None
        model._expect(noise)
        return model

    def _expect(self, noise: AddedNoise) -> None:
        """Expect this noise in sequences; changes a copy of a trained model."""
        self.covariances_ = self.covariances_ + noise.of_states
        if self.performances_ is not None:
            self.performances_ = self.performances_.expecting(noise)

    def _estimate(self, recorded: Floats, finished: bool) -> ParameterEstimate:
        model = self._expecting_noise_of(recorded)
        if not finished:
            return model._examined(recorded, finished).estimate
        if model.performances_ is None:
            return model._most_likely(recorded)
        return model._estimated(recorded, model.performances_)[0]

    def _recorded(self, sequence: ArrayLike, finished: bool) -> Floats:
        recorded = checked_sequence(sequence, self._dimension())
        self._warn(recorded, finished)
        return recorded

    def _most_likely(self, recorded: Floats) -> ParameterEstimate:
        """Of a complete movement of independent frames, with noise as in the training."""
        raise NotImplementedError(f"a {type(self).__name__} has correlated residuals")

    def _examined(self, recorded: Floats, finished: bool) -> Examination:
        if self.performances_ is None:
            raise ValueError(INDEPENDENT)
        if not finished:
            return self.performances_.beginnings.examined(recorded, self.search_margin, self.performances_.noise)
        estimate, parts = self._estimated(recorded, self.performances_)
        complete = self.performances_.complete
        theta = complete.condensed.estimates(parts[None], self.search_margin)[0]
        distance = float(complete.condensed.distances_from(parts[None], theta)[0])
        outlier_score = self.performances_.outlier_score(distance, self.performances_.pace.distance(recorded))
        density = complete.log_density(distance)
        return Examination(estimate, outlier_score, density, self.performances_.log_p_value(outlier_score))

    def _estimated(self, recorded: Floats, performances: Performances) -> tuple[ParameterEstimate, Floats]:
        """Estimate from the distribution of whole executions, and the description of this one."""
        resampled = self._resampled_for_states(recorded)
        parts = movement_parts(recorded)
        (theta,), (covariance,), _ = performances.estimating.condensed.estimates(parts[None], self.search_margin)
        return ParameterEstimate(theta, covariance, self._log_likelihood_at(resampled, theta)), parts

    def _dimension(self) -> int:
        self._check_trained()
        return int(self.covariances_.shape[-1])

    def _features_of_executions(self) -> Monomials:
        """Features of theta on which whole executions depend."""
        return self.monomials_

    def _warn(self, recorded: Floats, finished: bool) -> None:
        """Of what is unusual about a sequence. Raises ValueError for another unit."""
        if self.training_range_ is not None:
            self.training_range_.check_unit(recorded)
            for remark in self.training_range_.remarks(recorded, finished):
                warnings.warn(remark, UnlikelyMovementWarning, stacklevel=4)

    def _check_trained(self) -> None:
        if self.parameter_bounds_ is None:
            raise not_fitted("this model is not trained yet: call fit, or load a file")

    def _check_parameters(self) -> None:
        if self.residuals not in get_args(Residuals):
            raise ValueError(f"residuals are {' or '.join(get_args(Residuals))}, found {self.residuals!r}")
        counts = {name: getattr(self, name) for name in ("n_states", "d_min_", "d_max_")}
        if not all(_whole(count) for count in counts.values()) or not 1 <= self.d_min_ <= self.d_max_:
            raise ValueError(f"expected whole numbers with 1 <= d_min <= d_max, found {counts}")
        frames = self.resampled_frames
        if frames is not None and (not _whole(frames) or not 2 <= frames <= MAX_FRAMES):
            raise ValueError(f"expected resampled_frames from 2 to {MAX_FRAMES}, found {frames!r:.40}")
        if self.n_states < 1 or not isinstance(self.description, MovementDescription | None):
            raise ValueError(f"expected at least one state, found {self.n_states}")

    def _check_training(self, recorded: Sequence[Floats], resampled: Sequence[Floats], theta: Floats) -> None:
        """Check movements as they were recorded and as they are trained on, (T_k, D) each, and theta (K, P).

        Raises:
            SequenceLengthError: for a length that the states do not allow, with the number of the sequence.
            ValueError: for sequences that no model can learn from, and for one theta alone.
        """
        check_demonstrations(recorded, self._training_options().floor_deviation)
        for index, sequence in enumerate(resampled):
            try:
                check_length(len(sequence), self.n_states, self.d_min_, self.d_max_)
            except SequenceLengthError as error:
                raise SequenceLengthError(f"sequence {index}: {error}") from error
        if (theta == theta[0]).all():
            raise ValueError(
                f"theta is {theta[0].tolist()} for every sequence: nothing shows how the movement depends on it; give "
                "sequences with different theta, or train a LeftRightHMM, which has no parameters"
            )

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        _CLASSES[cls.__name__] = cls

    @classmethod
    def _parameter_names(cls) -> list[str]:
        return [name for name in inspect.signature(cls.__init__).parameters if name != "self"]

    def _training_options(self) -> TrainingOptions:
        return self.options if self.options is not None else TrainingOptions()

    def _resampled_for_states(self, recorded: Floats) -> Floats:
        """As the HMM takes it. Raises SequenceLengthError for a length that the states do not allow."""
        resampled = self._resampled(recorded)
        check_length(len(resampled), self.n_states, self.d_min_, self.d_max_)
        return resampled

    def _checked_theta(self, theta: ArrayLike) -> Floats:
        self._check_trained()
        values = np.asarray(theta, dtype=np.float64)
        n_components = len(self.monomials_.centre)
        if values.shape[-1:] != (n_components,) or values.ndim > 2 or not np.isfinite(values).all():
            raise ValueError(f"theta has {n_components} finite components, found shape {values.shape}: {values}")
        return values

    def _resampled(self, sequence: Floats) -> Floats:
        frames = self.resampled_frames_
        return sequence if frames is None else resample(sequence, frames)


_CLASSES: dict[str, type[ParametricHMM]] = {}  # classes that a file may name; filled as they are defined


def _load_all_classes() -> None:
    """The package loads a class when it is first used; a file may name one that has not been used yet."""
    package = importlib.import_module(__package__ or "")  # no import statement: cached results depend on no other class
    for name in dir(package):
        getattr(package, name)


def _whole(number: Any) -> bool:
    return isinstance(number, Integral) and not isinstance(number, bool)


def checked_theta(theta: ArrayLike, count: int) -> Floats:
    """Labels of `count` sequences, (K, P) or (K,), as (K, P). Raises ValueError with the first that is not finite."""
    labels = np.asarray(theta, dtype=np.float64)
    labels = labels[:, None] if labels.ndim == 1 else labels
    if labels.ndim != 2 or len(labels) != count or not labels.size:
        raise ValueError(f"theta has one row per sequence: expected shape ({count}, P), found {labels.shape}")
    wrong = np.flatnonzero(~np.isfinite(labels).all(axis=1))
    if len(wrong):
        first = int(wrong[0])
        raise ValueError(f"theta is finite, found {labels[first].tolist()} for sequence {first}, {len(wrong)} in all")
    return labels


def has_p_values(model: ParametricHMM) -> bool:
    """Whether a model describes how demonstrations vary, and so which movements are outliers."""
    return model.performances_ is not None


def inverse_information(information: Floats, widest: float) -> Floats:
    """Covariance, no standard deviation above `widest`. Shape (P, P)."""
    values, vectors = np.linalg.eigh(information)
    values = np.maximum(values, 1.0 / widest**2)
    return np.asarray((vectors / values) @ vectors.T)
