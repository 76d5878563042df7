"""Actions whose poses are known in closed form."""

from types import SimpleNamespace

import numpy as np

from paramove.action_space.vocabulary import ActionModel


class LinearPoses:
    """State means W theta + b, the same for all states, or with a path along the states; one covariance."""

    def __init__(self, weights, offset, covariance, path=None):
        self.weights, self.offset, self.covariance = weights, offset, covariance
        self.path = np.zeros((2, len(offset))) if path is None else path

    def state_means(self, theta):
        means = np.asarray(theta) @ self.weights.T + self.offset
        return means[..., None, :] + self.path

    def at(self, theta):
        return SimpleNamespace(covariances_=np.repeat(self.covariance[None], len(self.path), axis=0))


def toy_action(name="toy", n_parameters=2, duration_s=2.0, covariance=None, path=None, seed=0, pose_size=9, **others):
    """Poses linear in theta; without a `path` they do not depend on the progress."""
    rng = np.random.default_rng(seed)
    model = LinearPoses(
        rng.standard_normal((pose_size, n_parameters)), rng.standard_normal(pose_size),
        1e-6 * np.eye(pose_size) if covariance is None else covariance, path,
    )  # fmt: skip
    names = tuple(f"p{number}" for number in range(n_parameters))
    return ActionModel(name, model, duration_s, names, target=lambda theta: np.zeros((*theta.shape[:-1], 3)), **others)
