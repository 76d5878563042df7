"""Parametric HMMs whose state means are polynomials of theta: linear, quadratic, cubic (thesis 3.3.1, 4.2.3)."""

from __future__ import annotations

import inspect
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.hmm import (
    Evaluator,
    LeftRightHMM,
    Parameters,
    TrainingOptions,
    equal_segments,
)
from paramove.phmm import search_kernels
from paramove.phmm.description import MovementDescription
from paramove.phmm.estimates import ParameterEstimate
from paramove.phmm.examining import ExaminingPHMM, Residuals, inverse_information
from paramove.phmm.features import Monomials
from paramove.phmm.noise import AddedNoise
from paramove.phmm.parametric import TrainingData
from paramove.phmm.performance import state_averages
from paramove.phmm.regression import RegressedParameters, train_regressed, with_coefficients
from paramove.phmm.ridge import smoothed
from paramove.phmm.storage import check_shapes, check_states
from paramove.phmm.stretching import stretched

MAX_STEPS = 40
STEP_TOLERANCE = 1e-5
"""Predicted gain in nats below which the search ends."""


class PolynomialPHMM(ExaminingPHMM):
    """Means mu_i = Z_i phi(theta) with all monomials of theta up to a degree; covariances do not depend on theta.

    Args:
        n_states, d_min, d_max, options, resampled_frames, description: as in `ParametricHMM`.
        degree: of the polynomials; 1 is the linear PHMM of Wilson and Bobick.
        smoothness: fraction of the movement over which the dependence on theta changes little: length of the prior that
            couples the slopes of neighbouring states, its strength chosen by the evidence. None: no prior, plain EM.
        residuals: "correlated" learns how whole executions vary: `estimate` then models dependent frames and weights
            what the last position of each body point shows, its covariance is realistic, beginnings and outliers are
            recognised, and the means are those that predict left-out groups best. "independent" is the thesis: maximum
            likelihood of frames.
        search_margin: how far outside the training's bounds `estimate` searches, as a fraction of their width.

    Attributes:
        monomials_: the Monomials.
        coefficients_: Z, shape (N, D, F), in the unit of the sequences.
        covariances_: shape (N, D, D).
        durations_: p_i(d) in column d - 1, shape (N, d_max).
        performances_: distribution of whole executions; None with independent residuals.
    """

    def __init__(
        self,
        n_states: int = 20,
        d_min: int | None = None,
        d_max: int | None = None,
        *,
        degree: int = 2,
        options: TrainingOptions | None = None,
        resampled_frames: int | None = None,
        description: MovementDescription | None = None,
        smoothness: float | None = 0.05,
        residuals: Residuals = "correlated",
        search_margin: float = 1.0,
    ) -> None:
        super().__init__(
            n_states, d_min, d_max, options=options, resampled_frames=resampled_frames, description=description
        )
        self.degree = degree
        self.smoothness = smoothness
        self.residuals = residuals
        self.search_margin = search_margin

    def _fit(self, data: TrainingData) -> None:
        options = self._training_options()
        monomials = Monomials.of_degree(self.degree, data.theta)
        if self.smoothness is None and monomials.n_distinct(data.theta) < len(monomials):
            raise ValueError(
                f"{len(np.unique(data.theta, axis=0))} different theta do not determine the {len(monomials)} "
                f"coefficients of degree {self.degree} in {data.theta.shape[1]} parameters: give more different theta, "
                "a lower degree, or a smoothness (a prior)"
            )
        begin = equal_segments(data.sequences, self.n_states, self.d_min_, self.d_max_, options)
        coefficients = np.zeros((*begin.means.shape, len(monomials)))
        coefficients[..., 0] = begin.means
        initial = RegressedParameters(coefficients, begin.covariances, begin.durations, self.d_min_)
        features = monomials.at(data.theta)
        trained, self.training_ = train_regressed(
            initial, data.sequences, features, monomials.degrees, options, self.smoothness
        )
        performances = self._fitted_performances(data, monomials)
        if performances is not None and self.smoothness is not None:
            averages = self._state_averages(data, trained, monomials)
            known = stretched(self.description, coefficients.shape, monomials)
            explained = np.einsum("ndf,kf->knd", known, features).reshape(averages.shape)
            smooth = smoothed(features, monomials.degrees, averages - explained, data.groups)
            coefficients = known + smooth.reshape(coefficients.shape)
            trained = with_coefficients(trained, coefficients, data.sequences, features, options)
        self._set_learned(monomials, trained)
        self.performances_ = performances

    def _state_averages(self, data: TrainingData, trained: RegressedParameters, monomials: Monomials) -> Floats:
        """Mean of the frames of each movement in each state. Shape (K, N D)."""
        common = Evaluator.of(trained.at(monomials.at(monomials.centre)))
        averages = []
        for sequence, theta in zip(data.sequences, data.theta, strict=True):
            own = replace(common, means=trained.coefficients @ monomials.at(theta))
            averages.append(state_averages(own.expectation(sequence)[1].T, sequence).ravel())
        return np.stack(averages)

    def _set_learned(self, monomials: Monomials, learned: RegressedParameters) -> None:
        self.monomials_ = monomials
        # Contiguous, as after reading a file: sums in another order differ in the last bits.
        self.coefficients_ = np.ascontiguousarray(learned.coefficients)
        self.covariances_ = np.ascontiguousarray(learned.covariances)
        self.durations_ = np.ascontiguousarray(learned.durations)
        self._white: tuple[Evaluator, Floats] | None = None

    def at(self, theta: ArrayLike) -> LeftRightHMM:
        """The HMM for theta (P,)."""
        parameters = Parameters(self.state_means(theta), self.covariances_, self.durations_, self.d_min_)
        return LeftRightHMM.from_parameters(parameters, self.options)

    def state_means(self, theta: ArrayLike) -> Floats:
        """Means of all states for one theta (P,) or many (M, P) (3.1). Shape (N, D) or (M, N, D)."""
        features = self.monomials_.at(self._checked_theta(theta))
        result: Floats = np.einsum("ndf,...f->...nd", self.coefficients_, features)
        return result

    def log_likelihood_and_gradient(self, sequence: ArrayLike, theta: ArrayLike) -> tuple[float, Floats]:
        """ln p(X | lambda^theta) and its derivative with respect to theta (P,), exact."""
        u = (self._checked_theta(theta) - self.monomials_.centre) / self.monomials_.scale
        value, gradient, _ = search_kernels.expectation_at(u, self._prepared(self._checked(sequence)))
        return float(value), gradient / self.monomials_.scale

    def _most_likely(self, recorded: Floats) -> ParameterEstimate:
        """The maximum of the likelihood, by EM (3.5), generalised where means are not linear."""
        prepared = self._prepared(self._checked(recorded))
        best, value, gradient = self._likeliest(prepared)
        information = search_kernels.information_at(best, gradient, prepared)
        scale = self.monomials_.scale
        covariance = inverse_information(information, self._widest) * np.outer(scale, scale)
        return ParameterEstimate(self.monomials_.centre + scale * best, covariance, value)

    def _log_likelihood_at(self, checked: Floats, theta: Floats) -> float:
        position = (theta - self.monomials_.centre) / self.monomials_.scale
        return float(search_kernels.log_likelihood_at(position, self._prepared(checked)))

    def _expect(self, noise: AddedNoise) -> None:
        super()._expect(noise)
        self._white = None

    def _move_means(self, change: Floats) -> None:
        self.coefficients_ = self.coefficients_ + change
        self._white = None

    @property
    def _widest(self) -> float:
        return 1.0 + 2.0 * self.search_margin

    def _likeliest(self, prepared: search_kernels.Movement) -> tuple[Floats, float, Floats]:
        """Scaled theta with the largest likelihood, its logarithm, and the gradient there."""
        bounds = np.full(len(self.monomials_.centre), self._widest)
        best, value, gradient = search_kernels.best_climbed(
            self.monomials_.starts, -bounds, bounds, MAX_STEPS, STEP_TOLERANCE, prepared
        )
        return best, float(value), gradient

    def _prepared(self, sequence: Floats) -> search_kernels.Movement:
        """Input of the kernels except theta."""
        evaluator, white = self._whitened()
        ends = evaluator.ends(len(sequence))
        frames, rows = search_kernels.whitened_frames(np.ascontiguousarray(sequence.T), evaluator.whitening, ends)
        return search_kernels.Movement(
            frames,
            rows,
            white,
            self.monomials_.exponents,
            evaluator.log_norm,
            evaluator.log_duration,
            self.d_min_,
            ends,
        )

    def _whitened(self) -> tuple[Evaluator, Floats]:
        """Everything that depends neither on a sequence nor on theta: an evaluator, and the whitened coefficients."""
        if self._white is None:
            evaluator = Evaluator.of(self.at(self.monomials_.centre).parameters)
            self._white = evaluator, np.ascontiguousarray(evaluator.whitening @ self.coefficients_)
        return self._white

    @classmethod
    def _parameter_names(cls) -> list[str]:
        return [name for name in inspect.signature(PolynomialPHMM.__init__).parameters if name != "self"]

    def _arrays(self) -> dict[str, Floats]:
        arrays = {
            "coefficients": self.coefficients_,
            "covariances": self.covariances_,
            "durations": self.durations_,
            "theta_centre": self.monomials_.centre,
            "theta_scale": self.monomials_.scale,
        }
        return arrays | self._performance_arrays()

    def _set_arrays(self, arrays: dict[str, Floats]) -> None:
        centre, scale = arrays["theta_centre"], arrays["theta_scale"]
        monomials = Monomials.of_degree(self.degree, np.stack([centre - scale, centre + scale]))
        monomials = Monomials(monomials.exponents, centre, scale)
        dim = arrays["coefficients"].shape[1]
        check_shapes(arrays, {"coefficients": (self.n_states, dim, len(monomials)), "theta_scale": centre.shape})
        check_states(arrays, arrays["coefficients"][..., 0], self.d_min_, self.d_max_)
        learned = (arrays["coefficients"], arrays["covariances"], arrays["durations"])
        self._set_learned(monomials, RegressedParameters(*learned, self.d_min_))
        self._set_performances(arrays)


class LinearPHMM(PolynomialPHMM):
    """The linear PHMM of Wilson and Bobick: mu_i = W_i theta + mean_i (thesis 3.3.1). Arguments as its base."""

    def __init__(self, *counts: int, degree: int = 1, **others: Any) -> None:
        super().__init__(*counts, degree=degree, **others)


class QuadraticPHMM(PolynomialPHMM):
    """Means quadratic in theta (thesis 4.2.3). Arguments as its base."""


class CubicPHMM(PolynomialPHMM):
    """Means cubic in theta (thesis 4.2.3). Arguments as its base."""

    def __init__(self, *counts: int, degree: int = 3, **others: Any) -> None:
        super().__init__(*counts, degree=degree, **others)
