"""Compiled recursions of the left-right HMM with explicit durations, in the log domain.

The model of thesis 2.2.3.2 (N no-skip states, each replaced by d_max tied sub-states, and a finish state) is a
left-right chain with a free duration distribution p_i(d), d = d_min..d_max (corrected form: same likelihood, fewer
terms). Every sum runs over segments (state i, start, d). Only those (frame, state) pairs are visited that d_min, d_max
and T leave feasible.

Index convention: `ending[i, t]` belongs to "i states are complete and t frames are used", so `ending[0, 0] = 0`.
"""

import numpy as np
from numpy.typing import NDArray

from paramove.hmm.compilation import compiled, compiled_arithmetic
from paramove.hmm.gaussians import add_moments, log_outputs, stacked_log_outputs, stacked_moments

__all__ = [
    "add_moments",
    "backward",
    "best_segmentation",
    "feasible_ends",
    "forward",
    "log_outputs",
    "posteriors",
    "segment_windows",
    "stacked_log_outputs",
    "stacked_moments",
    "stacked_segments",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

UNDERFLOW = -230.0  # of a share that is lost without trace: 1e-100


@compiled
def feasible_ends(n_states: int, d_min: int, d_max: int, n_frames: int) -> Ints:
    """First and last feasible number of used frames after i complete states. Shape (N + 1, 2)."""
    ends = np.empty((n_states + 1, 2), np.int64)
    for i in range(n_states + 1):
        left = n_states - i
        ends[i, 0] = max(i * d_min, n_frames - left * d_max)
        ends[i, 1] = min(i * d_max, n_frames - left * d_min)
    return ends


@compiled
def forward(log_output: Floats, log_duration: Floats, d_min: int, ends: Ints) -> Floats:
    """Log probability of the first t frames with i states complete (2.7, segment form). Shape (N + 1, T + 1)."""
    n_frames, n_states = log_output.shape
    d_max = log_duration.shape[1]
    ending = np.full((n_states + 1, n_frames + 1), -np.inf)
    ending[0, 0] = 0.0
    terms = np.empty(d_max)
    for i in range(n_states):
        for t in range(ends[i + 1, 0], ends[i + 1, 1] + 1):
            largest, outputs = -np.inf, 0.0
            for d in range(1, min(d_max, t) + 1):
                outputs += log_output[t - d, i]
                terms[d - 1] = -np.inf
                if d >= d_min:
                    terms[d - 1] = ending[i, t - d] + log_duration[i, d - 1] + outputs
                largest = max(largest, terms[d - 1])
            if largest > -np.inf:
                total = 0.0
                for d in range(d_min, min(d_max, t) + 1):
                    total += np.exp(terms[d - 1] - largest)
                ending[i + 1, t] = largest + np.log(total)
    return ending


@compiled
def backward(log_output: Floats, log_duration: Floats, d_min: int, ends: Ints) -> Floats:
    """Log probability of the frames after t, given that i states were complete at t (2.10). Shape (N + 1, T + 1)."""
    n_frames, n_states = log_output.shape
    d_max = log_duration.shape[1]
    following = np.full((n_states + 1, n_frames + 1), -np.inf)
    following[n_states, n_frames] = 0.0
    terms = np.empty(d_max)
    for i in range(n_states - 1, -1, -1):
        for t in range(ends[i, 0], ends[i, 1] + 1):
            largest, outputs = -np.inf, 0.0
            longest = min(d_max, n_frames - t)
            for d in range(1, longest + 1):
                outputs += log_output[t + d - 1, i]
                terms[d - 1] = -np.inf
                if d >= d_min:
                    terms[d - 1] = following[i + 1, t + d] + log_duration[i, d - 1] + outputs
                largest = max(largest, terms[d - 1])
            if largest > -np.inf:
                total = 0.0
                for d in range(d_min, longest + 1):
                    total += np.exp(terms[d - 1] - largest)
                following[i, t] = largest + np.log(total)
    return following


@compiled
def posteriors(
    log_output: Floats, log_duration: Floats, d_min: int, ends: Ints, ending: Floats, following: Floats
) -> tuple[Floats, Floats]:
    """Responsibilities gamma_i(t), shape (T, N) (2.14), and the expected count of each duration, shape (N, d_max)."""
    n_frames, n_states = log_output.shape
    d_max = log_duration.shape[1]
    gamma = np.zeros((n_frames, n_states))
    counts = np.zeros((n_states, d_max))
    log_likelihood = ending[n_states, n_frames]
    for i in range(n_states):
        for t in range(ends[i + 1, 0], ends[i + 1, 1] + 1):
            outputs = 0.0
            for d in range(1, min(d_max, t) + 1):
                outputs += log_output[t - d, i]
                if d < d_min:
                    continue
                exponent = ending[i, t - d] + log_duration[i, d - 1] + outputs + following[i + 1, t] - log_likelihood
                if exponent < -700.0:
                    continue
                share = np.exp(exponent)
                counts[i, d - 1] += share
                for s in range(t - d, t):
                    gamma[s, i] += share
    return gamma, counts


@compiled
def best_segmentation(log_output: Floats, log_duration: Floats, d_min: int, ends: Ints) -> tuple[float, Ints]:
    """Log probability of the best segmentation and the number of frames used after each state, shape (N + 1,)."""
    n_frames, n_states = log_output.shape
    d_max = log_duration.shape[1]
    best = np.full((n_states + 1, n_frames + 1), -np.inf)
    choice = np.zeros((n_states + 1, n_frames + 1), np.int64)
    best[0, 0] = 0.0
    for i in range(n_states):
        for t in range(ends[i + 1, 0], ends[i + 1, 1] + 1):
            outputs = 0.0
            for d in range(1, min(d_max, t) + 1):
                outputs += log_output[t - d, i]
                if d < d_min:
                    continue
                value = best[i, t - d] + log_duration[i, d - 1] + outputs
                if value > best[i + 1, t]:
                    best[i + 1, t] = value
                    choice[i + 1, t] = d
    borders = np.empty(n_states + 1, np.int64)
    borders[n_states] = n_frames
    for i in range(n_states, 0, -1):
        borders[i - 1] = borders[i] - choice[i, borders[i]]
    return float(best[n_states, n_frames]), borders


@compiled_arithmetic
def _forward_shares(
    log_output: Floats, offset: int, log_duration: Floats, d_min: int, ends: Ints, ending: Floats, shares: Floats
) -> None:
    """As `forward`, and the probability of each last duration given that i states end at t, in `shares[i, t, d - 1]`.

    Entries outside the feasible ends are neither read nor written.
    """
    n_states, d_max = log_duration.shape
    ending[0, 0] = 0.0
    for i in range(n_states):
        for t in range(ends[i + 1, 0], ends[i + 1, 1] + 1):
            shortest, longest = max(d_min, t - ends[i, 1]), min(d_max, t - ends[i, 0])
            largest, likeliest, outputs = -np.inf, 0, 0.0
            for d in range(1, longest + 1):
                outputs += log_output[i, offset + t - d]
                if d >= shortest:
                    term = ending[i, t - d] + log_duration[i, d - 1] + outputs
                    shares[i, t, d - 1] = term
                    if term > largest:
                        largest, likeliest = term, d
            if largest == -np.inf:
                ending[i + 1, t] = -np.inf
                shares[i, t, :] = 0.0
                continue
            total = 1.0
            for d in range(shortest, longest + 1):
                if d != likeliest:
                    difference = shares[i, t, d - 1] - largest
                    shares[i, t, d - 1] = np.exp(difference) if difference > UNDERFLOW else 0.0
                    total += shares[i, t, d - 1]
            shares[i, t, likeliest - 1] = 1.0
            ending[i + 1, t] = largest + np.log(total)
            for d in range(shortest, longest + 1):
                shares[i, t, d - 1] /= total


@compiled
def _smooth(
    offset: int, d_min: int, ends: Ints, shares: Floats, complete: Floats, gamma: Floats, counts: Floats
) -> None:
    """Posterior of all segments from the last frame backwards: p(i ends at t | X) times the shares of its durations.

    The same as alpha beta / p(X) (2.14), for what follows t does not depend on what was before, and without any
    exponential function.
    """
    n_states, d_max = counts.shape
    complete[n_states, ends[n_states, 0]] = 1.0
    for i in range(n_states - 1, -1, -1):
        complete[i, ends[i, 0] : ends[i, 1] + 1] = 0.0
        gamma[i, offset + ends[i, 0] : offset + ends[i + 1, 1]] = 0.0
        for t in range(ends[i + 1, 0], ends[i + 1, 1] + 1):
            posterior = complete[i + 1, t]
            if posterior == 0.0:
                continue
            shortest, longest = max(d_min, t - ends[i, 1]), min(d_max, t - ends[i, 0])
            running = 0.0
            for d in range(longest, 0, -1):
                if d >= shortest:
                    share = posterior * shares[i, t, d - 1]
                    complete[i, t - d] += share
                    counts[i, d - 1] += share
                    running += share
                gamma[i, offset + t - d] += running


@compiled
def stacked_segments(
    log_output: Floats, offsets: Ints, log_duration: Floats, d_min: int, gamma: Floats, counts: Floats
) -> Floats:
    """E-step over many sequences: log-likelihood of each, shape (K,); -inf where a sequence is impossible.

    Args:
        log_output: ln b_i of all frames of all sequences, shape (N, frames).
        offsets: first frame of each sequence, then the number of frames, shape (K + 1,).
        gamma: responsibilities, written within the feasible windows, shape (N, frames).
        counts: expected counts of durations, added to, shape (N, d_max).
    """
    n_states, d_max = log_duration.shape
    longest = np.diff(offsets).max()
    ending, complete = np.empty((n_states + 1, longest + 1)), np.empty((n_states + 1, longest + 1))
    shares = np.empty((n_states, longest + 1, d_max))
    log_likelihood = np.empty(len(offsets) - 1)
    for s in range(len(offsets) - 1):
        n_frames = offsets[s + 1] - offsets[s]
        ends = feasible_ends(n_states, d_min, d_max, n_frames)
        _forward_shares(log_output, offsets[s], log_duration, d_min, ends, ending, shares)
        log_likelihood[s] = ending[n_states, n_frames]
        if log_likelihood[s] > -np.inf:
            _smooth(offsets[s], d_min, ends, shares, complete, gamma, counts)
    return log_likelihood


@compiled
def segment_windows(offsets: Ints, n_states: int, d_min: int, d_max: int) -> Ints:
    """First frame that state i can have in each sequence, and the one after the last. Shape (K, N, 2)."""
    windows = np.empty((len(offsets) - 1, n_states, 2), np.int64)
    for s in range(len(offsets) - 1):
        ends = feasible_ends(n_states, d_min, d_max, offsets[s + 1] - offsets[s])
        windows[s, :, 0] = offsets[s] + ends[:-1, 0]
        windows[s, :, 1] = offsets[s] + ends[1:, 1]
    return windows
