"""M-step of the output covariances: full, diagonal or tied, with prior, shrinkage and floor (thesis 2.2.2)."""

from typing import Literal, get_args

import numpy as np

from paramove.documents import Floats
from paramove.hmm.gaussians import whitening_of
from paramove.hmm.options import Regularisation

Covariance = Literal["full", "diagonal", "tied"]


def check_kind(kind: str) -> None:
    """Raise ValueError for a kind of covariance that does not exist."""
    if kind not in get_args(Covariance):
        raise ValueError(f"covariance is one of {', '.join(get_args(Covariance))}, found {kind!r}")


def covariances_of(
    scatter: Floats, weight: Floats, regularisation: Regularisation, kind: Covariance = "full"
) -> Floats:
    """Covariances with prior, shrinkage and floor; the exact M-step of the penalised objective once sigma is zero.

    Sigma_i = (scatter_i + kappa target_i) / (weight_i + kappa) + sigma^2 I, eigenvalues not below the floor. "diagonal"
    keeps the diagonals of scatter and target, "tied" takes sums over all states. Shape (N, D, D) for each kind.
    """
    kappa = regularisation.target_frames
    pooled = scatter + kappa * regularisation.target
    frames = weight + kappa
    if kind == "diagonal":
        pooled = pooled * np.eye(scatter.shape[1])
    elif kind == "tied":
        pooled, frames = pooled.sum(axis=0, keepdims=True), frames.sum(keepdims=True)
    covariances: Floats = pooled / frames[:, None, None]
    if regularisation.added_variance > 0:
        covariances += regularisation.added_variance * np.eye(scatter.shape[1])
    lifted = floored(covariances, regularisation.floor_variance)
    return np.repeat(lifted, len(scatter), axis=0) if kind == "tied" else lifted


def floored(covariances: Floats, floor_variance: float) -> Floats:
    """The covariances with every eigenvalue at least `floor_variance`. Shape (N, D, D)."""
    # Where the difference to the floor has a Cholesky factor, no eigenvalue is below it: a tenth of the work.
    if floor_variance <= 0 or whitening_of(covariances - floor_variance * np.eye(covariances.shape[1]))[2] < 0:
        return covariances
    values, vectors = np.linalg.eigh(0.5 * (covariances + np.swapaxes(covariances, 1, 2)))
    if (values >= floor_variance).all():
        return covariances
    lifted = np.maximum(values, floor_variance)
    result: Floats = (vectors * lifted[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    return 0.5 * (result + np.swapaxes(result, 1, 2))


def pooled_covariance(scatter: Floats, weight: Floats) -> Floats:
    """Mean covariance over the states, repeated for each state. Shape (N, D, D)."""
    return np.broadcast_to(scatter.sum(axis=0) / weight.sum(), scatter.shape)


def log_prior(covariances: Floats, regularisation: Regularisation) -> float:
    """The shrinkage as the logarithm of an inverse Wishart prior, up to a constant."""
    if regularisation.target_frames == 0:
        return 0.0
    whitening, log_determinant, bad = whitening_of(covariances)
    if bad >= 0:
        return -np.inf
    traces = ((whitening @ regularisation.target) * whitening).sum()
    return -0.5 * regularisation.target_frames * float(log_determinant.sum() + traces)
