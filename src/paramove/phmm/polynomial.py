"""Parametric HMMs whose state means are polynomials of theta: linear, quadratic, cubic (thesis 3.3.1, 4.2.3).

And what they have in common with others whose covariances do not depend on theta.
"""

from __future__ import annotations

import inspect
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.hmm import (
    Evaluator,
    LeftRightHMM,
    Parameters,
    TrainingOptions,
    TrainingSummary,
    equal_segments,
)
from paramove.phmm import search_kernels
from paramove.phmm.description import MovementDescription
from paramove.phmm.estimates import ParameterEstimate
from paramove.phmm.features import Monomials
from paramove.phmm.noise import AddedNoise
from paramove.phmm.parametric import ParametricHMM, Residuals, inverse_information
from paramove.phmm.performance import state_averages
from paramove.phmm.regression import RegressedParameters, train_regressed, with_coefficients
from paramove.phmm.ridge import smoothed
from paramove.phmm.storage import check_shapes, check_states
from paramove.phmm.stretching import stretched

MAX_STEPS = 40
STEP_TOLERANCE = 1e-5
"""Predicted gain in nats below which the search ends."""


class ConstantCovariancePHMM(ParametricHMM):
    """Only the state means depend on theta, by monomials among others; covariances and durations do not.

    Attributes:
        monomials_: the Monomials.
        covariances_: shape (N, D, D).
        durations_: p_i(d) in column d - 1, shape (N, d_max).
    """

    durations_: Floats
    _evaluator: Evaluator | None = None  # of everything but the means
    _white: Floats | None = None  # whitened coefficients, if they are those of all theta

    def at(self, theta: ArrayLike) -> LeftRightHMM:
        """The HMM for theta (P,)."""
        parameters = Parameters(self.state_means(theta), self.covariances_, self.durations_, self.d_min_)
        return LeftRightHMM.from_parameters(parameters, self.options)

    def _regressed(
        self, sequences: list[Floats], features: Floats, degrees: Ints, smoothness: float | None
    ) -> tuple[RegressedParameters, TrainingSummary]:
        """Trained with means linear in features (K, F), monomials of these degrees, from equal segments."""
        options = self._training_options()
        begin = equal_segments(sequences, self.n_states, self.d_min_, self.d_max_, options)
        coefficients = np.zeros((*begin.means.shape, len(degrees)))
        coefficients[..., 0] = begin.means
        initial = RegressedParameters(coefficients, begin.covariances, begin.durations, self.d_min_)
        return train_regressed(initial, sequences, features, degrees, options, smoothness)

    def _set_states(self, monomials: Monomials, covariances: Floats, durations: Floats) -> None:
        self.monomials_ = monomials
        # Contiguous, as after reading a file: sums in another order differ in the last bits.
        self.covariances_, self.durations_ = np.ascontiguousarray(covariances), np.ascontiguousarray(durations)
        self._evaluator = self._white = None

    def _expect(self, noise: AddedNoise) -> None:
        super()._expect(noise)
        self._evaluator = self._white = None

    def _scaled(self, theta: Floats) -> Floats:
        result: Floats = (theta - self.monomials_.centre) / self.monomials_.scale
        return result

    def _whitened(self, coefficients: Floats) -> Floats:
        return np.ascontiguousarray(self._common().whitening @ coefficients)

    def _common(self) -> Evaluator:
        if self._evaluator is None:
            self._evaluator = Evaluator.of(self.at(self.monomials_.centre).parameters)
        return self._evaluator

    def _movement(self, sequence: Floats, white: Floats, exponents: Ints) -> search_kernels.Movement:
        """Input of the kernels except theta, for means with whitened coefficients (N, D, F) of monomials (F, P)."""
        evaluator = self._common()
        ends = evaluator.ends(len(sequence))
        frames, rows = search_kernels.whitened_frames(np.ascontiguousarray(sequence.T), evaluator.whitening, ends)
        return search_kernels.Movement(
            frames, rows, white, exponents, evaluator.log_norm, evaluator.log_duration, self.d_min_, ends
        )

    def _arrays(self) -> dict[str, Floats]:
        return {
            "covariances": self.covariances_,
            "durations": self.durations_,
            "theta_centre": self.monomials_.centre,
            "theta_scale": self.monomials_.scale,
        }

    @staticmethod
    def _read_monomials(arrays: dict[str, Floats], degree: int) -> Monomials:
        centre, scale = arrays["theta_centre"], arrays["theta_scale"]
        if centre.ndim != 1 or scale.shape != centre.shape or not (scale > 0).all():
            raise ValueError(f"expected theta_scale above 0 as long as theta_centre, found {scale.shape}: {scale}")
        spanned = Monomials.of_degree(degree, np.stack([centre - scale, centre + scale]))
        return replace(spanned, centre=centre, scale=scale)


class PolynomialPHMM(ConstantCovariancePHMM):
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

    def _fit(self, sequences: list[Floats], theta: Floats, groups: Ints) -> None:
        monomials = Monomials.of_degree(self.degree, theta)
        if self.smoothness is None and monomials.n_distinct(theta) < len(monomials):
            raise ValueError(
                f"{len(np.unique(theta, axis=0))} different theta do not determine the {len(monomials)} "
                f"coefficients of degree {self.degree} in {theta.shape[1]} parameters: give more different theta, "
                "a lower degree, or a smoothness (a prior)"
            )
        features = monomials.at(theta)
        trained, self.training_ = self._regressed(sequences, features, monomials.degrees, self.smoothness)
        if self.residuals == "correlated" and self.smoothness is not None:
            averages = _state_averages(sequences, theta, trained, monomials)
            known = stretched(self.description, trained.coefficients.shape, monomials)
            explained = np.einsum("ndf,kf->knd", known, features).reshape(averages.shape)
            smooth = smoothed(features, monomials.degrees, averages - explained, groups)
            coefficients = known + smooth.reshape(known.shape)
            trained = with_coefficients(trained, coefficients, sequences, features, self._training_options())
        self._set_states(monomials, trained.covariances, trained.durations)
        self.coefficients_ = np.ascontiguousarray(trained.coefficients)

    def state_means(self, theta: ArrayLike) -> Floats:
        """Means of all states for one theta (P,) or many (M, P) (3.1). Shape (N, D) or (M, N, D)."""
        features = self.monomials_.at(self._checked_theta(theta))
        result: Floats = np.einsum("ndf,...f->...nd", self.coefficients_, features)
        return result

    def _most_likely(self, recorded: Floats) -> ParameterEstimate:
        """The maximum of the likelihood, by EM (3.5), generalised where means are not linear."""
        prepared = self._prepared(self._resampled_for_states(recorded))
        widest, scale = 1.0 + 2.0 * self.search_margin, self.monomials_.scale
        bounds = np.full(len(scale), widest)
        best, value, gradient = search_kernels.best_climbed(
            self.monomials_.starts, -bounds, bounds, MAX_STEPS, STEP_TOLERANCE, prepared
        )
        information = search_kernels.information_at(best, gradient, prepared)
        covariance = inverse_information(information, widest) * np.outer(scale, scale)
        return ParameterEstimate(self.monomials_.centre + scale * best, covariance, float(value))

    def _log_likelihood_at(self, resampled: Floats, theta: Floats) -> float:
        return float(search_kernels.log_likelihood_at(self._scaled(theta), self._prepared(resampled)))

    def _move_means(self, change: Floats) -> None:
        self.coefficients_, self._white = self.coefficients_ + change, None

    def _prepared(self, sequence: Floats) -> search_kernels.Movement:
        if self._white is None:
            self._white = self._whitened(self.coefficients_)
        return self._movement(sequence, self._white, self.monomials_.exponents)

    @classmethod
    def _parameter_names(cls) -> list[str]:
        return [name for name in inspect.signature(PolynomialPHMM.__init__).parameters if name != "self"]

    def _arrays(self) -> dict[str, Floats]:
        return {"coefficients": self.coefficients_, **super()._arrays()}

    def _set_arrays(self, arrays: dict[str, Floats]) -> None:
        monomials, self.coefficients_ = self._read_monomials(arrays, self.degree), arrays["coefficients"]
        dim = self.coefficients_.shape[1]
        check_shapes(arrays, {"coefficients": (self.n_states, dim, len(monomials))})
        check_states(arrays, self.coefficients_[..., 0], self.d_min_, self.d_max_)
        self._set_states(monomials, arrays["covariances"], arrays["durations"])


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


def _state_averages(
    sequences: list[Floats], theta: Floats, trained: RegressedParameters, monomials: Monomials
) -> Floats:
    """Mean of the frames of each movement in each state. Shape (K, N D)."""
    common = Evaluator.of(trained.at(monomials.at(monomials.centre)))
    averages = []
    for sequence, one in zip(sequences, theta, strict=True):
        own = replace(common, means=trained.coefficients @ monomials.at(one))
        averages.append(state_averages(own.expectation(sequence)[1].T, sequence).ravel())
    return np.stack(averages)
