"""The non-linear parametric HMM of Wilson and Bobick: state means are small networks of theta (thesis 3.3.2)."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.hmm import (
    Evaluator,
    LeftRightHMM,
    Parameters,
    TrainingOptions,
    check_length,
    checked_sequence,
    equal_segments,
)
from paramove.phmm import search_kernels
from paramove.phmm.description import MovementDescription
from paramove.phmm.features import Monomials
from paramove.phmm.local_models import check_local_models
from paramove.phmm.network.choice import chosen_units, with_decay
from paramove.phmm.network.networks import StateNetworks
from paramove.phmm.network.performance import NetworkPerformances, StateAverages, parts_of
from paramove.phmm.network.training import NetworkParameters, NetworkPrior, SequenceMoments, train_networks
from paramove.phmm.parametric import ParameterEstimate, ParametricHMM, TrainingData
from paramove.phmm.performance import state_averages
from paramove.phmm.regression import RegressedParameters, train_regressed
from paramove.phmm.ridge import chosen_ridge

SMOOTHNESS = 0.05
"""Of the polynomial model whose alignment of frames and states the networks begin with."""
MAX_STARTS = 32
CLIMBED = 3
MAX_STEPS, TOLERANCE = 40, 1e-6
REALIGNMENTS = 2


class NeuralPHMM(ParametricHMM):
    """Means mu_i = Z_i phi(theta) + W2_i sigma(W1_i theta + b1_i); covariances do not depend on theta.

    The polynomial Z_i phi(theta), added to the network of (3.5), models the nearly linear part; the network learns the
    rest. If hidden units do not improve the prediction of left-out movements, there are none.

    Args:
        n_states, d_min, d_max, options, resampled_frames, description: as in `ParametricHMM`.
        n_hidden: hidden units of each state's network; None: by cross-validation over groups (thesis 3.3.2.1).
        skip_degree: of the polynomial; 0 is the network of the thesis alone.
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
        d_min: int = 4,
        d_max: int = 6,
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
        if self.skip_degree < 0 or (self.n_hidden is not None and self.n_hidden < 0) or self.gradient_steps < 1:
            raise ValueError(
                "skip_degree and n_hidden are not negative, gradient_steps is at least 1, found "
                f"{self.skip_degree}, {self.n_hidden} and {self.gradient_steps}"
            )
        if self.skip_degree == 0 and self.n_hidden == 0:
            raise ValueError(
                "without hidden units and with skip_degree 0 nothing depends on theta: give n_hidden=None or more"
            )
        options = self._training_options()
        aligned, polynomial = self._aligned(data, options)
        monomials = _monomials(self.skip_degree, data.theta)
        positions, features = (data.theta - monomials.centre) / monomials.scale, monomials.at(data.theta)
        begin = NetworkParameters(
            StateNetworks(np.zeros((0, 0, 0)), np.zeros((0, 0, 0)), np.zeros((0, 0, 0))),
            aligned.covariances, aligned.durations, self.d_min,
        )  # fmt: skip
        means = np.einsum("ndf,kf->knd", aligned.coefficients, polynomial.at(data.theta))
        moments = SequenceMoments.gathered(begin, data.sequences, means)
        metric = moments.squared.sum(axis=0) / moments.weights.sum()
        metric = metric + 1e-6 * np.trace(metric) / len(metric) * np.eye(len(metric))
        frames = float(moments.weights.sum(axis=0).mean())
        ridge = np.zeros(len(monomials))
        if self.skip_degree > 0:
            flat = moments.averages.reshape(len(positions), -1)
            strengths = np.array([0.0, *chosen_ridge(flat, features, monomials.degrees, data.groups)])
            ridge = frames * strengths[monomials.degrees]
        same = np.broadcast_to(metric, aligned.covariances.shape)
        targets = NetworkPrior(metric, ridge).targets(positions, features, moments, same)
        minimum = 1 if self.skip_degree == 0 else 0
        choice = chosen_units(targets, data.groups, (self.n_hidden, minimum), self.n_restarts, self.seed)
        targets = with_decay(targets, choice)
        begin = NetworkParameters(targets.networks(choice.inner), aligned.covariances, aligned.durations, self.d_min)
        prior = NetworkPrior(metric, targets.ridge)
        trained, self.training_ = train_networks(
            begin, prior, data.sequences, positions, features, options, self.gradient_steps
        )
        self._set_learned(monomials, trained.networks, trained.covariances, trained.durations)
        self.performances_ = self._performances(data, positions, features, prior.ridge)

    def _aligned(self, data: TrainingData, options: TrainingOptions) -> tuple[RegressedParameters, Monomials]:
        """A polynomial model that aligns frames and states."""
        monomials = _monomials(max(1, self.skip_degree), data.theta)
        begin = equal_segments(data.sequences, self.n_states, self.d_min, self.d_max, options)
        coefficients = np.zeros((*begin.means.shape, len(monomials)))
        coefficients[..., 0] = begin.means
        initial = RegressedParameters(coefficients, begin.covariances, begin.durations, self.d_min)
        features = monomials.at(data.theta)
        trained, _ = train_regressed(initial, data.sequences, features, monomials.degrees, options, SMOOTHNESS)
        return trained, monomials

    def _performances(
        self, data: TrainingData, positions: Floats, features: Floats, ridge: Floats
    ) -> NetworkPerformances:
        learned = NetworkParameters(self.networks_, self.covariances_, self.durations_, self.d_min)
        moments = SequenceMoments.gathered(learned, data.sequences, self.networks_.means(positions, features))
        jacobians = np.stack([self._jacobian(position) for position in positions])
        averages = np.concatenate([moments.averages, [sequence[-1:] for sequence in data.sequences]], axis=1)
        observed = StateAverages(positions, features, jacobians, averages, moments.weights, ridge, data.groups)
        return NetworkPerformances.fitted(observed, self.networks_.inner)

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
        parameters = Parameters(self.state_means(theta), self.covariances_, self.durations_, self.d_min)
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

    def estimate(self, sequence: ArrayLike, *, finished: bool = True) -> ParameterEstimate:
        """Theta of a complete movement and its covariance.

        Maximum likelihood by generalised EM from several starts (thesis 3.3.2.2) aligns the states; theta then follows
        from their averages, by the distribution of whole training executions about their means.

        Raises ValueError for `finished=False`: networks of complete movements do not model beginnings.
        """
        if not finished:
            raise ValueError("a NeuralPHMM estimates theta of complete movements; a QuadraticPHMM also of beginnings")
        checked = self._checked(sequence)
        prepared = self._prepared(checked)
        starts = self._starts()
        values = [self._value(start, prepared) for start in starts]
        reached = [self._climbed(starts[number], prepared) for number in np.argsort(values)[: -CLIMBED - 1 : -1]]
        likeliest = max(reached, key=lambda one: one[1])[0]
        best, covariance = self._refined(likeliest, checked)
        scale = self.monomials_.scale
        theta = self.monomials_.centre + scale * best
        return ParameterEstimate(theta, covariance * np.outer(scale, scale), self._value(best, prepared))

    def _refined(self, position: Floats, checked: Floats) -> tuple[Floats, Floats]:
        """Scaled theta from the distribution of whole executions, starting from the likeliest, and its covariance."""
        for _ in range(REALIGNMENTS):
            evaluator = replace(self._common(), means=self._means_and_slopes(position)[0])
            averages, weights = state_averages(evaluator.expectation(checked)[1].T, checked)
            observed = parts_of(np.concatenate([averages, checked[-1:]]), weights)
            missed = partial(self._missed, observed, weights)
            position, covariance = self.performances_.nearest(position, self._widest, missed)
        return position, covariance

    def _missed(self, observed: Floats, weights: Floats, position: Floats) -> tuple[Floats, Floats]:
        """Parts of a movement (n,) minus those of the networks at a position, and the slopes of the latter (n, P)."""
        last, jacobian = self.performances_.last, self._jacobian(position)
        means, slopes = self._means_and_slopes(position)
        end = last.means(position[None], self._features(position)[None])[0]
        slopes = np.concatenate([slopes, last.slopes(position, jacobian)])
        wide = np.stack([parts_of(one, weights) for one in np.moveaxis(slopes, 2, 0)], axis=1)
        return observed - parts_of(np.concatenate([means, end]), weights), wide

    @property
    def _widest(self) -> float:
        return 1.0 + 2.0 * self.search_margin

    def _starts(self) -> Floats:
        """A grid over the bounds of the training, finer where theta has few components. Shape (S, P)."""
        dimension = len(self.monomials_.centre)
        lines = max(2, int(MAX_STARTS ** (1.0 / dimension) + 1e-9))
        line = np.linspace(-1.0, 1.0, 2 * lines + 1)[1::2]
        return np.array(list(itertools.product(line, repeat=dimension)) if dimension < 6 else [np.zeros(dimension)])

    def _climbed(self, position: Floats, prepared: search_kernels.Movement) -> tuple[Floats, float]:
        """Gauss-Newton steps with exact gradients, shortened while the likelihood would fall, within the bounds."""
        bounds = np.full(len(position), self._widest)
        value, gradient, information = self._expectation(position, prepared)
        for _ in range(MAX_STEPS):
            step = search_kernels.bounded_step(position, gradient, information, -bounds, bounds)
            for fraction in 0.4 ** np.arange(8):
                candidate = np.clip(position + fraction * step, -bounds, bounds)
                candidate_result = self._expectation(candidate, prepared)
                if candidate_result[0] >= value:
                    break
            else:
                break
            gain, position = candidate_result[0] - value, candidate
            value, gradient, information = candidate_result
            if gain < TOLERANCE:
                break
        return position, value

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
            frames, rows, evaluator.whitening, none, evaluator.log_norm, evaluator.log_duration, self.d_min, ends
        )

    def _common(self) -> Evaluator:
        """Everything but the means."""
        if self._evaluator is None:
            self._evaluator = Evaluator.of(self.at(self.monomials_.centre).parameters)
        return self._evaluator

    def _checked(self, sequence: ArrayLike) -> Floats:
        self._check_trained()
        checked = self._resampled(checked_sequence(sequence, self.covariances_.shape[-1]))
        check_length(len(checked), self.n_states, self.d_min, self.d_max)
        return checked

    def _checked_theta(self, theta: ArrayLike) -> Floats:
        self._check_trained()
        values = np.asarray(theta, dtype=np.float64)
        n_components = len(self.monomials_.centre)
        if values.shape[-1:] != (n_components,) or values.ndim > 2 or not np.isfinite(values).all():
            raise ValueError(f"theta has {n_components} finite components, found shape {values.shape}: {values}")
        return values

    def _check_trained(self) -> None:
        if not hasattr(self, "networks_"):
            raise RuntimeError("this model is not trained yet: call fit, or load a file")

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
            **self.performances_.arrays(),
        }

    def _set_arrays(self, arrays: dict[str, Floats]) -> None:
        centre, scale = arrays["theta_centre"], arrays["theta_scale"]
        if centre.ndim != 1 or scale.shape != centre.shape or not (scale > 0).all():
            raise ValueError(f"expected theta_scale above 0 as long as theta_centre, found {scale.shape}: {scale}")
        spanned = _monomials(self.skip_degree, np.stack([centre - scale, centre + scale]))
        monomials = Monomials(spanned.exponents, centre, scale)
        networks = StateNetworks.from_arrays(arrays, self.n_states, len(monomials), len(centre))
        dim = networks.skip.shape[1]
        for name, shape in {"covariances": (self.n_states, dim, dim), "durations": (self.n_states, self.d_max)}.items():
            if arrays[name].shape != shape:
                raise ValueError(f"expected {name} of shape {shape}, found {arrays[name].shape}")
        local = (networks.skip[None, ..., 0], arrays["covariances"][None], arrays["durations"][None])
        check_local_models(*local, self.d_min)
        self._set_learned(monomials, networks, arrays["covariances"], arrays["durations"])
        self.performances_ = NetworkPerformances.from_arrays(arrays, networks)


def _monomials(degree: int, theta: Floats) -> Monomials:
    """As `Monomials.of_degree`, and of degree 0 the constant alone."""
    linear = Monomials.of_degree(max(1, degree), theta)
    return linear if degree > 0 else Monomials(linear.exponents[:1], linear.centre, linear.scale)
