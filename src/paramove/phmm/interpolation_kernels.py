"""Compiled likelihood of an interpolative PHMM and its exact derivative in the position on the grid (thesis 3.4).

A position u in grid coordinates lies in a cell of 2^P local models. All interpolated values depend on u only through
the weights of these corners, so the derivative of ln p follows from one number per corner, for means, covariances
and durations alike (Fisher's identity).
"""

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm import compiled, compiled_sums, dot, feasible_ends, stacked_segments

NEGLIGIBLE = 1e-7
LOG_2PI = 1.8378770664093453


@compiled
def corner_weights(u: Floats, cell: Ints, knots: Floats, clamped: bool) -> tuple[Floats, Floats]:
    """Multilinear weights of a cell's corners (3.8)-(3.10), shape (2^P,), and their slopes in u, (2^P, P).

    The first dimension has the highest bit of a corner's number. Clamped weights are those of the nearest inside.
    """
    dimension = len(u)
    n_corners = 1 << dimension
    weights, slopes = np.ones(n_corners), np.ones((n_corners, dimension))
    for p in range(dimension):
        low, high = knots[p, cell[p]], knots[p, cell[p] + 1]
        fraction, slope = (u[p] - low) / (high - low), 1.0 / (high - low)
        if clamped and (u[p] < 0.0 or u[p] > 1.0):
            fraction, slope = min(1.0, max(0.0, fraction)), 0.0
        for c in range(n_corners):
            upper = (c >> (dimension - 1 - p)) & 1
            factor = fraction if upper else 1.0 - fraction
            weights[c] *= factor
            for q in range(dimension):
                slopes[c, q] *= (slope if upper else -slope) if q == p else factor
    return weights, slopes


@compiled
def corner_numbers(cell: Ints, counts: Ints) -> Ints:
    """Grid points at a cell's corners. Shape (2^P,)."""
    dimension = len(cell)
    numbers = np.zeros(1 << dimension, np.int64)
    for c in range(len(numbers)):
        for p in range(dimension):
            numbers[c] = numbers[c] * counts[p] + cell[p] + ((c >> (dimension - 1 - p)) & 1)
    return numbers


@compiled_sums
def _weighted(values: Floats, numbers: Ints, weights: Floats, i: int, out: Floats) -> None:
    """Sum over the corners of weight times `values[corner, i]`, flat."""
    out[:] = 0.0
    for c in range(len(numbers)):
        row, weight = values[numbers[c], i], weights[c]
        for k in range(len(out)):
            out[k] += weight * row[k]


@compiled_sums
def _factorised(matrix: Floats, dim: int) -> float:
    """Cholesky factor in place of the lower triangle of a flat (D D,) matrix. Sum of the logarithms of its diagonal."""
    total = 0.0
    for row in range(dim):
        first = row * dim
        for column in range(row + 1):
            second = column * dim
            value = matrix[first + column]
            for k in range(column):
                value -= matrix[first + k] * matrix[second + k]
            if column < row:
                matrix[first + column] = value / matrix[second + column]
            else:
                # Interpolated covariances are positive definite; rounding must not make a root of a negative number.
                matrix[first + column] = np.sqrt(max(value, 1e-300))
                total += np.log(matrix[first + column])
    return total


@compiled_sums
def _forward_substituted(root: Floats, dim: int, n: int, columns: Floats) -> None:
    """L^-1 of the first n columns (D, n), in place."""
    for row in range(dim):
        target = columns[row]
        for k in range(row):
            factor, source = root[row * dim + k], columns[k]
            for f in range(n):
                target[f] -= factor * source[f]
        scale = 1.0 / root[row * dim + row]
        for f in range(n):
            target[f] *= scale


@compiled_sums
def _backward_substituted(root: Floats, dim: int, n: int, columns: Floats) -> None:
    """L'^-1 of the first n columns (D, n), in place."""
    for row in range(dim - 1, -1, -1):
        target = columns[row]
        for k in range(row + 1, dim):
            factor, source = root[k * dim + row], columns[k]
            for f in range(n):
                target[f] -= factor * source[f]
        scale = 1.0 / root[row * dim + row]
        for f in range(n):
            target[f] *= scale


@compiled_sums
def _squares(columns: Floats, n: int, out: Floats) -> None:
    for f in range(n):
        out[f] = 0.0
    for row in range(columns.shape[0]):
        source = columns[row]
        for f in range(n):
            out[f] += source[f] * source[f]


@compiled
def outputs_at(
    columns: Floats, ends: Ints, numbers: Ints, weights: Floats, clamped: Floats, means: Floats, covariances: Floats
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """ln b_i(x_t) (N, T), Cholesky factors (N, D D), and whitened residuals (N, D, widest window)."""
    dim, n_frames = columns.shape
    n_states = means.shape[1]
    widest = 0
    for i in range(n_states):
        widest = max(widest, ends[i + 1, 1] - ends[i, 0])
    out = np.full((n_states, n_frames), -np.inf)
    roots, centre = np.empty((n_states, dim * dim)), np.empty(dim)
    white, squares = np.empty((n_states, dim, widest)), np.empty(widest)
    for i in range(n_states):
        begin, n = ends[i, 0], ends[i + 1, 1] - ends[i, 0]
        _weighted(means, numbers, weights, i, centre)
        _weighted(covariances, numbers, clamped, i, roots[i])
        log_norm = -0.5 * dim * LOG_2PI - _factorised(roots[i], dim)
        for k in range(dim):
            for f in range(n):
                white[i, k, f] = columns[k, begin + f] - centre[k]
        _forward_substituted(roots[i], dim, n, white[i])
        _squares(white[i], n, squares)
        for f in range(n):
            out[i, begin + f] = log_norm - 0.5 * squares[f]
    return out, roots, white


@compiled
def value_at(
    u: Floats, cell: Ints, columns: Floats, knots: Floats, counts: Ints, means: Floats, covariances: Floats,
    durations: Floats, d_min: int,
) -> float:  # fmt: skip
    """ln p(X | lambda^u)."""
    ends = feasible_ends(means.shape[1], d_min, durations.shape[2], columns.shape[1])
    numbers = corner_numbers(cell, counts)
    weights, _ = corner_weights(u, cell, knots, False)
    clamped, _ = corner_weights(u, cell, knots, True)
    out, _, _ = outputs_at(columns, ends, numbers, weights, clamped, means, covariances)
    value, _, _ = _segments(out, _log_durations(durations, numbers, clamped), d_min)
    return value


@compiled
def _log_durations(durations: Floats, numbers: Ints, clamped: Floats) -> Floats:
    n_states, d_max = durations.shape[1], durations.shape[2]
    result = np.empty((n_states, d_max))
    for i in range(n_states):
        _weighted(durations, numbers, clamped, i, result[i])
        for d in range(d_max):
            result[i, d] = np.log(result[i, d]) if result[i, d] > 0.0 else -np.inf
    return result


@compiled
def _segments(out: Floats, log_duration: Floats, d_min: int) -> tuple[float, Floats, Floats]:
    """ln p, responsibilities (N, T) and expected duration counts (N, d_max)."""
    n_states, n_frames = out.shape
    gamma, counted = np.zeros((n_states, n_frames)), np.zeros(log_duration.shape)
    offsets = np.array([0, n_frames])
    values = stacked_segments(out, offsets, log_duration, d_min, gamma, counted)
    return float(values[0]), gamma, counted


@compiled
def expectation_at(
    u: Floats, cell: Ints, columns: Floats, knots: Floats, counts: Ints, means: Floats, covariances: Floats,
    durations: Floats, d_min: int,
) -> tuple[float, Floats, Floats]:  # fmt: skip
    """ln p, its exact gradient in u (P,), and the information about u in the means with known states (P, P)."""
    dimension, dim = len(u), columns.shape[0]
    n_states, d_max = means.shape[1], durations.shape[2]
    ends = feasible_ends(n_states, d_min, d_max, columns.shape[1])
    numbers = corner_numbers(cell, counts)
    weights, slopes = corner_weights(u, cell, knots, False)
    clamped, clamped_slopes = corner_weights(u, cell, knots, True)
    out, roots, white = outputs_at(columns, ends, numbers, weights, clamped, means, covariances)
    log_duration = _log_durations(durations, numbers, clamped)
    value, gamma, counted = _segments(out, log_duration, d_min)
    gradient, information = np.zeros(dimension), np.zeros((dimension, dimension))
    if not value > -np.inf:
        return value, gradient, information
    from_means, from_covariances = np.zeros(len(numbers)), np.zeros(len(numbers))
    score, moved = np.empty((dim, 1)), np.empty((dim, dimension))
    pulled, score_matrix = np.empty((dim, white.shape[2])), np.empty((dim, dim))
    frame_weights = np.empty(white.shape[2])
    flat = np.empty(dim * dim)
    for i in range(n_states):
        n, weight = 0, 0.0
        for f in range(ends[i + 1, 1] - ends[i, 0]):
            weight_t = gamma[i, ends[i, 0] + f]
            if weight_t < NEGLIGIBLE:
                continue
            frame_weights[n] = weight_t
            weight += weight_t
            for k in range(dim):
                pulled[k, n] = white[i, k, f]
            n += 1
        for k in range(dim):
            score[k, 0] = dot(pulled[k, :n], frame_weights[:n])
        for p in range(dimension):
            for k in range(dim):
                moved[k, p] = 0.0
                for c in range(len(numbers)):
                    moved[k, p] += slopes[c, p] * means[numbers[c], i, k]
        _forward_substituted(roots[i], dim, dimension, moved)
        for p in range(dimension):
            for q in range(p + 1):
                for k in range(dim):
                    information[p, q] += weight * moved[k, p] * moved[k, q]
        _covariance_score(roots[i], dim, pulled, frame_weights, n, weight, score_matrix, flat)
        _backward_substituted(roots[i], dim, 1, score)
        for c in range(len(numbers)):
            from_means[c] += dot(means[numbers[c], i], score[:, 0])
            from_covariances[c] += 0.5 * dot(flat, covariances[numbers[c], i])
            for d in range(d_min - 1, d_max):
                if counted[i, d] > 0.0:
                    from_covariances[c] += counted[i, d] * durations[numbers[c], i, d] / np.exp(log_duration[i, d])
    for p in range(dimension):
        for c in range(len(numbers)):
            gradient[p] += slopes[c, p] * from_means[c] + clamped_slopes[c, p] * from_covariances[c]
        for q in range(p):
            information[q, p] = information[p, q]
    return value, gradient, information


@compiled_sums
def _covariance_score(
    root: Floats,
    dim: int,
    pulled: Floats,
    frame_weights: Floats,
    n: int,
    weight: float,
    score_matrix: Floats,
    flat: Floats,
) -> None:
    """Derivative of the expected log outputs in a covariance, twice: Sigma^-1 S Sigma^-1 - gamma Sigma^-1, (D D,).

    It is L'^-1 (S' - gamma I) L^-1 with S' the scatter of the whitened residuals.
    """
    for row in range(dim):
        for column in range(row + 1):
            total = 0.0
            for f in range(n):
                total += frame_weights[f] * pulled[row, f] * pulled[column, f]
            if row == column:
                total -= weight
            score_matrix[row, column] = total
            score_matrix[column, row] = total
    _backward_substituted(root, dim, dim, score_matrix)
    for row in range(dim):
        for column in range(row):
            upper = score_matrix[row, column]
            score_matrix[row, column] = score_matrix[column, row]
            score_matrix[column, row] = upper
    _backward_substituted(root, dim, dim, score_matrix)
    for row in range(dim):
        for column in range(dim):
            flat[row * dim + column] = score_matrix[row, column]
