"""A linear-Gaussian toy with its exact posterior, for the particle filter's own code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from paramove.action_space.grammar import Grammar
from paramove.action_space.particle_filter import ParticleFilter
from paramove.action_space.propagation import Propagation, PropagationOptions
from paramove.action_space.vocabulary import Vocabulary
from tests.action_space.toy import toy_action

DIFFUSION, MEMORY_S, SENSOR = 0.15, 0.6, 0.8


class KalmanToy:
    """Theta is a random walk, the deviation an autoregression, the pose a linear function of both."""

    prior_deviation = 0.5

    def __init__(self, seed):
        self._rng = np.random.default_rng(seed)
        loadings = np.zeros((9, 2))
        loadings[[0, 4], [0, 1]] = 0.7
        loadings[[2, 7], [1, 0]] = 0.4
        # A toy that never progresses: its duration is practically endless.
        self.action = toy_action(
            duration_s=1e9,
            covariance=loadings @ loadings.T,
            bounds=(-50.0, 50.0),
            explained_variance=0.999999,
            seed=seed,
        )
        model = self.action.model
        self.observation = np.concatenate([model.weights, self.action.factors[0]], axis=1)
        self.offset = model.offset
        self.mean = np.array([0.5, 0.5, 0.0, 0.0])
        self.covariance = np.diag([self.prior_deviation**2] * 2 + [1.0] * 2)

    def particle_filter(self, options, seed, diffusion_factor=1.0):
        propagation = PropagationOptions(
            pace=0.0, theta=DIFFUSION * diffusion_factor, theta_decay=0.0, theta_share=0.0, theta_min=0.0,
            deviation_memory_s=MEMORY_S, deviation_renewed=0.0, mirrored=0.0, from_base=0.0, from_prior=0.0
        )  # fmt: skip
        made = ParticleFilter(Propagation(Vocabulary([self.action]), Grammar.loop("toy"), propagation), options, seed)
        theta = 0.5 + self.prior_deviation * np.random.default_rng(seed).standard_normal(made.particles.theta.shape)
        made.particles = replace(made.particles, theta=theta)
        return made

    def frames(self, n_frames):
        """Times between frames and measured poses; the truth moves as the model says."""
        state = self.mean + np.sqrt(np.diagonal(self.covariance)) * self._rng.standard_normal(4)
        for _ in range(n_frames):
            elapsed_s = self._rng.uniform(0.05, 0.24)
            moved, noise = self._motion(elapsed_s)
            state = moved * state + np.sqrt(noise) * self._rng.standard_normal(4)
            yield elapsed_s, self.observation @ state + self.offset + SENSOR * self._rng.standard_normal(9)

    def log_likelihoods(self, poses, seen):
        return -0.5 * ((poses - seen) ** 2).sum(axis=1) / SENSOR**2 - 9.0 * np.log(SENSOR * np.sqrt(2.0 * np.pi))

    def kalman(self, elapsed_s, seen):
        """Predicts and corrects mean and covariance."""
        moved, noise = self._motion(elapsed_s)
        mean, covariance = moved * self.mean, np.outer(moved, moved) * self.covariance + np.diag(noise)
        innovation = seen - self.offset - self.observation @ mean
        spread = self.observation @ covariance @ self.observation.T + SENSOR**2 * np.eye(9)
        gain = np.linalg.solve(spread, self.observation @ covariance).T
        self.mean = mean + gain @ innovation
        self.covariance = covariance - gain @ self.observation @ covariance

    def _motion(self, elapsed_s):
        kept = np.exp(-elapsed_s / MEMORY_S)
        moved = np.array([1.0, 1.0, kept, kept])
        noise = np.array([DIFFUSION**2 * 8.0 * elapsed_s] * 2 + [1.0 - kept**2] * 2)
        return moved, noise
