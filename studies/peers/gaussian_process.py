"""Gaussian processes between theta and principal components of the frames (scikit-learn)."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from paramove.documents import Floats
from paramove.hmm import resample
from studies.movements.method import FRAMES, SYNTHESIS, THETA, Estimate, Examples, NotAble
from studies.peers.library import library


class FrameProcess(NotAble):
    """A process from theta to each component, for synthesis, and one from the components to theta."""

    can = frozenset({SYNTHESIS, THETA})

    def __init__(self, *, components: int = 8) -> None:
        self.components = components

    def fit(self, examples: Examples) -> None:
        """Learn from movements of one action."""
        rows = np.stack([resample(x, FRAMES).ravel() for x in examples.sequences])
        self.dim = examples.sequences[0].shape[1]
        count = min(self.components, len(rows) - 1)
        self.pca = library("sklearn.decomposition", "scikit-learn").PCA(count, random_state=0).fit(rows)
        z = self.pca.transform(rows)
        several = library("sklearn.multioutput", "scikit-learn").MultiOutputRegressor
        with warnings.catch_warnings():  # of lengths at their bounds: a kernel that the data do not need
            warnings.simplefilter("ignore", library("sklearn.exceptions", "scikit-learn").ConvergenceWarning)
            self.movement_of_theta = several(_process(examples.theta.shape[1])).fit(examples.theta, z)
            self.theta_of_movement = _process(count).fit(z, examples.theta)

    def synthesize(self, theta: Floats, n: int) -> Floats:
        """The means of the processes from theta."""
        row = self.pca.inverse_transform(self.movement_of_theta.predict(theta[None]))[0]
        return resample(row.reshape(FRAMES, self.dim), n)

    def estimate(self, x: Floats) -> Estimate:
        """Mean and variances of the process to theta."""
        z = self.pca.transform(resample(x, FRAMES).ravel()[None])
        mean, deviation = self.theta_of_movement.predict(z, return_std=True)
        return Estimate(mean[0], np.diag(np.square(deviation[0])))


def _process(n_inputs: int) -> Any:
    """Squared exponentials with a length per standardised input, a linear part and noise, chosen by the evidence."""
    processes = library("sklearn.gaussian_process", "scikit-learn")
    kernels = library("sklearn.gaussian_process.kernels", "scikit-learn")
    smooth = kernels.ConstantKernel() * kernels.RBF(np.full(n_inputs, 3.0), (0.1, 1e4))
    kernel = smooth + kernels.ConstantKernel() * kernels.DotProduct() + kernels.WhiteKernel(0.1)
    process = processes.GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
    scaler = library("sklearn.preprocessing", "scikit-learn").StandardScaler()
    return library("sklearn.pipeline", "scikit-learn").make_pipeline(scaler, process)
