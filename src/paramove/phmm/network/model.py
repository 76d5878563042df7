"""The non-linear parametric HMM of Wilson and Bobick: state means are small networks of theta (thesis 3.3.2)."""

from __future__ import annotations

from dataclasses import replace

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
from paramove.phmm.examining import ExaminingPHMM
from paramove.phmm.features import Monomials
from paramove.phmm.network.choice import chosen_units, with_decay
from paramove.phmm.network.networks import StateNetworks
from paramove.phmm.network.training import NetworkParameters, NetworkPrior, SequenceMoments, train_networks
from paramove.phmm.noise import AddedNoise
from paramove.phmm.parametric import TrainingData
from paramove.phmm.regression import RegressedParameters, train_regressed
from paramove.phmm.ridge import chosen_ridge
from paramove.phmm.storage import check_states

SMOOTHNESS = 0.05
"""Of the polynomial model whose alignment of frames and states the networks begin with."""


class NeuralPHMM(ExaminingPHMM):
    """Means mu_i = Z_i phi(theta) + W2_i sigma(W1_i theta + b1_i); covariances do not depend on theta.

    The polynomial Z_i phi(theta), added to the network of (3.5), models the nearly linear part; the network learns the
    rest. If hidden units do not improve the prediction of left-out movements, there are none.

    Args:
        n_states, d_min, d_max, options, resampled_frames, description: as in `ParametricHMM`.
        n_hidden: hidden units of each state's network; None: by cross-validation over groups (thesis 3.3.2.1).
        skip_degree: of the polynomial, 1 or more. The network of the thesis alone estimated theta 25 times worse.
        gradient_steps: maximum number of steps of the networks in an iteration of generalised EM.
        n_restarts: drawn starts of the networks, of which the best is used. seed: of the draws.
        search_margin: how far outside the training's bounds `estimate` searches, as a fraction of their width.

    Attributes:
        networks_: the StateNetworks; of scaled theta.
        n_hidden_: hidden units of each state.
        covariances_: shape (N, D, D). durations_: p_i(d) in column d - 1, shape (N, d_max).
        performances_: distribution of whole training executions.
    """

    def __init__(
        self,
        n_states: int = 20,
        d_min: int | None = None,
        d_max: int | None = None,
        *,
        n_hidden: int | None = None,
        skip_degree: int = 2,
        options: TrainingOptions | None = None,
        resampled_frames: int | None = None,
        description: MovementDescription | None = None,
        gradient_steps: int = 8,
        n_restarts: int = 3,
        seed: int = 0,
        search_margin: float = 0.25,
    ) -> None:
        super().__init__(
            n_states, d_min, d_max, options=options, resampled_frames=resampled_frames, description=description
        )
        self.n_hidden = n_hidden
        self.skip_degree = skip_degree
        self.gradient_steps = gradient_steps
        self.n_restarts = n_restarts
        self.seed = seed
        self.search_margin = search_margin

    def _fit(self, data: TrainingData) -> None:
        if self.skip_degree < 1 or (self.n_hidden is not None and self.n_hidden < 0) or self.gradient_steps < 1:
            raise ValueError(
                "skip_degree and gradient_steps are at least 1, n_hidden is not negative, found "
                f"{self.skip_degree}, {self.gradient_steps} and {self.n_hidden}"
            )
        options = self._training_options()
        monomials = Monomials.of_degree(self.skip_degree, data.theta)
        aligned = self._aligned(data, options, monomials)
        positions, features = (data.theta - monomials.centre) / monomials.scale, monomials.at(data.theta)
        begin = NetworkParameters(
            StateNetworks(np.zeros((0, 0, 0)), np.zeros((0, 0, 0)), np.zeros((0, 0, 0))),
            aligned.covariances, aligned.durations, self.d_min_,
        )  # fmt: skip
        means = np.einsum("ndf,kf->knd", aligned.coefficients, features)
        moments = SequenceMoments.gathered(begin, data.sequences, means)
        metric = moments.squared.sum(axis=0) / moments.weights.sum()
        metric = metric + 1e-6 * np.trace(metric) / len(metric) * np.eye(len(metric))
        frames = float(moments.weights.sum(axis=0).mean())
        flat = moments.averages.reshape(len(positions), -1)
        strengths = np.array([0.0, *chosen_ridge(flat, features, monomials.degrees, data.groups)])
        ridge = frames * strengths[monomials.degrees]
        same = np.broadcast_to(metric, aligned.covariances.shape)
        targets = NetworkPrior(metric, ridge).targets(positions, features, moments, same)
        choice = chosen_units(targets, data.groups, self.n_hidden, self.n_restarts, self.seed)
        targets = with_decay(targets, choice)
        begin = NetworkParameters(targets.networks(choice.inner), aligned.covariances, aligned.durations, self.d_min_)
        prior = NetworkPrior(metric, targets.ridge)
        trained, self.training_ = train_networks(
            begin, prior, data.sequences, positions, features, options, self.gradient_steps
        )
        self._set_learned(monomials, trained.networks, trained.covariances, trained.durations)
        units = replace(monomials, units=trained.networks.inner[-1])  # of the last state, where theta shows most
        self.performances_ = self._fitted_performances(data, units)

    def _aligned(self, data: TrainingData, options: TrainingOptions, monomials: Monomials) -> RegressedParameters:
        """A polynomial model that aligns frames and states."""
        begin = equal_segments(data.sequences, self.n_states, self.d_min_, self.d_max_, options)
        coefficients = np.zeros((*begin.means.shape, len(monomials)))
        coefficients[..., 0] = begin.means
        initial = RegressedParameters(coefficients, begin.covariances, begin.durations, self.d_min_)
        features = monomials.at(data.theta)
        return train_regressed(initial, data.sequences, features, monomials.degrees, options, SMOOTHNESS)[0]

    def _set_learned(
        self, monomials: Monomials, networks: StateNetworks, covariances: Floats, durations: Floats
    ) -> None:
        self.monomials_ = monomials
        # Contiguous, as after reading a file: sums in another order differ in the last bits.
        arrays = (np.ascontiguousarray(one) for one in (networks.skip, networks.outer, networks.inner))
        self.networks_ = StateNetworks(*arrays)
        self.n_hidden_ = networks.inner.shape[1]
        self.covariances_, self.durations_ = np.ascontiguousarray(covariances), np.ascontiguousarray(durations)
        self._evaluator: Evaluator | None = None

    def at(self, theta: ArrayLike) -> LeftRightHMM:
        """The HMM for theta (P,)."""
        parameters = Parameters(self.state_means(theta), self.covariances_, self.durations_, self.d_min_)
        return LeftRightHMM.from_parameters(parameters, self.options)

    def state_means(self, theta: ArrayLike) -> Floats:
        """Means of all states for one theta (P,) or many (M, P) (3.5). Shape (N, D) or (M, N, D)."""
        values = self._checked_theta(theta)
        rows = np.atleast_2d(values)
        means = self.networks_.means(self._scaled(rows), self.monomials_.at(rows))
        result: Floats = means[0] if values.ndim == 1 else means
        return result

    def log_likelihood_and_gradient(self, sequence: ArrayLike, theta: ArrayLike) -> tuple[float, Floats]:
        """ln p(X | lambda^theta) and its derivative with respect to theta (P,), exact."""
        checked = self._checked(sequence)
        value, gradient, _ = self._expectation(self._scaled(self._checked_theta(theta)), self._prepared(checked))
        return value, gradient / self.monomials_.scale

    def _log_likelihood_at(self, checked: Floats, theta: Floats) -> float:
        return self._value(self._scaled(theta), self._prepared(checked))

    def _expect(self, noise: AddedNoise) -> None:
        super()._expect(noise)
        self._evaluator = None

    def _move_means(self, change: Floats) -> None:
        self.networks_ = replace(self.networks_, skip=self.networks_.skip + change)
        self._evaluator = None

    def _expectation(self, position: Floats, prepared: search_kernels.Movement) -> tuple[float, Floats, Floats]:
        """ln p, its gradient and the information of the means in scaled theta, at one position.

        At one position the means and their slopes are those of a linear model, and so are value and derivatives.
        """
        means, slopes = self._means_and_slopes(position)
        linear = np.concatenate([(means - slopes @ position)[..., None], slopes], axis=2)
        exponents = np.concatenate([np.zeros((1, len(position)), np.int64), np.eye(len(position), dtype=np.int64)])
        own = prepared._replace(white=np.ascontiguousarray(prepared.white @ linear), exponents=exponents)
        value, gradient, information = search_kernels.expectation_at(position, own)
        return float(value), gradient, information

    def _value(self, position: Floats, prepared: search_kernels.Movement) -> float:
        means = self.networks_.means(position[None], self._features(position)[None])[0]
        own = prepared._replace(
            white=np.ascontiguousarray(prepared.white @ means[..., None]),
            exponents=np.zeros((1, len(position)), np.int64),
        )
        return float(search_kernels.log_likelihood_at(position, own))

    def _means_and_slopes(self, position: Floats) -> tuple[Floats, Floats]:
        means = self.networks_.means(position[None], self._features(position)[None])[0]
        return means, self.networks_.slopes(position, self._jacobian(position))

    def _jacobian(self, position: Floats) -> Floats:
        """Slopes of the monomials in scaled theta. Shape (F, P)."""
        theta = self.monomials_.centre + self.monomials_.scale * position
        return self.monomials_.jacobian(theta) * self.monomials_.scale

    def _features(self, position: Floats) -> Floats:
        return self.monomials_.at(self.monomials_.centre + self.monomials_.scale * position)

    def _prepared(self, sequence: Floats) -> search_kernels.Movement:
        """Input of the kernels except theta; `white` holds the whitening, exponents are empty."""
        evaluator = self._common()
        ends = evaluator.ends(len(sequence))
        frames, rows = search_kernels.whitened_frames(np.ascontiguousarray(sequence.T), evaluator.whitening, ends)
        none = np.zeros((0, 0), np.int64)
        return search_kernels.Movement(
            frames, rows, evaluator.whitening, none, evaluator.log_norm, evaluator.log_duration, self.d_min_, ends
        )

    def _common(self) -> Evaluator:
        """Everything but the means."""
        if self._evaluator is None:
            self._evaluator = Evaluator.of(self.at(self.monomials_.centre).parameters)
        return self._evaluator

    def _scaled(self, theta: Floats) -> Floats:
        result: Floats = (theta - self.monomials_.centre) / self.monomials_.scale
        return result

    def _arrays(self) -> dict[str, Floats]:
        return {
            "skip": self.networks_.skip,
            "outer": self.networks_.outer,
            "inner": self.networks_.inner,
            "covariances": self.covariances_,
            "durations": self.durations_,
            "theta_centre": self.monomials_.centre,
            "theta_scale": self.monomials_.scale,
            **self._performance_arrays(),
        }

    def _set_arrays(self, arrays: dict[str, Floats]) -> None:
        centre, scale = arrays["theta_centre"], arrays["theta_scale"]
        if centre.ndim != 1 or scale.shape != centre.shape or not (scale > 0).all():
            raise ValueError(f"expected theta_scale above 0 as long as theta_centre, found {scale.shape}: {scale}")
        spanned = Monomials.of_degree(self.skip_degree, np.stack([centre - scale, centre + scale]))
        monomials = Monomials(spanned.exponents, centre, scale)
        networks = StateNetworks.from_arrays(arrays, self.n_states, len(monomials), len(centre))
        check_states(arrays, networks.skip[..., 0], self.d_min_, self.d_max_)
        self._set_learned(monomials, networks, arrays["covariances"], arrays["durations"])
        units = replace(monomials, units=networks.inner[-1])
        self._set_performances(arrays, units)
