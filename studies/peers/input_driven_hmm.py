"""Dynamax's LinearRegressionHMM with features of theta as its constant input: a parametric HMM."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np
from scipy.optimize import minimize

from paramove.documents import Floats
from paramove.hmm import resample
from studies.movements.method import FRAMES, OUTLIERS, SYNTHESIS, THETA, Estimate, Examples, NotAble
from studies.peers.hidden_markov import left_right
from studies.peers.library import library
from studies.peers.linear_gaussian import QuadraticFeatures

ITERATIONS = 15


@dataclass(frozen=True)
class Compiled:
    """The library's EM step and likelihood for one size of model, compiled once per process.

    Its own `fit_em` compiles the same step anew for each model, which takes longer than the training.
    """

    hmm: Any
    step: Any
    cost_and_gradient: Any


@lru_cache
def compiled(n_states: int, n_features: int, dim: int, degree: int) -> Compiled:
    """For a number of states, of features of theta, of dimensions, and a degree."""
    jax, jnp = jax_on_one_processor()
    hmm = library("dynamax.hidden_markov_model", "dynamax").LinearRegressionHMM(
        n_states, n_features, dim, transition_matrix_concentration=1.0001
    )
    _, props = hmm.initialize(jax.random.PRNGKey(0))

    @jax.jit  # type: ignore[untyped-decorator]
    def step(params: Any, state: Any, x: Any, inputs: Any) -> Any:
        statistics, values = jax.vmap(partial(hmm.e_step, params))(x, inputs)
        params, state = hmm.m_step(params, props, statistics, state)
        return params, state, values.sum()

    def cost(u: Any, params: Any, x: Any) -> Any:
        phi = u
        if degree > 1:
            i, j = np.triu_indices(u.shape[0])
            phi = jnp.concatenate([u, u[i] * u[j]])
        return -hmm.marginal_log_prob(params, x, inputs=jnp.tile(phi, (FRAMES, 1)))

    def stepped(params: Any, x: Any, inputs: Any) -> Any:
        state = hmm.initialize_m_step_state(params, props)
        for _ in range(ITERATIONS):
            params, state, _ = step(params, state, x, inputs)
        return params

    return Compiled(hmm, stepped, jax.jit(jax.value_and_grad(cost)))


def jax_on_one_processor() -> tuple[Any, Any]:
    """Jax and its numpy, with 64 bits and one thread."""
    os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    jax = library("jax", "jax")
    jax.config.update("jax_enable_x64", True)
    return jax, library("jax.numpy", "jax")


class InputDrivenHMM(NotAble):
    """Means linear in features of theta, full covariances; theta by the exact gradient from jax.

    Args:
        n_states: of the left-right chain.
        degree: of the features of theta.
        floor_m: added to the standard deviation of each coordinate after training, m.
    """

    can = frozenset({SYNTHESIS, THETA, OUTLIERS})

    def __init__(self, *, n_states: int = 20, degree: int = 2, floor_m: float = 0.00316) -> None:
        self.n_states, self.degree, self.floor_m = n_states, degree, floor_m

    def fit(self, examples: Examples) -> None:
        """Learn from movements of one action by EM from equal segments."""
        jax, jnp = jax_on_one_processor()
        x = np.stack([resample(one, FRAMES) for one in examples.sequences])
        self.features = QuadraticFeatures.of(examples.theta, self.degree)
        phi = self.features(examples.theta)
        self.centre = x.mean(axis=(0, 1))
        weights, biases, covariances = self._begin(x - self.centre, phi)
        self.compiled = compiled(self.n_states, phi.shape[1], x.shape[2], self.degree)
        params, _ = self.compiled.hmm.initialize(
            jax.random.PRNGKey(0),
            initial_probs=jnp.asarray(np.eye(self.n_states)[0]),
            transition_matrix=jnp.asarray(left_right(self.n_states)),
            emission_weights=jnp.asarray(weights),
            emission_biases=jnp.asarray(biases),
            emission_covariances=jnp.asarray(covariances),
        )
        inputs = jnp.asarray(np.repeat(phi[:, None], FRAMES, axis=1))
        params = self.compiled.step(params, jnp.asarray(x - self.centre), inputs)
        floor = self.floor_m**2 * jnp.eye(x.shape[2])
        self.params = params._replace(emissions=params.emissions._replace(covs=params.emissions.covs + floor))
        distinct = np.unique(examples.theta, axis=0)
        starts = distinct[np.linspace(0, len(distinct) - 1, min(9, len(distinct))).astype(int)]
        self.starts = (starts - self.features.centre) / self.features.scale

    def _begin(self, x: Floats, phi: Floats) -> tuple[Floats, Floats, Floats]:
        """Regression of the frames of equal segments on the features, with a slight ridge."""
        design = np.column_stack([np.ones(len(phi)), phi])
        solve = np.linalg.solve(design.T @ design + 1e-3 * np.eye(design.shape[1]), design.T)
        segments = [part.mean(axis=1) for part in np.array_split(x, self.n_states, axis=1)]
        coefficients = np.stack([solve @ segment for segment in segments])  # (N, 1 + F, D)
        floor = 1e-4 * np.eye(x.shape[2])
        residuals = [segment - design @ one for segment, one in zip(segments, coefficients, strict=True)]
        covariances = np.stack([r.T @ r / len(r) + floor for r in residuals])
        return coefficients[:, 1:].transpose(0, 2, 1), coefficients[:, 0], covariances

    def _cost(self, u: Floats, frames: Floats) -> tuple[float, Floats]:
        value, gradient = self.compiled.cost_and_gradient(u, self.params, frames)
        return float(value), np.asarray(gradient, dtype=np.float64)

    def _climbed(self, frames: Floats) -> tuple[Floats, float]:
        """Theta in standardised units and the log-likelihood there."""
        costs = [self._cost(start, frames)[0] for start in self.starts]
        best = self.starts[int(np.argmin(costs))]
        solution = minimize(self._cost, best, (frames,), jac=True, method="L-BFGS-B", bounds=[(-4.0, 4.0)] * len(best))
        return np.asarray(solution.x), -float(solution.fun)

    def _frames(self, x: Floats) -> Floats:
        result: Floats = resample(x, FRAMES) - self.centre
        return result

    def _curvature(self, u: Floats, frames: Floats, step: float = 1e-3) -> Floats:
        """Second derivative, by differences of the exact gradient. Shape (P, P)."""
        rows = [
            (self._cost(u + offset, frames)[1] - self._cost(u - offset, frames)[1]) / (2.0 * step)
            for offset in step * np.eye(len(u))
        ]
        return 0.5 * (np.array(rows) + np.array(rows).T)

    def synthesize(self, theta: Floats, n: int) -> Floats:
        """The means of the states at equal distances in time, joined by straight lines."""
        emissions = self.params.emissions
        means = np.asarray(emissions.weights) @ self.features(theta) + np.asarray(emissions.biases) + self.centre
        at = (np.arange(self.n_states) + 0.5) / self.n_states
        times = np.linspace(0.0, 1.0, n)
        inner = np.stack([np.interp(times, at, column) for column in means.T], axis=1)
        before, after = times < at[0], times > at[-1]  # beyond the first and last middle: straight on
        inner[before] = means[0] + np.outer((times[before] - at[0]) / (at[1] - at[0]), means[1] - means[0])
        inner[after] = means[-1] + np.outer((times[after] - at[-1]) / (at[-1] - at[-2]), means[-1] - means[-2])
        return inner

    def estimate(self, x: Floats) -> Estimate:
        """Maximum likelihood theta and the inverse of the curvature there."""
        frames = self._frames(x)
        u, _ = self._climbed(frames)
        scale = self.features.scale
        covariance = np.linalg.pinv(self._curvature(u, frames)) * np.outer(scale, scale)
        return Estimate(self.features.centre + scale * u, covariance)

    def score(self, x: Floats) -> float:
        """Log-likelihood at the best theta."""
        return self._climbed(self._frames(x))[1]
