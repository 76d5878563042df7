"""Compiled search for the parameter of a sequence under a model whose state means are polynomials of theta.

Everything that does not depend on theta is done once: the frames are whitened by each state's covariance, and so are
the coefficients; then one evaluation costs little more than its recursions. u is theta centred and scaled.
"""

import numpy as np
from numpy.typing import NDArray

from paramove.hmm.compilation import compiled
from paramove.hmm.kernels import backward, forward, posteriors
from paramove.phmm.features import monomials_at

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


@compiled
def whitened_frames(sequence: Floats, present: Flags, whitening: Floats, ends: Ints) -> Floats:
    """U_i x_t of the feasible pairs, state by state. Shape (pairs, D); zero for frames that are not present."""
    n_states, dim = whitening.shape[0], whitening.shape[1]
    count = 0
    for i in range(n_states):
        count += max(0, ends[i + 1, 1] - ends[i, 0])
    frames = np.zeros((count, dim))
    pair = 0
    for i in range(n_states):
        for t in range(ends[i, 0], ends[i + 1, 1]):
            if present[t]:
                for row in range(dim):
                    value = 0.0
                    for k in range(row + 1):
                        value += whitening[i, row, k] * sequence[t, k]
                    frames[pair, row] = value
            pair += 1
    return frames


@compiled
def log_outputs_at(
    frames: Floats, present: Flags, white: Floats, log_norm: Floats, ends: Ints, features: Floats, n_frames: int
) -> tuple[Floats, Floats]:
    """ln b_i(x_t) of the feasible pairs (T, N), 0 for frames not present, and whitened means (N, D)."""
    n_states, dim, n_features = white.shape
    out = np.full((n_frames, n_states), -np.inf)
    means = np.zeros((n_states, dim))
    pair = 0
    for i in range(n_states):
        for row in range(dim):
            value = 0.0
            for f in range(n_features):
                value += white[i, row, f] * features[f]
            means[i, row] = value
        for t in range(ends[i, 0], ends[i + 1, 1]):
            if present[t]:
                squared = 0.0
                for row in range(dim):
                    difference = frames[pair, row] - means[i, row]
                    squared += difference * difference
                out[t, i] = log_norm[i] - 0.5 * squared
            else:
                out[t, i] = 0.0
            pair += 1
    return out, means


@compiled
def log_likelihood_at(
    u: Floats, exponents: Ints, frames: Floats, present: Flags, white: Floats, log_norm: Floats,
    log_duration: Floats, d_min: int, ends: Ints, n_frames: int
) -> float:  # fmt: skip
    """ln p(X | lambda^u)."""
    features, slopes = np.empty(len(exponents)), np.empty(exponents.shape)
    monomials_at(u, exponents, features, slopes)
    out, _ = log_outputs_at(frames, present, white, log_norm, ends, features, n_frames)
    return float(forward(out, log_duration, d_min, ends)[-1, -1])


@compiled
def expectation_at(
    u: Floats, exponents: Ints, frames: Floats, present: Flags, white: Floats, log_norm: Floats,
    log_duration: Floats, d_min: int, ends: Ints, n_frames: int
) -> tuple[float, Floats, Floats]:  # fmt: skip
    """ln p, its gradient with respect to u (P,), and the information of the complete data (P, P).

    The gradient is exact (Fisher's identity); the information is that of known states, so it is never too small.
    """
    n_features, n_components = exponents.shape
    n_states, dim = white.shape[0], white.shape[1]
    features, slopes = np.empty(n_features), np.empty((n_features, n_components))
    monomials_at(u, exponents, features, slopes)
    out, means = log_outputs_at(frames, present, white, log_norm, ends, features, n_frames)
    ending = forward(out, log_duration, d_min, ends)
    value = ending[-1, -1]
    gradient, information = np.zeros(n_components), np.zeros((n_components, n_components))
    if not value > -np.inf:
        return value, gradient, information
    following = backward(out, log_duration, d_min, ends)
    gamma, _ = posteriors(out, log_duration, d_min, ends, ending, following)
    pair = 0
    residual, moved = np.empty(dim), np.empty((dim, n_components))
    for i in range(n_states):
        weight = 0.0
        residual[:] = 0.0
        for t in range(ends[i, 0], ends[i + 1, 1]):
            if present[t] and gamma[t, i] > 0.0:
                weight += gamma[t, i]
                for row in range(dim):
                    residual[row] += gamma[t, i] * (frames[pair, row] - means[i, row])
            pair += 1
        if weight == 0.0:
            continue
        for row in range(dim):
            for p in range(n_components):
                total = 0.0
                for f in range(n_features):
                    total += white[i, row, f] * slopes[f, p]
                moved[row, p] = total
                gradient[p] += total * residual[row]
        for p in range(n_components):
            for other in range(p + 1):
                total = 0.0
                for row in range(dim):
                    total += moved[row, p] * moved[row, other]
                information[p, other] += weight * total
    for p in range(n_components):
        for other in range(p):
            information[other, p] = information[p, other]
    return value, gradient, information


@compiled
def climbed(
    start: Floats, lower: Floats, upper: Floats, most_steps: int, tolerance: float, exponents: Ints, frames: Floats,
    present: Flags, white: Floats, log_norm: Floats, log_duration: Floats, d_min: int, ends: Ints, n_frames: int
) -> tuple[Floats, float]:  # fmt: skip
    """EM (linear models) or generalised EM from a start, within bounds: the place reached and its log-likelihood.

    A step solves for the parameter with the responsibilities of the last (thesis 3.3.1, (3.5)); where means are not
    linear it is a Gauss-Newton step, halved while the likelihood would fall.
    """
    place = np.minimum(np.maximum(start, lower), upper)
    value, gradient, information = expectation_at(
        place, exponents, frames, present, white, log_norm, log_duration, d_min, ends, n_frames
    )
    for _ in range(most_steps):
        if not value > -np.inf:
            break
        step = bounded_step(place, gradient, information, lower, upper)
        gain = -np.inf
        share = 1.0
        for _ in range(8):
            candidate = np.minimum(np.maximum(place + share * step, lower), upper)
            new_value, new_gradient, new_information = expectation_at(
                candidate, exponents, frames, present, white, log_norm, log_duration, d_min, ends, n_frames
            )
            gain = new_value - value
            if gain >= 0.0:
                break
            share *= 0.4
        if not gain >= 0.0:
            break
        place, value, gradient, information = candidate, new_value, new_gradient, new_information
        if gain < tolerance:
            break
    return place, value


@compiled
def bounded_step(place: Floats, gradient: Floats, information: Floats, lower: Floats, upper: Floats) -> Floats:
    """Newton step of the components that are not held at a bound by the gradient. Shape (P,)."""
    n_components = len(place)
    matrix, right = information.copy(), gradient.copy()
    trace = np.trace(information) / n_components
    for p in range(n_components):
        matrix[p, p] += 1e-9 * trace + 1e-300
        held = (place[p] <= lower[p] and gradient[p] < 0.0) or (place[p] >= upper[p] and gradient[p] > 0.0)
        if held:
            for other in range(n_components):
                matrix[p, other] = 0.0
                matrix[other, p] = 0.0
            matrix[p, p] = 1.0
            right[p] = 0.0
    return np.linalg.solve(matrix, right).astype(np.float64)


@compiled
def best_climbed(
    starts: Floats, lower: Floats, upper: Floats, most_steps: int, tolerance: float, exponents: Ints, frames: Floats,
    present: Flags, white: Floats, log_norm: Floats, log_duration: Floats, d_min: int, ends: Ints, n_frames: int
) -> tuple[Floats, float]:  # fmt: skip
    """The best place that is reached from the start with the greatest likelihood, or from the middle one (first)."""
    best, value = starts[0], -np.inf
    for s in range(len(starts)):
        found = log_likelihood_at(
            starts[s], exponents, frames, present, white, log_norm, log_duration, d_min, ends, n_frames
        )
        if found > value:
            best, value = starts[s], found
    return climbed(
        best, lower, upper, most_steps, tolerance, exponents, frames, present, white, log_norm, log_duration, d_min,
        ends, n_frames
    )  # fmt: skip


@compiled
def information_at(
    u: Floats, exponents: Ints, frames: Floats, present: Flags, white: Floats, log_norm: Floats,
    log_duration: Floats, d_min: int, ends: Ints, n_frames: int
) -> Floats:  # fmt: skip
    """Observed information: minus the Hessian by central differences of the exact gradient, symmetric. (P, P)."""
    n_components = len(u)
    hessian = np.empty((n_components, n_components))
    width = 1e-4
    for p in range(n_components):
        above, below = u.copy(), u.copy()
        above[p] += width
        below[p] -= width
        _, up, _ = expectation_at(
            above, exponents, frames, present, white, log_norm, log_duration, d_min, ends, n_frames
        )
        _, down, _ = expectation_at(
            below, exponents, frames, present, white, log_norm, log_duration, d_min, ends, n_frames
        )
        hessian[p] = (down - up) / (2.0 * width)
    return 0.5 * (hessian + hessian.T)


@compiled
def nearest(
    starts: Floats, bound: float, exponents: Ints, right: Floats, triangle: Floats, most_steps: int
) -> tuple[Floats, float, Floats]:
    """The place u within +-bound with the least |right - triangle phi(u)|^2, that sum, and triangle dphi/du there.

    Gauss-Newton with shorter steps where a whole one leads up, from the best of the starts (S, P).
    """
    n_features, n_components = exponents.shape
    features, slopes = np.empty(n_features), np.empty((n_features, n_components))
    place, misfit = starts[0].copy(), np.inf
    for s in range(len(starts)):
        monomials_at(starts[s], exponents, features, slopes)
        found = ((right - triangle @ features) ** 2).sum()
        if found < misfit:
            place, misfit = starts[s].copy(), found
    for _ in range(most_steps):
        monomials_at(place, exponents, features, slopes)
        moved = triangle @ slopes
        matrix = moved.T @ moved
        matrix += 1e-9 * (np.trace(matrix) + 1e-300) * np.eye(n_components)
        step = np.linalg.solve(matrix, moved.T @ (right - triangle @ features))
        share, gained = 1.0, -1.0
        for _ in range(5):
            candidate = np.minimum(np.maximum(place + share * step, -bound), bound)
            monomials_at(candidate, exponents, features, slopes)
            gained = misfit - ((right - triangle @ features) ** 2).sum()
            if gained > 0.0:
                break
            share *= 0.4
        if gained <= 0.0:
            break
        place, misfit = candidate, misfit - gained
        if gained < 1e-9 * (1.0 + misfit):
            break
    monomials_at(place, exponents, features, slopes)
    return place, ((right - triangle @ features) ** 2).sum(), triangle @ slopes
