"""Compiled search for the parameter of a sequence under a model whose state means are polynomials of theta.

Everything that does not depend on theta is done once: the frames are whitened by each state's covariance, and so are
the coefficients; then one evaluation costs little more than its recursions. u is theta centred and scaled.
"""

from typing import NamedTuple

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm import add_multiple, compiled, compiled_sums, dot, filled, segments_log_likelihood, stacked_segments
from paramove.phmm.features import features_at, monomials_at

NEGLIGIBLE = 1e-15  # of a responsibility
WIDTH = 1e-5
"""Step of differences of gradients."""


class Movement(NamedTuple):
    """Input of the search from one movement and one model; nothing in it depends on theta.

    Attributes:
        frames: whitened, of state i from its first possible frame on, (N, D, room).
        rows: the same as (N, room, D).
        white: whitened coefficients of the means, (N, D, F). exponents: of the monomials, (F, P).
        log_norm: ln of the output densities at the means, (N,). log_duration: (N, d_max). d_min: in frames.
        ends: feasible numbers of frames used after each state, (N + 1, 2).
    """

    frames: Floats
    rows: Floats
    white: Floats
    exponents: Ints
    log_norm: Floats
    log_duration: Floats
    d_min: int
    ends: Ints


@compiled_sums
def _add_whitened(matrix: Floats, frames: Floats, result: Floats) -> None:
    """Add lower triangular `matrix` times `frames`, both filled up with zeros to a multiple of three rows."""
    for row in range(result.shape[0]):
        target = result[row]
        for k in range(0, row + 1, 3):
            first, second, third = matrix[row, k], matrix[row, k + 1], matrix[row, k + 2]
            x, y, z = frames[k], frames[k + 1], frames[k + 2]
            for f in range(len(target)):
                target[f] += first * x[f] + second * y[f] + third * z[f]


@compiled
def whitened_frames(columns: Floats, whitening: Floats, ends: Ints) -> tuple[Floats, Floats]:
    """U_i x_t of the feasible pairs from frames (D, T): state i from its first possible frame on.

    In both orders, (N, D, room) to compute with all frames of a state at once, and (N, room, D).
    """
    n_states, dim = whitening.shape[0], whitening.shape[1]
    widest, size = 0, (dim + 2) // 3 * 3
    for i in range(n_states):
        widest = max(widest, ends[i + 1, 1] - ends[i, 0])
    room = filled(widest)
    result, frames, matrix = np.zeros((n_states, dim, room)), np.zeros((size, room)), np.zeros((dim, size))
    for i in range(n_states):
        n = ends[i + 1, 1] - ends[i, 0]
        frames[:dim, :n] = columns[:, ends[i, 0] : ends[i + 1, 1]]
        matrix[:, :dim] = whitening[i]
        _add_whitened(matrix, frames, result[i])
    return result, np.ascontiguousarray(result.transpose(0, 2, 1))


@compiled_sums
def _squared_distances(frames: Floats, mean: Floats, result: Floats) -> None:
    """From the mean (D,) to frames (D, room)."""
    for f in range(len(result)):
        result[f] = 0.0
    for row in range(len(mean)):
        source, centre = frames[row], mean[row]
        for f in range(len(result)):
            result[f] += (source[f] - centre) * (source[f] - centre)


@compiled_sums
def _log_densities(squared: Floats, log_norm: float, result: Floats) -> None:
    for f in range(len(result)):
        result[f] = log_norm - 0.5 * squared[f]


@compiled
def log_outputs_at(features: Floats, movement: Movement) -> tuple[Floats, Floats]:
    """ln b_i(x_t) of the feasible pairs, other entries are undefined, (N, T), and whitened means (N, D)."""
    n_states, dim, room = movement.frames.shape
    means = np.dot(movement.white.reshape(n_states * dim, len(features)), features).reshape(n_states, dim)
    out, squared = np.empty((n_states, movement.ends[n_states, 1])), np.empty(room)
    for i in range(n_states):
        first, n = movement.ends[i, 0], movement.ends[i + 1, 1] - movement.ends[i, 0]
        _squared_distances(movement.frames[i], means[i], squared)
        _log_densities(squared, movement.log_norm[i], out[i, first : first + n])
    return out, means


@compiled
def log_likelihood_at(u: Floats, movement: Movement) -> float:
    """ln p(X | lambda^u)."""
    features, slopes = np.empty(len(movement.exponents)), np.empty(movement.exponents.shape)
    monomials_at(u, movement.exponents, features, slopes)
    out, _ = log_outputs_at(features, movement)
    return float(segments_log_likelihood(out, movement.log_duration, movement.d_min))


@compiled
def _aligned(features: Floats, movement: Movement) -> tuple[float, Floats, Floats, Floats]:
    """ln p with these monomials, how many frames each state has (N,), the sum of these (N, D), and the means (N, D)."""
    out, means = log_outputs_at(features, movement)
    gamma, counts = np.zeros(out.shape), np.zeros(movement.log_duration.shape)
    value = stacked_segments(out, np.array([0, out.shape[1]]), movement.log_duration, movement.d_min, gamma, counts)[0]
    occupancy, sums = np.zeros(len(means)), np.zeros(means.shape)
    if value > -np.inf:
        for i in range(len(means)):
            for t in range(movement.ends[i, 0], movement.ends[i + 1, 1]):
                if gamma[i, t] > NEGLIGIBLE:
                    occupancy[i] += gamma[i, t]
                    add_multiple(gamma[i, t], movement.rows[i, t - movement.ends[i, 0]], sums[i])
    return value, occupancy, sums, means


@compiled
def expectation_at(u: Floats, movement: Movement) -> tuple[float, Floats, Floats]:
    """ln p, its gradient with respect to u (P,), and the information of the complete data (P, P).

    The gradient is exact (Fisher's identity); the information is that of known states, so it is never too small.
    """
    n_features, n_components = movement.exponents.shape
    n_states, dim = movement.white.shape[0], movement.white.shape[1]
    features, slopes = np.empty(n_features), np.empty((n_features, n_components))
    monomials_at(u, movement.exponents, features, slopes)
    value, occupancy, sums, means = _aligned(features, movement)
    gradient, information = np.zeros(n_components), np.zeros((n_components, n_components))
    moved = np.ascontiguousarray(np.dot(movement.white.reshape(n_states * dim, n_features), slopes).T)
    for i in range(n_states):
        add_multiple(-occupancy[i], means[i], sums[i])
    for p in range(n_components):
        gradient[p] = dot(moved[p], sums.ravel())
        weighted = (moved[p].reshape(n_states, dim) * occupancy.reshape(n_states, 1)).ravel()
        for other in range(n_components):
            information[p, other] = dot(weighted, moved[other])
    return value, gradient, information


@compiled
def climbed(
    start: Floats, lower: Floats, upper: Floats, max_steps: int, tolerance: float, movement: Movement
) -> tuple[Floats, float, Floats]:
    """EM (linear models) or generalised EM from a start, within bounds: the u reached, its log-likelihood, and the
    gradient there.

    A step solves for the parameter with the responsibilities of the last (thesis 3.3.1, (3.5)); where means are not
    linear it is a Gauss-Newton step, halved while the likelihood would fall.
    """
    u = np.minimum(np.maximum(start, lower), upper)
    value, gradient, information = expectation_at(u, movement)
    for _ in range(max_steps):
        if not value > -np.inf:
            break
        step = bounded_step(u, gradient, information, lower, upper)
        if 0.5 * np.dot(gradient, step) < tolerance:
            break
        gain = -np.inf
        fraction = 1.0
        for _ in range(8):
            candidate = np.minimum(np.maximum(u + fraction * step, lower), upper)
            new_value, new_gradient, new_information = expectation_at(candidate, movement)
            gain = new_value - value
            if gain >= 0.0:
                break
            fraction *= 0.4
        if not gain >= 0.0:
            break
        u, value, gradient, information = candidate, new_value, new_gradient, new_information
    return u, value, gradient


@compiled
def bounded_step(u: Floats, gradient: Floats, information: Floats, lower: Floats, upper: Floats) -> Floats:
    """Newton step of the components that are not held at a bound by the gradient. Shape (P,)."""
    n_components = len(u)
    matrix, right = information.copy(), gradient.copy()
    trace = np.trace(information) / n_components
    for p in range(n_components):
        matrix[p, p] += 1e-9 * trace + 1e-300
        held = (u[p] <= lower[p] and gradient[p] < 0.0) or (u[p] >= upper[p] and gradient[p] > 0.0)
        if held:
            for other in range(n_components):
                matrix[p, other] = 0.0
                matrix[other, p] = 0.0
            matrix[p, p] = 1.0
            right[p] = 0.0
    return np.linalg.solve(matrix, right).astype(np.float64)


@compiled
def _likeliest_start(starts: Floats, movement: Movement) -> tuple[int, float]:
    """Number of the start that is likeliest for the states that the frames have at the first one, and ln p there.

    The path of a movement depends much on theta, its timing little.
    """
    features, slopes = np.empty(len(movement.exponents)), np.empty(movement.exponents.shape)
    monomials_at(starts[0], movement.exponents, features, slopes)
    value, occupancy, sums, means = _aligned(features, movement)
    flat = movement.white.reshape(means.size, len(movement.exponents))
    best, largest = 0, -np.inf
    for s in range(len(starts)):
        monomials_at(starts[s], movement.exponents, features, slopes)
        means = np.dot(flat, features).reshape(means.shape)
        expected = 0.0
        for i in range(len(means)):
            for row in range(means.shape[1]):
                expected += means[i, row] * (sums[i, row] - 0.5 * occupancy[i] * means[i, row])
        if expected > largest:
            best, largest = s, expected
    return best, value


@compiled
def best_climbed(
    starts: Floats, lower: Floats, upper: Floats, max_steps: int, tolerance: float, movement: Movement
) -> tuple[Floats, float, Floats]:
    """`climbed` from the best of the starts (S, P); from the first one where the likelihood contradicts."""
    best, first = 0, -np.inf
    if len(starts) > 1:
        best, first = _likeliest_start(starts, movement)
    result = climbed(starts[best], lower, upper, max_steps, tolerance, movement)
    if best > 0 and not result[1] >= first:
        result = climbed(starts[0], lower, upper, max_steps, tolerance, movement)
    return result


@compiled
def information_at(u: Floats, gradient: Floats, movement: Movement) -> Floats:
    """Observed information: minus the Hessian by differences of the exact gradient, which is given for u. (P, P)."""
    n_components = len(u)
    hessian = np.empty((n_components, n_components))
    for p in range(n_components):
        shifted = u.copy()
        shifted[p] += WIDTH
        _, shifted_gradient, _ = expectation_at(shifted, movement)
        hessian[p] = (gradient - shifted_gradient) / WIDTH
    return 0.5 * (hessian + hessian.T)


@compiled
def nearest(
    starts: Floats, bound: float, exponents: Ints, units: Floats, right: Floats, triangle: Floats, max_steps: int
) -> tuple[Floats, Floats]:
    """The u within +-bound with the minimum |right - triangle phi(u)|^2, and triangle dphi/du there.

    Gauss-Newton with shorter steps where a full one increases it, from the best of the starts (S, P).
    """
    n_features, n_components = len(exponents) + len(units), exponents.shape[1]
    features, slopes = np.empty(n_features), np.empty((n_features, n_components))
    u, misfit = starts[0].copy(), np.inf
    for s in range(len(starts)):
        features_at(starts[s], exponents, units, features, slopes)
        start_misfit = ((right - triangle @ features) ** 2).sum()
        if start_misfit < misfit:
            u, misfit = starts[s].copy(), start_misfit
    for _ in range(max_steps):
        features_at(u, exponents, units, features, slopes)
        moved = triangle @ slopes
        matrix = moved.T @ moved
        matrix += 1e-9 * (np.trace(matrix) + 1e-300) * np.eye(n_components)
        step = np.linalg.solve(matrix, moved.T @ (right - triangle @ features))
        fraction, gained = 1.0, -1.0
        for _ in range(5):
            candidate = np.minimum(np.maximum(u + fraction * step, -bound), bound)
            features_at(candidate, exponents, units, features, slopes)
            gained = misfit - ((right - triangle @ features) ** 2).sum()
            if gained > 0.0:
                break
            fraction *= 0.4
        if gained <= 0.0:
            break
        u, misfit = candidate, misfit - gained
        if gained < 1e-9 * (1.0 + misfit):
            break
    features_at(u, exponents, units, features, slopes)
    return u, triangle @ slopes


@compiled
def all_nearest(
    starts: Floats, bound: float, exponents: Ints, units: Floats, rights: Floats, triangles: Floats, max_steps: int
) -> tuple[Floats, Floats]:
    """`nearest` of every row of `rights` (K, F) with its triangle, or the only one, (K or 1, F, F).

    Shapes (K, P) and (K, F, P).
    """
    n_features, n_components = triangles.shape[1], exponents.shape[1]
    positions, slopes = np.empty((len(rights), n_components)), np.empty((len(rights), n_features, n_components))
    for k in range(len(rights)):
        triangle = triangles[min(k, len(triangles) - 1)]
        positions[k], slopes[k] = nearest(starts, bound, exponents, units, rights[k], triangle, max_steps)
    return positions, slopes
