"""Checks of local HMMs that come from a file: whether they are valid models."""

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats

ROUNDING = 1e-6


def check_local_models(means: Floats, covariances: Floats, durations: Floats, d_min: int) -> None:
    """Check G local HMMs of N states and D dimensions.

    Args:
        means: shape (G, N, D). covariances: shape (G, N, D, D). durations: p_i(d) in column d - 1, (G, N, d_max).
        d_min: minimum number of frames of a state.

    Raises:
        ValueError: for covariances that are not symmetric and positive definite, and rows of durations that are no
            distribution over d_min .. d_max; with the local model and the state.
    """
    if not means.size:
        raise ValueError(f"expected means of some local models, found shape {means.shape}")
    bad = np.argwhere((durations < 0).any(axis=-1) | (np.abs(durations.sum(axis=-1) - 1.0) > ROUNDING))
    if len(bad):
        row = durations[tuple(bad[0])]
        raise ValueError(f"expected durations that sum to 1 with none below 0, found {row.tolist()} {_where(bad[0])}")
    bad = np.argwhere(durations[..., : d_min - 1].any(axis=-1))
    if len(bad):
        raise ValueError(f"expected no duration below {d_min} frames, found one {_where(bad[0])}")
    size = np.abs(covariances).max(axis=(-2, -1))
    bad = np.argwhere(np.abs(covariances - np.swapaxes(covariances, -1, -2)).max(axis=(-2, -1)) > ROUNDING * size)
    if len(bad):
        raise ValueError(f"expected symmetric covariances, found one that is not {_where(bad[0])}")
    minimum = np.linalg.eigvalsh(covariances)[..., 0]
    bad = np.argwhere(minimum <= 0)
    if len(bad):
        eigenvalue = f"{minimum[tuple(bad[0])]:.3g} {_where(bad[0])}"
        raise ValueError(f"expected covariances that are positive definite, found the eigenvalue {eigenvalue}")


def _where(index: NDArray[np.intp]) -> str:
    return f"in state {int(index[1])} of local model {int(index[0])}"
