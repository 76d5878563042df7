"""Parametric HMMs whose state means are polynomials of theta: linear, quadratic, cubic (thesis 3.3.1, 4.2.3)."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.hmm import LeftRightHMM, Parameters, TrainingOptions
from paramove.hmm.estimation import Evaluator
from paramove.hmm.sequences import check_length, checked_sequence
from paramove.hmm.training import equal_segments
from paramove.phmm import search_kernels
from paramove.phmm.description import MovementDescription
from paramove.phmm.features import Monomials
from paramove.phmm.local_models import check_local_models
from paramove.phmm.parametric import ParameterEstimate, ParametricHMM
from paramove.phmm.regression import RegressedParameters, train_regressed

Floats = NDArray[np.float64]

MOST_STEPS = 40
STEP_TOLERANCE = 1e-7


class PolynomialPHMM(ParametricHMM):
    """Means mu_i = Z_i phi(theta) with all monomials of theta up to a degree; covariances do not depend on theta.

    Args:
        n_states, d_min, d_max, options, resampled_frames, description: as in `ParametricHMM`.
        degree: of the polynomials; 1 is the linear PHMM of Wilson and Bobick.
        smoothness: over which share of the movement the dependence on theta changes little: length of the prior that
            couples the slopes of neighbouring states, its strength found by the evidence. None: no prior, plain EM.
        search_margin: how far outside the training's bounds `estimate` looks, as a share of their width.

    Attributes:
        monomials_: the Monomials.
        coefficients_: Z, shape (N, D, F), in the unit of the sequences.
        covariances_: shape (N, D, D).
        durations_: p_i(d) in column d - 1, shape (N, d_max).
    """

    def __init__(
        self,
        n_states: int = 20,
        d_min: int = 4,
        d_max: int = 6,
        *,
        degree: int = 2,
        options: TrainingOptions | None = None,
        resampled_frames: int | None = None,
        description: MovementDescription | None = None,
        smoothness: float | None = 0.05,
        search_margin: float = 0.25,
    ) -> None:
        super().__init__(
            n_states, d_min, d_max, options=options, resampled_frames=resampled_frames, description=description
        )
        self.degree = degree
        self.smoothness = smoothness
        self.search_margin = search_margin

    def _fit(self, sequences: list[Floats], theta: Floats) -> None:
        options = self._training_options()
        monomials = Monomials.of_degree(self.degree, theta)
        if self.smoothness is None and monomials.n_distinct(theta) < len(monomials):
            raise ValueError(
                f"{len(np.unique(theta, axis=0))} different theta do not determine the {len(monomials)} coefficients "
                f"of degree {self.degree} in {theta.shape[1]} parameters: give more different theta, a lower degree, "
                "or a smoothness (a prior)"
            )
        begin = equal_segments(sequences, self.n_states, self.d_min, self.d_max, options)
        coefficients = np.zeros((*begin.means.shape, len(monomials)))
        coefficients[..., 0] = begin.means
        initial = RegressedParameters(coefficients, begin.covariances, begin.durations, self.d_min)
        trained, self.training_ = train_regressed(
            initial, sequences, monomials.at(theta), monomials.degrees, options, self.smoothness
        )
        self._set_learned(monomials, trained.coefficients, trained.covariances, trained.durations)

    def _set_learned(self, monomials: Monomials, coefficients: Floats, covariances: Floats, durations: Floats) -> None:
        self.monomials_ = monomials
        self.coefficients_, self.covariances_, self.durations_ = coefficients, covariances, durations
        self._white: tuple[Evaluator, Floats] | None = None

    def at(self, theta: ArrayLike) -> LeftRightHMM:
        """The HMM for theta (P,)."""
        parameters = Parameters(self.state_means(theta), self.covariances_, self.durations_, self.d_min)
        return LeftRightHMM.from_parameters(parameters, self.options)

    def state_means(self, theta: ArrayLike) -> Floats:
        """Means of all states for one theta (P,) or many (M, P) (3.1). Shape (N, D) or (M, N, D)."""
        features = self.monomials_.at(self._checked_theta(theta))
        result: Floats = np.einsum("ndf,...f->...nd", self.coefficients_, features)
        return result

    def log_likelihood_and_gradient(self, sequence: ArrayLike, theta: ArrayLike) -> tuple[float, Floats]:
        """ln p(X | lambda^theta) and its derivative with respect to theta (P,), exact."""
        place = (self._checked_theta(theta) - self.monomials_.centre) / self.monomials_.scale
        value, gradient, _ = search_kernels.expectation_at(place, *self._prepared(self._checked(sequence)))
        return float(value), gradient / self.monomials_.scale

    def estimate(self, sequence: ArrayLike) -> ParameterEstimate:
        """Maximum likelihood theta by EM (3.5), generalised where the means are not linear; several starts."""
        prepared = self._prepared(self._checked(sequence))
        widest = 1.0 + 2.0 * self.search_margin
        bounds = np.full(len(self.monomials_.centre), widest)
        best, value = search_kernels.best_climbed(
            self._starts(), -bounds, bounds, *prepared, MOST_STEPS, STEP_TOLERANCE
        )
        information = search_kernels.information_at(best, *prepared)
        scale = self.monomials_.scale
        covariance = _inverse_information(information, widest) * np.outer(scale, scale)
        return ParameterEstimate(self.monomials_.centre + scale * best, covariance, float(value))

    def _starts(self) -> Floats:
        """Where the search begins: the middle, and the corners half-way out if means are not linear. Shape (S, P)."""
        n_components = len(self.monomials_.centre)
        middle = np.zeros((1, n_components))
        if self.degree == 1:
            return middle
        corners = np.stack(np.meshgrid(*[[-0.5, 0.5]] * n_components, indexing="ij"), axis=-1).reshape(-1, n_components)
        return np.concatenate([middle, corners])

    def _prepared(self, sequence: Floats) -> tuple[Any, ...]:
        """What the kernels need beside a place."""
        if self._white is None:
            evaluator = Evaluator.of(self.at(self.monomials_.centre).parameters)
            white = np.ascontiguousarray(evaluator.whitening @ self.coefficients_)
            self._white = (evaluator, white)
        evaluator, white = self._white
        ends = evaluator.ends(len(sequence))
        present = np.ones(len(sequence), dtype=np.bool_)
        frames = search_kernels.whitened_frames(sequence, present, evaluator.whitening, ends)
        return (
            self.monomials_.exponents, frames, present, white, evaluator.log_norm, evaluator.log_duration, self.d_min,
            ends, len(sequence),
        )  # fmt: skip

    def _checked(self, sequence: ArrayLike) -> Floats:
        checked = self._resampled(checked_sequence(sequence, self.covariances_.shape[-1]))
        check_length(len(checked), self.n_states, self.d_min, self.d_max)
        return checked

    def _checked_theta(self, theta: ArrayLike) -> Floats:
        values = np.asarray(theta, dtype=np.float64)
        n_components = len(self.monomials_.centre)
        if values.shape[-1:] != (n_components,) or values.ndim > 2 or not np.isfinite(values).all():
            raise ValueError(f"theta has {n_components} finite components, found shape {values.shape}: {values}")
        return values

    @classmethod
    def _parameter_names(cls) -> list[str]:
        return [name for name in inspect.signature(PolynomialPHMM.__init__).parameters if name != "self"]

    def _arrays(self) -> dict[str, Floats]:
        return {
            "coefficients": self.coefficients_,
            "covariances": self.covariances_,
            "durations": self.durations_,
            "theta_centre": self.monomials_.centre,
            "theta_scale": self.monomials_.scale,
        }

    def _set_arrays(self, arrays: dict[str, Floats]) -> None:
        centre, scale = arrays["theta_centre"], arrays["theta_scale"]
        monomials = Monomials.of_degree(self.degree, np.stack([centre - scale, centre + scale]))
        monomials = Monomials(monomials.exponents, centre, scale)
        dim = arrays["coefficients"].shape[1]
        expected: dict[str, tuple[int, ...]]
        expected = {"coefficients": (self.n_states, dim, len(monomials)), "covariances": (self.n_states, dim, dim)}
        expected |= {
            "durations": (self.n_states, self.d_max),
            "theta_centre": centre.shape,
            "theta_scale": centre.shape,
        }
        for name, shape in expected.items():
            if arrays[name].shape != shape:
                raise ValueError(f"expected {name} of shape {shape}, found {arrays[name].shape}")
        local = (arrays["coefficients"][None, ..., 0], arrays["covariances"][None], arrays["durations"][None])
        check_local_models(*local, self.d_min)
        self._set_learned(monomials, arrays["coefficients"], arrays["covariances"], arrays["durations"])


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


def _inverse_information(information: Floats, widest: float) -> Floats:
    """Covariance, no standard deviation above `widest`. Shape (P, P)."""
    values, vectors = np.linalg.eigh(information)
    values = np.maximum(values, 1.0 / widest**2)
    return np.asarray((vectors / values) @ vectors.T)
