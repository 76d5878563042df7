"""Dynamic time warping with the step patterns (A) and (B) (thesis appendix B).

Local distances are computed a row at a time, for all frames of the second sequence at once, which vector instructions
can do; then the recurrence along the row, which they cannot, is left with one addition and one comparison per entry.
Distances are sums of squared differences, never |p|² + |q|² - 2 p·q, which would lose eight digits where the sequences
meet.
"""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints
from paramove.hmm import checked_sequence, compiled


@compiled
def distances_to(point: Floats, columns: Floats, row: Floats) -> None:
    """Euclidean distances of one frame (D,) to all frames of the other sequence, given as (D, T), into `row` (T,)."""
    dim, length = columns.shape
    row[:] = 0.0
    last = dim - dim % 4
    for d in range(0, last, 4):
        a, b, c, e = point[d], point[d + 1], point[d + 2], point[d + 3]
        for j in range(length):
            row[j] += (
                (columns[d, j] - a) ** 2
                + (columns[d + 1, j] - b) ** 2
                + (columns[d + 2, j] - c) ** 2
                + (columns[d + 3, j] - e) ** 2
            )
    for d in range(last, dim):
        a = point[d]
        for j in range(length):
            row[j] += (columns[d, j] - a) ** 2
    for j in range(length):
        row[j] = np.sqrt(row[j])


@compiled
def accumulated_a(p: Floats, columns: Floats) -> Floats:
    """d_ij of step pattern (A), Equation (B.7), for p (T_1, D) and the other sequence's columns (D, T_2). (T_1, T_2).

    Corrected: the first row and column accumulate. Two rows are filled at a time, the second one column behind: each
    entry of a row depends on the one before it, and the processor works on the other row meanwhile.
    """
    length = columns.shape[1]
    total = np.empty((len(p), length))
    upper, lower = np.empty(length), np.empty(length)
    distances_to(p[0], columns, upper)
    cumulated = 0.0
    for j in range(length):
        cumulated += upper[j]
        total[0, j] = cumulated
    for i in range(1, len(p) - 1, 2):
        distances_to(p[i], columns, upper)
        distances_to(p[i + 1], columns, lower)
        _two_rows(total[i - 1], upper, lower, total[i], total[i + 1])
    if len(p) % 2 == 0:
        distances_to(p[-1], columns, upper)
        _two_rows(total[-2], upper, upper, total[-1], lower)
    return total


@compiled
def _two_rows(above: Floats, upper: Floats, lower: Floats, first: Floats, second: Floats) -> None:
    """Fill two rows of d_ij below `above` from the distances in these rows."""
    length = len(above)
    first[0] = above[0] + upper[0]
    for j in range(1, length):
        first[j] = upper[j] + min(above[j], above[j - 1])
    before, left = first[0], first[0] + lower[0]
    second[0] = left
    for j in range(1, length):
        here = min(first[j], before + upper[j])
        first[j] = here
        left = lower[j] + min(min(before, here), left)
        second[j] = left
        before = here


@compiled
def accumulated_b(p: Floats, columns: Floats) -> Floats:
    """d_ij of step pattern (B), Equation (B.8), infinity where no path leads. Shapes as for (A)."""
    length = columns.shape[1]
    total = np.full((len(p), length), np.inf)
    row = np.empty(length)
    distances_to(p[0], columns, row)
    total[0, 0] = row[0]
    for i in range(1, len(p)):
        distances_to(p[i], columns, row)
        above, here = total[i - 1], total[i]
        if i >= 2 and length > 1:
            here[1] = row[1] + min(above[0], total[i - 2, 0])
        elif length > 1:
            here[1] = row[1] + above[0]
        for j in range(2, length):
            here[j] = min(above[j - 1], above[j - 2])
        if i >= 2:
            second = total[i - 2]
            for j in range(2, length):
                here[j] = min(here[j], second[j - 1])
        for j in range(2, length):
            here[j] += row[j]
    return total


@compiled
def traced_back(total: Floats, steps: Ints) -> Ints:
    """The best path, from its end back along the smallest predecessors (corrected). Shape (T', 2).

    Among equal predecessors the first of `steps`, shape (S, 2), is taken: the diagonal.
    """
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
    total = accumulated_a(p, columns) if pattern == "A" else accumulated_b(p, columns)
    if not np.isfinite(total[-1, -1]):
        raise ValueError(
            f"step pattern (B) cannot align {len(p)} with {len(q)} frames: the last index of one may be at most twice "
            "that of the other (length ratio within [1/2, 2]); resample one of them"
        )
    path = traced_back(total, STEPS[pattern])
    return Alignment(path[:, 0], path[:, 1], float(total[-1, -1]))


def movement_distance(first: ArrayLike, second: ArrayLike, *, n_points: int | None = None, cut: float = 0.15) -> float:
    """Root mean square distance of body points after warping, without the fraction `cut` at both ends (4.3), in m.

    Corrected: divided by the actual number of terms.

    Args:
        first, second: stacked positions of body points, each (T, D).
        n_points: number of body points; None: of three coordinates each.
        cut: fraction of the alignment that is left out at each end.

    Raises ValueError for frames that are not of so many points.
    """
    p, q = checked_sequence(first), checked_sequence(second)
    count = n_points if n_points is not None else p.shape[1] // 3
    if count < 1 or p.shape[1] % count or (n_points is None and p.shape[1] % 3):
        raise ValueError(
            f"frames of {p.shape[1]} numbers are not positions of {n_points or 'whole'} points; give n_points that "
            "divides them"
        )
    alignment = warp(p, q)
    length = len(alignment.first)
    middle = slice(int(np.floor(cut * length)), int(np.ceil((1.0 - cut) * length)))
    difference = p[alignment.first[middle]] - q[alignment.second[middle]]
    squared = (difference.reshape(len(difference), count, -1) ** 2).sum(axis=2)
    return float(np.sqrt(squared.mean()))
