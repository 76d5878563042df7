"""Compiled recursions of plain chains (first-order transitions, with or without a finish state), in the log domain.

A banded chain goes from state i to i .. i + width - 1 only; a dense one anywhere. Both find responsibilities from the
last frame backwards: p(q_t = j | X) times the fraction of each predecessor in alpha_j(t). That equals
alpha beta / p(X) (2.14), for what follows t does not depend on what was before, and takes no exponential function.
"""

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm.compilation import compiled, compiled_arithmetic
from paramove.hmm.vector_functions import UNDERFLOW, add_multiple, dot, exp_of_negative, log_of_one_plus

DENSE_UNDERFLOW = -700.0
MIN_POSTERIOR = 1e-100
SMALLEST_SUM = 1e-200  # below it terms that were lost to underflow could count


@compiled
def best_path(
    log_output: Floats, log_start: Floats, log_transitions: Floats, log_exit: Floats, width: int
) -> tuple[float, Ints]:
    """Log probability of the likeliest path and its states, shape (T,) (Viterbi). log_output: shape (N, T).

    From state i at most `width` - 1 states further; 0 if any transition is possible.
    """
    n_states, n_frames = log_output.shape
    best, choice = log_start + log_output[:, 0], np.zeros((n_frames, n_states), np.int64)
    following = np.empty(n_states)
    for t in range(1, n_frames):
        for j in range(n_states):
            first, last = (0, n_states - 1) if width == 0 else (max(0, j - width + 1), j)
            largest = -np.inf
            for i in range(first, last + 1):
                value = best[i] + log_transitions[i, j]
                if value > largest:
                    largest = value
                    choice[t, j] = i
            following[j] = largest + log_output[j, t]
        best[:] = following
    states = np.empty(n_frames, np.int64)
    states[-1] = np.argmax(best + log_exit)
    value = best[states[-1]] + log_exit[states[-1]]
    for t in range(n_frames - 1, 0, -1):
        states[t - 1] = choice[t, states[t]]
    return float(value), states


@compiled
def chain_windows(offsets: Ints, n_states: int, step: int, loops: bool, finish: bool) -> Ints:
    """First column that a state can have in each sequence, and the one after the last. Shape (K, N, 2).

    A banded chain starts in state 0 and passes at most `step` states per frame; with `finish` it ends in the last one.
    """
    windows = np.empty((len(offsets) - 1, n_states, 2), np.int64)
    for s in range(len(offsets) - 1):
        n_frames = offsets[s + 1] - offsets[s]
        for i in range(n_states):
            left = n_states - 1 - i
            first = 0 if step == 0 else (i + step - 1) // step
            end = n_frames
            if finish and step > 0:
                end = n_frames - (left + step - 1) // step
            if not loops:
                end = min(end, i + 1)
                if finish:
                    first = max(first, n_frames - 1 - left)
            windows[s, i, 0] = offsets[s] + first
            windows[s, i, 1] = offsets[s] + max(first, end)
    return windows


@compiled
def _active(windows: Ints, offset: int, n_frames: int, low: Ints, high: Ints) -> None:
    """First and last state that each frame can have."""
    low[:n_frames] = windows.shape[0]
    high[:n_frames] = -1
    for i in range(windows.shape[0]):
        for t in range(windows[i, 0] - offset, windows[i, 1] - offset):
            low[t] = min(low[t], i)
            high[t] = max(high[t], i)


@compiled_arithmetic
def _banded_forward(
    log_output: Floats, offset: int, n_frames: int, log_start: Floats, log_band: Floats, low: Ints, high: Ints,
    alpha: Floats, fractions: Floats,
) -> None:  # fmt: skip
    """ln alpha_j(t) (2.7) and, in `fractions[t, j, k]`, p(q_{t-1} = j - k | q_t = j, x_1..x_t)."""
    width = log_band.shape[1]
    for j in range(low[0], high[0] + 1):
        alpha[0, j] = log_start[j] + log_output[j, offset]
    for t in range(1, n_frames):
        for j in range(low[t], high[t] + 1):
            first, last = max(0, j - high[t - 1]), min(width - 1, j - low[t - 1])
            largest, likeliest = -np.inf, -1
            for k in range(first, last + 1):
                term = alpha[t - 1, j - k] + log_band[j, k]
                fractions[t, j, k] = term
                if term > largest:
                    largest, likeliest = term, k
            if likeliest < 0:
                alpha[t, j] = -np.inf
                fractions[t, j, :] = 0.0
                continue
            total = 1.0
            for k in range(first, last + 1):
                if k != likeliest:
                    difference = fractions[t, j, k] - largest
                    fractions[t, j, k] = np.exp(difference) if difference > UNDERFLOW else 0.0
                    total += fractions[t, j, k]
            fractions[t, j, likeliest] = 1.0
            alpha[t, j] = largest + log_output[j, offset + t]
            if total > 1.0:
                alpha[t, j] += np.log(total)
                for k in range(first, last + 1):
                    fractions[t, j, k] /= total


@compiled_arithmetic
def _next_state_forward(
    log_output: Floats, offset: int, n_frames: int, log_start: Floats, log_band: Floats, low: Ints, high: Ints,
    alpha: Floats, fractions: Floats,
) -> None:  # fmt: skip
    """`_banded_forward` for steps to the same and the next state alone, for all states of a frame at once."""
    n_states = len(log_start)
    largest, difference, small = np.empty(n_states), np.empty(n_states), np.empty(n_states)
    logarithm, bits = np.empty(n_states), np.empty(n_states, np.int64)
    stay, step = log_band[:, 0].copy(), log_band[:, 1].copy()
    alpha[0, :] = -np.inf
    for j in range(low[0], high[0] + 1):
        alpha[0, j] = log_start[j] + log_output[j, offset]
    for t in range(1, n_frames):
        before, now = alpha[t - 1], alpha[t]
        now[:] = -np.inf
        first, n = low[t], high[t] - low[t] + 1
        for j in range(n):
            i = first + j
            here = before[i] + stay[i]
            there = before[i - 1] + step[i] if i > 0 else -np.inf
            top = max(here, there)
            largest[j] = top
            # Of two impossible predecessors each has the fraction 0.
            difference[j] = min(here, there) - top if top > -np.inf else -np.inf
            fractions[t, i, 0] = 1.0 if here >= there else 0.0
        exp_of_negative(difference, n, bits, small)
        log_of_one_plus(small, n, logarithm)
        for j in range(n):
            i = first + j
            greater = 1.0 / (1.0 + small[j])
            less = small[j] * greater
            stays = fractions[t, i, 0] > 0.0
            fractions[t, i, 0] = greater if stays else less
            fractions[t, i, 1] = less if stays else greater
            now[i] = largest[j] + logarithm[j] + log_output[i, offset + t]


@compiled
def _last_frame(alpha: Floats, log_exit: Floats, low: int, high: int, gamma: Floats, column: int) -> float:
    """Log-likelihood (2.9), and the responsibilities of the last frame."""
    largest = -np.inf
    for i in range(low, high + 1):
        largest = max(largest, alpha[i] + log_exit[i])
    if largest == -np.inf:
        return largest
    total = 0.0
    for i in range(low, high + 1):
        gamma[i, column] = np.exp(alpha[i] + log_exit[i] - largest)
        total += gamma[i, column]
    for i in range(low, high + 1):
        gamma[i, column] /= total
    return float(largest + np.log(total))


@compiled
def stacked_banded(
    log_output: Floats, offsets: Ints, windows: Ints, log_start: Floats, log_band: Floats, log_exit: Floats,
    gamma: Floats, counts: Floats, starts: Floats, exits: Floats,
) -> Floats:  # fmt: skip
    """E-step over many sequences: log-likelihood of each, shape (K,); -inf where a sequence is impossible.

    Args:
        log_output: ln b_i of all frames, shape (N, frames). offsets: first frame of each sequence, then their number.
        windows: from `chain_windows`.
        log_start, log_exit: shape (N,); log_exit is 0 without a finish state.
        log_band: ln a_{j-k, j} in [j, k], shape (N, width).
        gamma: responsibilities, written within the windows, shape (N, frames).
        counts, starts, exits: expected transitions (as log_band), first and last states, added to.
    """
    n_states, width = log_band.shape
    longest = np.diff(offsets).max()
    alpha, fractions = np.empty((longest, n_states)), np.empty((longest, n_states, width))
    low, high = np.empty(longest, np.int64), np.empty(longest, np.int64)
    log_likelihood = np.empty(len(offsets) - 1)
    for s in range(len(offsets) - 1):
        offset, n_frames = offsets[s], offsets[s + 1] - offsets[s]
        _active(windows[s], offset, n_frames, low, high)
        if high[:n_frames].min() < 0:
            log_likelihood[s] = -np.inf
            continue
        if width == 2:
            _next_state_forward(log_output, offset, n_frames, log_start, log_band, low, high, alpha, fractions)
        else:
            _banded_forward(log_output, offset, n_frames, log_start, log_band, low, high, alpha, fractions)
        last = n_frames - 1
        value = _last_frame(alpha[last], log_exit, low[last], high[last], gamma, offset + last)
        log_likelihood[s] = value
        if value == -np.inf:
            continue
        for j in range(low[last], high[last] + 1):
            exits[j] += gamma[j, offset + last]
        for t in range(last, 0, -1):
            for i in range(low[t - 1], high[t - 1] + 1):
                gamma[i, offset + t - 1] = 0.0
            for j in range(low[t], high[t] + 1):
                posterior = gamma[j, offset + t]
                if posterior < MIN_POSTERIOR:
                    continue
                for k in range(max(0, j - high[t - 1]), min(width - 1, j - low[t - 1]) + 1):
                    joint = posterior * fractions[t, j, k]
                    gamma[j - k, offset + t - 1] += joint
                    counts[j, k] += joint
        for j in range(low[0], high[0] + 1):
            starts[j] += gamma[j, offset]
    return log_likelihood


@compiled
def _log_sum(terms: Floats) -> float:
    largest = terms.max()
    if largest == -np.inf:
        return float(largest)
    return float(largest + np.log(np.exp(terms - largest).sum()))


@compiled
def _dense_forward(
    log_output: Floats, offset: int, n_frames: int, log_start: Floats, transitions: Floats, log_transitions: Floats,
    alpha: Floats, scaled: Floats, sums: Floats,
) -> None:  # fmt: skip
    """ln alpha_j(t) (2.7); `scaled[t]` is alpha(t) over its largest entry, `sums[t + 1]` its product with A.

    Where that product is so small that underflow could matter, it is computed again from logarithms and `sums` is 0.
    """
    n_states = len(log_start)
    for j in range(n_states):
        alpha[0, j] = log_start[j] + log_output[j, offset]
    for t in range(1, n_frames):
        largest = alpha[t - 1].max()
        sums[t, :] = 0.0
        for i in range(n_states):
            difference = alpha[t - 1, i] - largest
            scaled[t - 1, i] = np.exp(difference) if difference > DENSE_UNDERFLOW else 0.0
            if scaled[t - 1, i] > 0.0:
                add_multiple(scaled[t - 1, i], transitions[i], sums[t])
        for j in range(n_states):
            if sums[t, j] > SMALLEST_SUM:
                alpha[t, j] = largest + np.log(sums[t, j]) + log_output[j, offset + t]
            else:
                sums[t, j] = 0.0
                alpha[t, j] = _log_sum(alpha[t - 1] + log_transitions[:, j]) + log_output[j, offset + t]


@compiled
def stacked_dense(
    log_output: Floats, offsets: Ints, log_start: Floats, transitions: Floats, log_transitions: Floats,
    log_exit: Floats, gamma: Floats, counts: Floats, starts: Floats, exits: Floats,
) -> Floats:  # fmt: skip
    """As `stacked_banded` for any transition matrix. `counts` has shape (N, N)."""
    n_states = len(log_start)
    longest = np.diff(offsets).max()
    alpha, scaled, sums = np.empty((longest, n_states)), np.empty((longest, n_states)), np.empty((longest, n_states))
    ratios, posterior, previous = np.empty(n_states), np.empty(n_states), np.empty(n_states)
    products = np.zeros((n_states, n_states))
    log_likelihood = np.empty(len(offsets) - 1)
    for s in range(len(offsets) - 1):
        offset, n_frames = offsets[s], offsets[s + 1] - offsets[s]
        _dense_forward(log_output, offset, n_frames, log_start, transitions, log_transitions, alpha, scaled, sums)
        last = n_frames - 1
        value = _last_frame(alpha[last], log_exit, 0, n_states - 1, gamma, offset + last)
        log_likelihood[s] = value
        if value == -np.inf:
            continue
        posterior[:] = gamma[:, offset + last]
        exits += posterior
        for t in range(last, 0, -1):
            previous[:] = 0.0
            for j in range(n_states):
                ratios[j] = 0.0
                if posterior[j] == 0.0:
                    continue
                if sums[t, j] > 0.0:
                    ratios[j] = posterior[j] / sums[t, j]
                    continue
                # What precedes j has underflowed in `scaled`.
                log_sum = alpha[t, j] - log_output[j, offset + t]
                for i in range(n_states):
                    joint = posterior[j] * np.exp(alpha[t - 1, i] + log_transitions[i, j] - log_sum)
                    previous[i] += joint
                    counts[i, j] += joint
            for i in range(n_states):
                if scaled[t - 1, i] > 0.0:
                    previous[i] += scaled[t - 1, i] * dot(transitions[i], ratios)
                    add_multiple(scaled[t - 1, i], ratios, products[i])
                gamma[i, offset + t - 1] = previous[i]
            posterior[:] = previous
        starts += posterior
    counts += products * transitions
    return log_likelihood
