"""Dynamic time warping with the step patterns (A) and (B) (thesis appendix B)."""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.hmm.compilation import compiled
from paramove.hmm.sequences import checked_sequence

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
StepPattern = Literal["A", "B"]

STEPS = {
    "A": np.array([[1, 1], [1, 0], [0, 1]]),  # Equation (B.7)
    "B": np.array([[1, 1], [2, 1], [1, 2]]),  # Equation (B.8)
}


class Alignment(NamedTuple):
    """Indices into both sequences, equally long, and the sum of the distances along the path."""

    first: Ints
    second: Ints
    distance: float


def warp(first: ArrayLike, second: ArrayLike, pattern: StepPattern = "A") -> Alignment:
    """Align two sequences (T_1, D) and (T_2, D) so that the summed Euclidean distance d(p_i, q_j) is least.

    Pattern (A) may stay in either sequence; (B) moves on in both at every step, by at most two.
    Raises ValueError where dimensions differ, or where no path exists: (B) needs a length ratio within [1/2, 2].
    """
    if pattern not in STEPS:
        raise ValueError(f"the step patterns are 'A' and 'B', found {pattern!r}")
    p = checked_sequence(first)
    q = checked_sequence(second, p.shape[1])
    total = accumulated_distances(p, q, STEPS[pattern])
    if not np.isfinite(total[-1, -1]):
        raise ValueError(
            f"step pattern (B) cannot align {len(p)} with {len(q)} frames: the last index of one may be at most twice "
            "that of the other (length ratio within [1/2, 2]); resample one of them"
        )
    path = traced_back(total, STEPS[pattern])
    return Alignment(path[:, 0], path[:, 1], float(total[-1, -1]))


@compiled
def accumulated_distances(p: Floats, q: Floats, steps: Ints) -> Floats:
    """d_ij, the least summed distance of allowed paths to (i, j); infinity where none leads. Shape (T_1, T_2)."""
    total = np.full((len(p), len(q)), np.inf)
    for i in range(len(p)):
        for j in range(len(q)):
            best = 0.0 if i == 0 and j == 0 else np.inf
            for s in range(len(steps)):
                k, m = i - steps[s, 0], j - steps[s, 1]
                if k >= 0 and m >= 0:
                    best = min(best, total[k, m])
            if best < np.inf:
                total[i, j] = best + np.sqrt(((p[i] - q[j]) ** 2).sum())
    return total


@compiled
def traced_back(total: Floats, steps: Ints) -> Ints:
    """The best path, from its end back along the smallest predecessors (corrected). Shape (T', 2)."""
    i, j = total.shape[0] - 1, total.shape[1] - 1
    path = np.empty((i + j + 1, 2), np.int64)
    count = 0
    while True:
        path[count, 0], path[count, 1] = i, j
        count += 1
        if i == 0 and j == 0:
            break
        best, next_i, next_j = np.inf, 0, 0
        for s in range(len(steps)):
            k, m = i - steps[s, 0], j - steps[s, 1]
            if k >= 0 and m >= 0 and total[k, m] < best:
                best, next_i, next_j = total[k, m], k, m
        i, j = next_i, next_j
    return path[:count][::-1].copy()


def movement_distance(
    first: ArrayLike, second: ArrayLike, *, n_points: int = 7, cut: float = 0.15, pattern: StepPattern = "A"
) -> float:
    """Root mean square distance of body points after warping, without the share `cut` at both ends (4.3), in m.

    Corrected: divided by the actual number of terms.
    """
    p, q = checked_sequence(first), checked_sequence(second)
    alignment = warp(p, q, pattern)
    length = len(alignment.first)
    kept = slice(int(np.floor(cut * length)), int(np.ceil((1.0 - cut) * length)))
    difference = p[alignment.first[kept]] - q[alignment.second[kept]]
    squared = (difference.reshape(len(difference), n_points, -1) ** 2).sum(axis=2)
    return float(np.sqrt(squared.mean()))
