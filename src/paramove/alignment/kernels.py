"""Kernels of dynamic time warping: local distances a row at a time, then the recurrence along the row.

Distances are sums of squared differences, never |p|² + |q|² - 2 p·q, which would lose eight digits where the
sequences meet. A row of distances is computed for all frames of the second sequence at once, which vector instructions
can do; the recurrence, which they cannot, is left with one addition and one comparison per entry.
"""

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm import compiled


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
