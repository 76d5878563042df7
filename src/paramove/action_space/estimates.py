"""Estimates from weighted particles: action, parameters, progress and pose (thesis 6.4.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats, Ints

KERNEL_WIDTHS = (0.15, 0.10, 0.05)
"""sigma_1 to sigma_3 of (6.19), m."""


@dataclass(frozen=True)
class ThetaEstimate:
    """Theta of one action.

    Attributes:
        mean: mu_theta,a, shape (P,) (6.10). covariance: Sigma_theta,a, shape (P, P) (6.11).
    """

    mean: Floats
    covariance: Floats

    @property
    def deviations(self) -> Floats:
        """Standard deviation of each component (6.14). Shape (P,)."""
        return np.sqrt(np.diagonal(self.covariance))

    @property
    def deviation(self) -> float:
        """One number like the deviations of the last target (u, v): fourth root of its determinant (6.15)."""
        return float(max(np.linalg.det(self.covariance[-2:, -2:]), 0.0) ** 0.25)


def action_probabilities(action: Ints, weights: Floats, n_actions: int) -> Floats:
    """p_t(a) (6.8). Shape (A,)."""
    return np.bincount(action, weights, n_actions).astype(np.float64)


def theta_estimate(theta: Floats, weights: Floats) -> ThetaEstimate:
    """Of the particles of one action, theta (K, P), weights (K,) not normalised (6.10)-(6.12)."""
    normalised = weights / weights.sum()
    mean = normalised @ theta
    centred = theta - mean
    return ThetaEstimate(mean, (centred * normalised[:, None]).T @ centred)


def tau_histogram(action: Ints, tau: Floats, weights: Floats, n_actions: int, n_bins: int) -> Floats:
    """Posterior over progress for each action; all bins sum to 1 (figure 6.28). Shape (A, n_bins)."""
    bins = np.minimum((tau * n_bins).astype(np.int64), n_bins - 1)
    flat = np.bincount(action * n_bins + bins, weights, n_actions * n_bins)
    return np.asarray(flat.reshape(n_actions, n_bins))


def best_pose(poses: Floats, weights: Floats) -> Floats:
    """Pose of the particle with the largest weight (6.16). Shape (D,)."""
    return np.asarray(poses[int(weights.argmax())])


def mean_pose(poses: Floats, weights: Floats) -> Floats:
    """Mean of the poses (6.17). Shape (D,)."""
    return np.asarray(weights @ poses)


def refined_pose(poses: Floats, weights: Floats, first: Floats, widths: tuple[float, ...] = KERNEL_WIDTHS) -> Floats:
    """`first` drawn to the mean of the poses around it, by kernels that narrow (6.18)-(6.20). Shape (D,).

    Covariance sigma_i^2 I with sigma_i in m (6.19, corrected).
    """
    pose = first
    for width in widths:
        squared = ((poses - pose) ** 2).sum(axis=1) / width**2
        kernel_weights = weights * np.exp(-0.5 * (squared - squared.min()))
        total = float(kernel_weights.sum())
        if total > 0.0:
            pose = kernel_weights @ poses / total
    return np.asarray(pose)


def pose_covariance(poses: Floats, weights: Floats) -> Floats:
    """Covariance of the poses, m^2. Shape (D, D)."""
    return theta_estimate(poses, weights).covariance
