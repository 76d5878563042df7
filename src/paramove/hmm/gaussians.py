"""Compiled output densities and moments of Gaussian states over many frames at once.

Frames are handled in blocks of differences x - mu, one row per dimension, so that the inner loops run over frames in
vector registers; three dimensions at a time, for which rows of zeros are added. Whitening matrices are inverse Cholesky
factors (E.10), hence lower triangular: ln b(x) = log_norm - |S (x - mu)|^2 / 2 (2.25).
"""

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm.compilation import compiled, compiled_sums

BLOCK = 128
TILE = 3
NEGLIGIBLE = 1e-30  # a responsibility that changes no moment


@compiled
def whitening_of(covariances: Floats) -> tuple[Floats, Floats, int]:
    """Inverse Cholesky factors (N, D, D), ln det of the covariances (N,), and the first state that has none, or -1."""
    n_states, dim = covariances.shape[0], covariances.shape[1]
    whitening = np.zeros((n_states, dim, dim))
    log_determinant = np.zeros(n_states)
    factor = np.zeros((dim, dim))
    for i in range(n_states):
        for row in range(dim):
            for column in range(row + 1):
                value = covariances[i, row, column]
                for k in range(column):
                    value -= factor[row, k] * factor[column, k]
                if column < row:
                    factor[row, column] = value / factor[column, column]
                elif value > 1e-300:
                    factor[row, row] = np.sqrt(value)
                else:
                    return whitening, log_determinant, i
            log_determinant[i] += 2.0 * np.log(factor[row, row])
            # Row of the inverse by forward substitution (E.2.2).
            for column in range(row):
                value = 0.0
                for k in range(column, row):
                    value -= factor[row, k] * whitening[i, k, column]
                whitening[i, row, column] = value / factor[row, row]
            whitening[i, row, row] = 1.0 / factor[row, row]
    return whitening, log_determinant, -1


@compiled
def _padded(matrix: Floats) -> Floats:
    dim = matrix.shape[0]
    size = (dim + TILE - 1) // TILE * TILE
    result = np.zeros((size, size))
    result[:dim, :dim] = matrix
    return result


@compiled_sums
def _squares(difference: Floats, matrix: Floats, n: int, diagonal: bool, products: Floats, squared: Floats) -> None:
    """|matrix difference[:, f]|^2 of the first n columns, `matrix` lower triangular or diagonal."""
    p0, p1, p2 = products[0], products[1], products[2]
    for f in range(n):
        squared[f] = 0.0
    for row in range(0, matrix.shape[0], TILE):
        for f in range(n):
            p0[f] = 0.0
            p1[f] = 0.0
            p2[f] = 0.0
        for k in range(row if diagonal else 0, row + TILE, TILE):
            d0, d1, d2 = difference[k], difference[k + 1], difference[k + 2]
            a00, a01, a02 = matrix[row, k], matrix[row, k + 1], matrix[row, k + 2]
            a10, a11, a12 = matrix[row + 1, k], matrix[row + 1, k + 1], matrix[row + 1, k + 2]
            a20, a21, a22 = matrix[row + 2, k], matrix[row + 2, k + 1], matrix[row + 2, k + 2]
            for f in range(n):
                x0, x1, x2 = d0[f], d1[f], d2[f]
                p0[f] += a00 * x0 + a01 * x1 + a02 * x2
                p1[f] += a10 * x0 + a11 * x1 + a12 * x2
                p2[f] += a20 * x0 + a21 * x1 + a22 * x2
        for f in range(n):
            squared[f] += p0[f] * p0[f] + p1[f] * p1[f] + p2[f] * p2[f]


@compiled_sums
def _add_products(difference: Floats, scaled: Floats, n: int, diagonal: bool, total: Floats) -> None:
    """Add sum over the first n columns of scaled[:, f] difference[:, f]^T to the lower triangle of `total`."""
    for row in range(0, total.shape[0], TILE):
        s0, s1, s2 = scaled[row], scaled[row + 1], scaled[row + 2]
        for k in range(row if diagonal else 0, row + TILE, TILE):
            d0, d1, d2 = difference[k], difference[k + 1], difference[k + 2]
            a00, a01, a02, a10, a11, a12, a20, a21, a22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for f in range(n):
                x0, x1, x2 = d0[f], d1[f], d2[f]
                y0, y1, y2 = s0[f], s1[f], s2[f]
                a00 += y0 * x0
                a01 += y0 * x1
                a02 += y0 * x2
                a10 += y1 * x0
                a11 += y1 * x1
                a12 += y1 * x2
                a20 += y2 * x0
                a21 += y2 * x1
                a22 += y2 * x2
            total[row, k] += a00
            total[row, k + 1] += a01
            total[row, k + 2] += a02
            total[row + 1, k] += a10
            total[row + 1, k + 1] += a11
            total[row + 1, k + 2] += a12
            total[row + 2, k] += a20
            total[row + 2, k + 1] += a21
            total[row + 2, k + 2] += a22


@compiled
def stacked_log_outputs(
    columns: Floats, windows: Ints, means: Floats, whitening: Floats, log_norm: Floats, diagonal: bool
) -> Floats:
    """ln b_i of the frames in the windows of state i; other entries are undefined. Shape (N, frames).

    Args:
        columns: all frames of all sequences, one column each, shape (D, frames).
        windows: first column, and the one after the last, for each sequence and state, shape (K, N, 2).
        means: of the states, the same for all sequences (1, N, D) or of each (K, N, D).
        whitening, log_norm: of the states. diagonal: whether the whitening matrices are.
    """
    dim, n_states = columns.shape[0], means.shape[1]
    out = np.empty((n_states, columns.shape[1]))
    difference = np.zeros(((dim + TILE - 1) // TILE * TILE, BLOCK))
    products, squared, column_index = np.empty((TILE, BLOCK)), np.empty(BLOCK), np.empty(BLOCK, np.int64)
    for i in range(n_states):
        matrix = whitening[i] if dim % TILE == 0 else _padded(whitening[i])
        filled = 0
        for s in range(windows.shape[0]):
            own = min(s, means.shape[0] - 1)
            begin = windows[s, i, 0]
            while begin < windows[s, i, 1]:
                n = min(BLOCK - filled, windows[s, i, 1] - begin)
                for k in range(dim):
                    source, target, mean = (
                        columns[k, begin : begin + n],
                        difference[k, filled : filled + n],
                        means[own, i, k],
                    )
                    for f in range(n):
                        target[f] = source[f] - mean
                for f in range(n):
                    column_index[filled + f] = begin + f
                begin += n
                filled += n
                if filled == BLOCK:
                    _squares(difference, matrix, filled, diagonal, products, squared)
                    for f in range(filled):
                        out[i, column_index[f]] = log_norm[i] - 0.5 * squared[f]
                    filled = 0
        _squares(difference, matrix, filled, diagonal, products, squared)
        for f in range(filled):
            out[i, column_index[f]] = log_norm[i] - 0.5 * squared[f]
    return out


@compiled_sums
def _add_block(
    difference: Floats, scaled: Floats, frame_weights: Floats, n: int, diagonal: bool, first: Floats, total: Floats
) -> None:
    for k in range(first.shape[0]):
        source, target, total_k = difference[k], scaled[k], 0.0
        for f in range(n):
            product = frame_weights[f] * source[f]
            target[f] = product
            total_k += product
        first[k] += total_k
    _add_products(difference, scaled, n, diagonal, total)


@compiled
def stacked_moments(
    columns: Floats, windows: Ints, gamma: Floats, reference: Floats, diagonal: bool
) -> tuple[Floats, Floats, Floats]:
    """Sums over frames of gamma, gamma (x - ref) and gamma (x - ref)(x - ref)^T for each state.

    Moments about a reference near the data keep their precision where moments about zero would cancel. `gamma` has
    shape (N, frames), the rest is as in `stacked_log_outputs`. Shapes (N,), (N, D), (N, D, D); the last holds the
    diagonals alone if `diagonal`.
    """
    dim, n_states = columns.shape[0], reference.shape[1]
    size = (dim + TILE - 1) // TILE * TILE
    weight, first, second = np.zeros(n_states), np.zeros((n_states, dim)), np.zeros((n_states, dim, dim))
    difference, scaled, frame_weights = np.zeros((size, BLOCK)), np.zeros((size, BLOCK)), np.empty(BLOCK)
    total = np.empty((size, size))
    for i in range(n_states):
        total[:] = 0.0
        filled = 0
        for s in range(windows.shape[0]):
            own = min(s, reference.shape[0] - 1)
            t, end = windows[s, i, 0], windows[s, i, 1]
            while t < end:
                if gamma[i, t] < NEGLIGIBLE:
                    t += 1
                    continue
                run = 1
                while t + run < end and filled + run < BLOCK and gamma[i, t + run] >= NEGLIGIBLE:
                    run += 1
                for f in range(run):
                    frame_weights[filled + f] = gamma[i, t + f]
                    weight[i] += gamma[i, t + f]
                for k in range(dim):
                    source, target, mean = (
                        columns[k, t : t + run],
                        difference[k, filled : filled + run],
                        reference[own, i, k],
                    )
                    for f in range(run):
                        target[f] = source[f] - mean
                t += run
                filled += run
                if filled == BLOCK:
                    _add_block(difference, scaled, frame_weights, filled, diagonal, first[i], total)
                    filled = 0
        _add_block(difference, scaled, frame_weights, filled, diagonal, first[i], total)
        for row in range(dim):
            for k in range(row if diagonal else 0, row + 1):
                second[i, row, k] = total[row, k]
                second[i, k, row] = total[row, k]
    return weight, first, second


@compiled
def add_moments(
    sequence: Floats, gamma: Floats, ends: Ints, reference: Floats, weight: Floats, first: Floats, second: Floats
) -> None:
    """Add sum gamma, sum gamma (x - ref) and sum gamma (x - ref)(x - ref)^T of one sequence, in column_index.

    Only the lower triangle of `second` is touched.
    """
    dim = sequence.shape[1]
    size = (dim + TILE - 1) // TILE * TILE
    difference, scaled, frame_weights = np.zeros((size, BLOCK)), np.zeros((size, BLOCK)), np.empty(BLOCK)
    total = np.empty((size, size))
    for i in range(reference.shape[0]):
        total[:] = 0.0
        filled = 0
        for t in range(ends[i, 0], ends[i + 1, 1]):
            weight_t = gamma[t, i]
            if weight_t < NEGLIGIBLE:
                continue
            weight[i] += weight_t
            frame_weights[filled] = weight_t
            for k in range(dim):
                difference[k, filled] = sequence[t, k] - reference[i, k]
            filled += 1
            if filled == BLOCK:
                _add_block(difference, scaled, frame_weights, filled, False, first[i], total)
                filled = 0
        _add_block(difference, scaled, frame_weights, filled, False, first[i], total)
        for row in range(dim):
            for k in range(row + 1):
                second[i, row, k] += total[row, k]
