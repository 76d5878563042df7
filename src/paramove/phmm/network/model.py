"""The non-linear parametric HMM of Wilson and Bobick: state means are small networks of theta (thesis 3.3.2)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.hmm import TrainingOptions
from paramove.phmm import search_kernels
from paramove.phmm.description import MovementDescription
from paramove.phmm.features import Monomials
from paramove.phmm.network.choice import chosen_units, with_decay
from paramove.phmm.network.networks import StateNetworks
from paramove.phmm.network.training import NetworkPrior, SequenceMoments, train_networks
from paramove.phmm.polynomial import ConstantCovariancePHMM
from paramove.phmm.ridge import chosen_ridge
from paramove.phmm.storage import check_states

SMOOTHNESS = 0.05
"""Of the polynomial model whose alignment of frames and states the networks begin with."""


class NeuralPHMM(ConstantCovariancePHMM):
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

    def _fit(self, sequences: list[Floats], theta: Floats, groups: Ints) -> None:
        if self.skip_degree < 1 or (self.n_hidden is not None and self.n_hidden < 0) or self.gradient_steps < 1:
            raise ValueError(
                "skip_degree and gradient_steps are at least 1, n_hidden is not negative, found "
                f"{self.skip_degree}, {self.gradient_steps} and {self.n_hidden}"
            )
        monomials = Monomials.of_degree(self.skip_degree, theta)
        positions, features = (theta - monomials.centre) / monomials.scale, monomials.at(theta)
        aligned, _ = self._regressed(sequences, features, monomials.degrees, SMOOTHNESS)
        means = np.einsum("ndf,kf->knd", aligned.coefficients, features)
        moments = SequenceMoments.gathered(aligned.at(features[0]), sequences, means)
        metric = moments.squared.sum(axis=0) / moments.weights.sum()
        metric = metric + 1e-6 * np.trace(metric) / len(metric) * np.eye(len(metric))
        frames = float(moments.weights.sum(axis=0).mean())
        flat = moments.averages.reshape(len(positions), -1)
        strengths = np.array([0.0, *chosen_ridge(flat, features, monomials.degrees, groups)])
        ridge = frames * strengths[monomials.degrees]
        same = np.broadcast_to(metric, aligned.covariances.shape)
        targets = NetworkPrior(metric, ridge).targets(positions, features, moments, same)
        choice = chosen_units(targets, groups, self.n_hidden, self.n_restarts, self.seed)
        targets = with_decay(targets, choice)
        networks, parameters, self.training_ = train_networks(
            targets.networks(choice.inner), aligned.at(features[0]), NetworkPrior(metric, targets.ridge), sequences,
            positions, features, self._training_options(), self.gradient_steps,
        )  # fmt: skip
        self._set_states(monomials, parameters.covariances, parameters.durations)
        self._set_networks(networks)

    def _set_networks(self, networks: StateNetworks) -> None:
        # Contiguous, as after reading a file: sums in another order differ in the last bits.
        arrays = (np.ascontiguousarray(one) for one in (networks.skip, networks.outer, networks.inner))
        self.networks_ = StateNetworks(*arrays)
        self.n_hidden_ = networks.inner.shape[1]

    def _features_of_executions(self) -> Monomials:
        """With the hidden units of the last state, where theta shows most."""
        return replace(self.monomials_, units=self.networks_.inner[-1])

    def state_means(self, theta: ArrayLike) -> Floats:
        """Means of all states for one theta (P,) or many (M, P) (3.5). Shape (N, D) or (M, N, D)."""
        values = self._checked_theta(theta)
        rows = np.atleast_2d(values)
        means = self.networks_.means(self._scaled(rows), self.monomials_.at(rows))
        result: Floats = means[0] if values.ndim == 1 else means
        return result

    def _log_likelihood_at(self, resampled: Floats, theta: Floats) -> float:
        position = self._scaled(theta)
        features = self.monomials_.at(self.monomials_.centre + self.monomials_.scale * position)
        means = self.networks_.means(position[None], features[None])[0]
        constant = np.zeros((1, len(position)), np.int64)
        movement = self._movement(resampled, self._whitened(means[..., None]), constant)
        return float(search_kernels.log_likelihood_at(position, movement))

    def _move_means(self, change: Floats) -> None:
        self.networks_ = replace(self.networks_, skip=self.networks_.skip + change)

    def _arrays(self) -> dict[str, Floats]:
        networks = {"skip": self.networks_.skip, "outer": self.networks_.outer, "inner": self.networks_.inner}
        return networks | super()._arrays()

    def _set_arrays(self, arrays: dict[str, Floats]) -> None:
        monomials = self._read_monomials(arrays, self.skip_degree)
        networks = StateNetworks.from_arrays(arrays, self.n_states, len(monomials), len(monomials.centre))
        check_states(arrays, networks.skip[..., 0], self.d_min_, self.d_max_)
        self._set_states(monomials, arrays["covariances"], arrays["durations"])
        self._set_networks(networks)
