"""Models that know how whole executions vary: theta with an honest region, outlier score and p-value."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from copy import copy
from typing import Literal, Self, TypeGuard, get_args

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.hmm import check_length, checked_sequence, checked_sequences, interpolate, minimum_jerk
from paramove.phmm.adaptation import Adaptation
from paramove.phmm.conditioning import deviation
from paramove.phmm.estimates import Examination, ParameterEstimate
from paramove.phmm.features import Monomials
from paramove.phmm.noise import AddedNoise
from paramove.phmm.parametric import ParametricHMM, TrainingData, checked_theta
from paramove.phmm.performance import OUTLIER_SHRINKAGE, Performances, movement_parts, state_averages

Residuals = Literal["independent", "correlated"]
INDEPENDENT = "this model has independent residuals: train it with residuals='correlated'"
FOLLOWED = 0.9
"""Fraction of the correlations of executions that conditions follow."""
START = 0.05
"""Conditions up to this fraction of a movement are conditions on its start."""


def has_p_values(model: ParametricHMM) -> TypeGuard[ExaminingPHMM]:
    """Whether a model describes how demonstrations vary, and so which movements are outliers."""
    return isinstance(model, ExaminingPHMM) and model.performances_ is not None


class ExaminingPHMM(ParametricHMM):
    """Estimates theta by generalised least squares of whole executions, complete or just begun.

    Attributes:
        monomials_: features of theta.
        covariances_: shape (N, D, D).
        performances_: distribution of whole executions; None with independent residuals.
        search_margin: how far outside the training's bounds `estimate` searches, as a fraction of their width.
    """

    monomials_: Monomials
    covariances_: Floats
    performances_: Performances | None = None
    residuals: Residuals = "correlated"
    search_margin: float

    @abstractmethod
    def _log_likelihood_at(self, checked: Floats, theta: Floats) -> float:
        """ln p(X | lambda^theta) of a sequence as the HMM takes it."""

    def estimate(self, sequence: ArrayLike, *, finished: bool = True) -> ParameterEstimate:
        """The most likely theta, its covariance, and the log-likelihood there, of a movement or of its beginning.

        Theta follows from `movement_parts` by generalised least squares; with independent residuals it is the maximum
        of the likelihood of frames. A beginning (`finished=False`) has the frame rate of the training; its
        log-likelihood is that of its points.
        """
        return self._estimate(self._recorded(sequence, finished), finished)

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

    def examine(self, sequence: ArrayLike, *, finished: bool = True) -> Examination:
        """Estimate of theta, outlier score and p-value of the sequence.

        Raises ValueError for a model with independent residuals, which has no distribution of executions, and for a
        beginning of fewer frames than are modelled.
        """
        recorded = self._recorded(sequence, finished)
        return self._expecting_noise_of(recorded)._examined(recorded, finished)

    def _examined(self, recorded: Floats, finished: bool) -> Examination:
        if self.performances_ is None:
            raise ValueError(INDEPENDENT)
        if not finished:
            return self.performances_.beginnings.examined(recorded, self.search_margin, self.performances_.noise)
        estimate, parts = self._estimated(recorded, self.performances_)
        complete = self.performances_.complete
        distance = float(
            complete.distances_from(parts[None], complete.estimates(parts[None], self.search_margin)[0])[0]
        )
        outlier_score = self.performances_.outlier_score(distance, self.performances_.pace.distance(recorded))
        density = complete.log_density(distance)
        return Examination(estimate, outlier_score, density, self.performances_.log_p_value(outlier_score))

    def _estimated(self, recorded: Floats, performances: Performances) -> tuple[ParameterEstimate, Floats]:
        """Estimate from the distribution of whole executions, and the description of this one."""
        checked = self._checked(recorded)
        parts = movement_parts(recorded)
        (theta,), (covariance,) = performances.estimating.estimates(parts[None], self.search_margin)
        return ParameterEstimate(theta, covariance, self._log_likelihood_at(checked, theta)), parts

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
        mean, covariance = self.synthesize(theta, n_samples), self._covariance_of_executions()
        missed: dict[float, Floats] = {}
        for progress, pose in via.items():
            wanted = np.asarray(pose, dtype=np.float64)
            if wanted.shape != mean.shape[1:] or np.isinf(wanted).any() or not 0.0 <= progress <= 1.0:
                raise ValueError(
                    f"via has poses of {mean.shape[1]} numbers by fractions from 0 to 1, found shape {wanted.shape} at "
                    f"{progress}"
                )
            missed[progress] = wanted - interpolate(mean, np.array([progress * (n_samples - 1)]))[0]
        if not missed:
            return mean
        if min(missed) > START:
            missed[0.0] = np.zeros(mean.shape[1])
        result: Floats = mean + deviation(missed, covariance, n_samples)
        return result

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

    def _dimension(self) -> int:
        self._check_trained()
        return int(self.covariances_.shape[-1])

    def _covariance_of_executions(self) -> Floats:
        self._check_trained()
        if self.performances_ is None:
            raise ValueError(INDEPENDENT)
        regression = self.performances_.complete
        covariance = regression.root @ regression.root.T
        diagonal = np.diag(np.diagonal(covariance))
        # Detection of outliers takes half of the correlations for chance; synthesis follows nearly all of them.
        result: Floats = diagonal + FOLLOWED / (1.0 - OUTLIER_SHRINKAGE) * (covariance - diagonal)
        return result

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
            frames = self._checked(sequence)
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

    @abstractmethod
    def _move_means(self, change: Floats) -> None:
        """Add coefficients of the monomials (N, D, F) to the means; changes a copy of a trained model."""

    def _fitted_performances(self, data: TrainingData, features: Monomials | None = None) -> Performances | None:
        """Distribution of whole executions with these features of theta; None with independent residuals."""
        if self.residuals not in get_args(Residuals):
            raise ValueError(f"residuals are {' or '.join(get_args(Residuals))}, found {self.residuals!r}")
        if self.residuals == "independent":
            return None
        return Performances.fitted(data.recorded, data.theta, features or self.monomials_, data.groups)

    def _performance_arrays(self) -> dict[str, Floats]:
        return {} if self.performances_ is None else self.performances_.arrays()

    def _set_performances(self, arrays: dict[str, Floats], features: Monomials | None = None) -> None:
        correlated = self.residuals == "correlated"
        self.performances_ = Performances.from_arrays(arrays, features or self.monomials_) if correlated else None

    def _expect(self, noise: AddedNoise) -> None:
        self.covariances_ = self.covariances_ + noise.of_states
        if self.performances_ is not None:
            self.performances_ = self.performances_.expecting(noise)

    def _checked(self, sequence: ArrayLike) -> Floats:
        checked = self._resampled(checked_sequence(sequence, self._dimension()))
        check_length(len(checked), self.n_states, self.d_min_, self.d_max_)
        return checked

    def _checked_theta(self, theta: ArrayLike) -> Floats:
        self._check_trained()
        values = np.asarray(theta, dtype=np.float64)
        n_components = len(self.monomials_.centre)
        if values.shape[-1:] != (n_components,) or values.ndim > 2 or not np.isfinite(values).all():
            raise ValueError(f"theta has {n_components} finite components, found shape {values.shape}: {values}")
        return values


def inverse_information(information: Floats, widest: float) -> Floats:
    """Covariance, no standard deviation above `widest`. Shape (P, P)."""
    values, vectors = np.linalg.eigh(information)
    values = np.maximum(values, 1.0 / widest**2)
    return np.asarray((vectors / values) @ vectors.T)
