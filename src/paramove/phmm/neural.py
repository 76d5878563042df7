"""The non-linear parametric HMM of Wilson and Bobick: state means are small networks of theta (thesis 3.3.2)."""

from __future__ import annotations

import itertools
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
from paramove.phmm.network_choice import chosen_units, with_decay
from paramove.phmm.network_training import NetworkParameters, NetworkPrior, SequenceMoments, train_networks
from paramove.phmm.networks import StateNetworks, hidden_units
from paramove.phmm.parametric import ParameterEstimate, ParametricHMM, TrainingData
from paramove.phmm.performance_spread import PerformanceSpread, Sensitivity
from paramove.phmm.regression import RegressedParameters, train_regressed
from paramove.phmm.ridge import chosen_ridge, residuals_left_out

Floats = NDArray[np.float64]

SMOOTHNESS = 0.05
"""Of the polynomial model whose alignment of frames and states the networks begin with."""
MOST_STARTS = 32
CLIMBED = 3
MOST_STEPS, TOLERANCE = 40, 1e-6


class NeuralPHMM(ParametricHMM):
    """Means mu_i = Z_i phi(theta) + W2_i sigma(W1_i theta + b1_i); covariances do not depend on theta.

    The polynomial Z_i phi(theta) beside the network of (3.5) takes what is nearly straight; the network learns the
    rest. Where movements left out are not predicted better with hidden units, there are none.

    Args:
        n_states, d_min, d_max, options, resampled_frames, description: as in `ParametricHMM`.
        n_hidden: hidden units of each state's network; None: by cross validation over groups (thesis 3.3.2.1).
        skip_degree: of the polynomial; 0 is the network of the thesis alone.
        gradient_steps: most steps of the networks in an iteration of generalised EM.
        n_restarts: drawn starts of the networks, of which the best is kept. seed: of the draws.
        search_margin: how far outside the training's bounds `estimate` looks, as a share of their width.

    Attributes:
        networks_: the StateNetworks; of scaled theta.
        n_hidden_: hidden units of each state.
        covariances_: shape (N, D, D). durations_: p_i(d) in column d - 1, shape (N, d_max).
        spread_: how whole training performances vary.
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
        places, features = (data.theta - monomials.centre) / monomials.scale, monomials.at(data.theta)
        begin = NetworkParameters(
            StateNetworks(np.zeros((0, 0, 0)), np.zeros((0, 0, 0)), np.zeros((0, 0, 0))),
            aligned.covariances, aligned.durations, self.d_min,
        )  # fmt: skip
        means = np.einsum("ndf,kf->knd", aligned.coefficients, polynomial.at(data.theta))
        found = SequenceMoments.gathered(begin, data.sequences, means)
        metric = found.squared.sum(axis=0) / found.weights.sum()
        metric = metric + 1e-6 * np.trace(metric) / len(metric) * np.eye(len(metric))
        frames = float(found.weights.sum(axis=0).mean())
        ridge = np.zeros(len(monomials))
        if self.skip_degree > 0:
            flat = found.averages.reshape(len(places), -1)
            strengths = np.array([0.0, *chosen_ridge(flat, features, monomials.degrees, data.groups)])
            ridge = frames * strengths[monomials.degrees]
        alike = np.broadcast_to(metric, aligned.covariances.shape)
        targets = NetworkPrior(metric, ridge).targets(places, features, found, alike)
        fewest = 1 if self.skip_degree == 0 else 0
        choice = chosen_units(targets, data.groups, (self.n_hidden, fewest), self.n_restarts, self.seed)
        targets = with_decay(targets, choice)
        begin = NetworkParameters(targets.networks(choice.inner), aligned.covariances, aligned.durations, self.d_min)
        prior = NetworkPrior(metric, targets.ridge)
        trained, self.training_ = train_networks(
            begin, prior, data.sequences, places, features, options, self.gradient_steps
        )
        self._set_learned(monomials, trained.networks, trained.covariances, trained.durations)
        self.spread_ = self._performance_spread(data, places, features, prior.ridge)

    def _aligned(self, data: TrainingData, options: TrainingOptions) -> tuple[RegressedParameters, Monomials]:
        """A polynomial model that says which frames belong to which states."""
        monomials = _monomials(max(1, self.skip_degree), data.theta)
        begin = equal_segments(data.sequences, self.n_states, self.d_min, self.d_max, options)
        coefficients = np.zeros((*begin.means.shape, len(monomials)))
        coefficients[..., 0] = begin.means
        initial = RegressedParameters(coefficients, begin.covariances, begin.durations, self.d_min)
        features = monomials.at(data.theta)
        trained, _ = train_regressed(initial, data.sequences, features, monomials.degrees, options, SMOOTHNESS)
        return trained, monomials

    def _performance_spread(
        self, data: TrainingData, places: Floats, features: Floats, ridge: Floats
    ) -> PerformanceSpread:
        learned = NetworkParameters(self.networks_, self.covariances_, self.durations_, self.d_min)
        found = SequenceMoments.gathered(learned, data.sequences, self.networks_.means(places, features))
        hidden = hidden_units(self.networks_.inner, places)
        alone = np.arange(len(places))
        residuals = np.empty_like(found.averages)
        for i in range(self.n_states):
            design = np.concatenate([features, hidden[:, i]], axis=1)
            held = np.diag(ridge / found.weights[:, i].mean() + 1e-9)
            residuals[:, i] = residuals_left_out(found.averages[:, i], design, held, alone)
        sensitivities = [
            self._sensitivity(place, len(sequence)) for place, sequence in zip(places, data.sequences, strict=True)
        ]
        n_groups = len(np.unique(data.groups))
        return PerformanceSpread.fitted(residuals.reshape(len(places), -1), sensitivities, n_groups)

    def _set_learned(
        self, monomials: Monomials, networks: StateNetworks, covariances: Floats, durations: Floats
    ) -> None:
        self.monomials_ = monomials
        # Contiguous, as a file gives them back: sums in another order differ in the last bits.
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
        """Maximum likelihood theta by generalised EM from several starts (thesis 3.3.2.2); its covariance from how
        whole training performances differ from their means.

        Raises ValueError for `finished=False`: networks of complete movements know nothing of beginnings.
        """  # fmt: skip
        if not finished:
            raise ValueError("a NeuralPHMM estimates theta of complete movements; a QuadraticPHMM also of beginnings")
        checked = self._checked(sequence)
        prepared = self._prepared(checked)
        starts = self._starts()
        values = [self._value(start, prepared) for start in starts]
        reached = [self._climbed(starts[number], prepared) for number in np.argsort(values)[: -CLIMBED - 1 : -1]]
        best, value = max(reached, key=lambda one: one[1])
        covariance = self.spread_.covariance(self._sensitivity(best, len(checked)), self._widest)
        scale = self.monomials_.scale
        return ParameterEstimate(self.monomials_.centre + scale * best, covariance * np.outer(scale, scale), value)

    @property
    def _widest(self) -> float:
        return 1.0 + 2.0 * self.search_margin

    def _starts(self) -> Floats:
        """A raster over the bounds of the training, finer where theta has few components. Shape (S, P)."""
        dimension = len(self.monomials_.centre)
        lines = max(2, int(MOST_STARTS ** (1.0 / dimension) + 1e-9))
        line = np.linspace(-1.0, 1.0, 2 * lines + 1)[1::2]
        return np.array(list(itertools.product(line, repeat=dimension)) if dimension < 6 else [np.zeros(dimension)])

    def _climbed(self, place: Floats, prepared: tuple[Any, ...]) -> tuple[Floats, float]:
        """Gauss-Newton steps with exact gradients, shortened while the likelihood would fall, within the bounds."""
        bounds = np.full(len(place), self._widest)
        value, gradient, information = self._expectation(place, prepared)
        for _ in range(MOST_STEPS):
            step = search_kernels.bounded_step(place, gradient, information, -bounds, bounds)
            for share in 0.4 ** np.arange(8):
                candidate = np.clip(place + share * step, -bounds, bounds)
                found = self._expectation(candidate, prepared)
                if found[0] >= value:
                    break
            else:
                break
            gain, place = found[0] - value, candidate
            value, gradient, information = found
            if gain < TOLERANCE:
                break
        return place, value

    def _expectation(self, place: Floats, prepared: tuple[Any, ...]) -> tuple[float, Floats, Floats]:
        """ln p, its gradient and the information of the means in scaled theta, at one place.

        At a place the means and their slopes are those of a linear model, and so are value and derivatives.
        """
        means, slopes = self._means_and_slopes(place)
        linear = np.concatenate([(means - slopes @ place)[..., None], slopes], axis=2)
        exponents = np.concatenate([np.zeros((1, len(place)), np.int64), np.eye(len(place), dtype=np.int64)])
        frames, present, whitening, *rest = prepared
        white = np.ascontiguousarray(whitening @ linear)
        value, gradient, information = search_kernels.expectation_at(place, exponents, frames, present, white, *rest)
        return float(value), gradient, information

    def _value(self, place: Floats, prepared: tuple[Any, ...]) -> float:
        means = self.networks_.means(place[None], self._features(place)[None])[0]
        frames, present, whitening, *rest = prepared
        white, exponents = np.ascontiguousarray(whitening @ means[..., None]), np.zeros((1, len(place)), np.int64)
        return float(search_kernels.log_likelihood_at(place, exponents, frames, present, white, *rest))

    def _means_and_slopes(self, place: Floats) -> tuple[Floats, Floats]:
        theta = self.monomials_.centre + self.monomials_.scale * place
        jacobian = self.monomials_.jacobian(theta) * self.monomials_.scale
        means = self.networks_.means(place[None], self._features(place)[None])[0]
        return means, self.networks_.slopes(place, jacobian)

    def _features(self, place: Floats) -> Floats:
        return self.monomials_.at(self.monomials_.centre + self.monomials_.scale * place)

    def _sensitivity(self, place: Floats, n_frames: int) -> Sensitivity:
        means, slopes = self._means_and_slopes(place)
        return Sensitivity.of(Parameters(means, self.covariances_, self.durations_, self.d_min), slopes, n_frames)

    def _prepared(self, sequence: Floats) -> tuple[Any, ...]:
        """What the kernels need beside a place: whitened frames, whitening, and the rest in their order."""
        if self._evaluator is None:
            self._evaluator = Evaluator.of(self.at(self.monomials_.centre).parameters)
        evaluator = self._evaluator
        ends = evaluator.ends(len(sequence))
        present = np.ones(len(sequence), dtype=np.bool_)
        frames = search_kernels.whitened_frames(sequence, present, evaluator.whitening, ends)
        return (
            frames, present, evaluator.whitening, evaluator.log_norm, evaluator.log_duration, self.d_min, ends,
            len(sequence),
        )  # fmt: skip

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
            **self.spread_.arrays(),
        }

    def _set_arrays(self, arrays: dict[str, Floats]) -> None:
        centre, scale = arrays["theta_centre"], arrays["theta_scale"]
        if centre.ndim != 1 or scale.shape != centre.shape or not (scale > 0).all():
            raise ValueError(f"expected theta_scale above 0 as long as theta_centre, found {scale.shape}: {scale}")
        spanned = _monomials(self.skip_degree, np.stack([centre - scale, centre + scale]))
        monomials = Monomials(spanned.exponents, centre, scale)
        dim, hidden = arrays["skip"].shape[1], arrays["inner"].shape[1]
        expected: dict[str, tuple[int, ...]] = {
            "skip": (self.n_states, dim, len(monomials)),
            "outer": (self.n_states, dim, hidden),
            "inner": (self.n_states, hidden, len(centre) + 1),
            "covariances": (self.n_states, dim, dim),
            "durations": (self.n_states, self.d_max),
        }
        for name, shape in expected.items():
            if arrays[name].shape != shape:
                raise ValueError(f"expected {name} of shape {shape}, found {arrays[name].shape}")
        local = (arrays["skip"][None, ..., 0], arrays["covariances"][None], arrays["durations"][None])
        check_local_models(*local, self.d_min)
        networks = StateNetworks(arrays["skip"], arrays["outer"], arrays["inner"])
        self._set_learned(monomials, networks, arrays["covariances"], arrays["durations"])
        self.spread_ = PerformanceSpread.from_arrays(arrays, self.n_states * dim)


def _monomials(degree: int, theta: Floats) -> Monomials:
    """As `Monomials.of_degree`, and of degree 0 the constant alone."""
    linear = Monomials.of_degree(max(1, degree), theta)
    return linear if degree > 0 else Monomials(linear.exponents[:1], linear.centre, linear.scale)
