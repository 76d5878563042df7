"""Dynamic time warping with the step patterns (A) and (B) (thesis appendix B)."""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from paramove.alignment import kernels
from paramove.documents import Ints
from paramove.hmm import checked_sequence

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
    """Align two sequences (T_1, D) and (T_2, D) so that the summed Euclidean distance d(p_i, q_j) is minimal.

    Pattern (A) may stay in either sequence; (B) moves on in both at every step, by at most two.
    Raises ValueError where dimensions differ, or where no path exists: (B) needs a length ratio within [1/2, 2]
    (corrected).
    """
    if pattern not in STEPS:
        raise ValueError(f"the step patterns are 'A' and 'B', found {pattern!r}")
    p = checked_sequence(first)
    q = checked_sequence(second)
    if p.shape[1] != q.shape[1]:
        raise ValueError(f"sequences to align need the same number of dimensions, found {p.shape[1]} and {q.shape[1]}")
    columns = np.ascontiguousarray(q.T)
    total = kernels.accumulated_a(p, columns) if pattern == "A" else kernels.accumulated_b(p, columns)
    if not np.isfinite(total[-1, -1]):
        raise ValueError(
            f"step pattern (B) cannot align {len(p)} with {len(q)} frames: the last index of one may be at most twice "
            "that of the other (length ratio within [1/2, 2]); resample one of them"
        )
    path = kernels.traced_back(total, STEPS[pattern])
    return Alignment(path[:, 0], path[:, 1], float(total[-1, -1]))


def movement_distance(
    first: ArrayLike, second: ArrayLike, *, n_points: int = 7, cut: float = 0.15, pattern: StepPattern = "A"
) -> float:
    """Root mean square distance of body points after warping, without the fraction `cut` at both ends (4.3), in m.

    Corrected: divided by the actual number of terms.
    """
    p, q = checked_sequence(first), checked_sequence(second)
    alignment = warp(p, q, pattern)
    length = len(alignment.first)
    middle = slice(int(np.floor(cut * length)), int(np.ceil((1.0 - cut) * length)))
    difference = p[alignment.first[middle]] - q[alignment.second[middle]]
    squared = (difference.reshape(len(difference), n_points, -1) ** 2).sum(axis=2)
    return float(np.sqrt(squared.mean()))
