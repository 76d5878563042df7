"""Compiled recursions of the left-right HMM with explicit durations, in the log domain.

The model of thesis 2.2.3.2 (N no-skip states, each replaced by d_max tied sub-states, and a finish state) is a
left-right chain with a free duration distribution p_i(d), d = d_min..d_max (corrected form: same likelihood, fewer
terms). Every sum runs over segments (state i, start, d). Only those (frame, state) pairs are visited that d_min, d_max
and T leave feasible.

Index convention: `ending[i, t]` belongs to "i states are complete and t frames are used", so `ending[0, 0] = 0`.
"""

import numpy as np
from numpy.typing import NDArray

from paramove.hmm.compilation import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


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
def log_outputs(sequence: Floats, means: Floats, whitening: Floats, log_norm: Floats, ends: Ints) -> Floats:
    """ln b_i(x_t) of the feasible pairs, -inf elsewhere. `whitening` is the inverse Cholesky factor. Shape (T, N)."""
    n_frames, dim = sequence.shape
    n_states = means.shape[0]
    out = np.full((n_frames, n_states), -np.inf)
    difference = np.empty(dim)
    for i in range(n_states):
        for t in range(ends[i, 0], ends[i + 1, 1]):
            for k in range(dim):
                difference[k] = sequence[t, k] - means[i, k]
            squared = 0.0
            for row in range(dim):
                value = 0.0
                for k in range(row + 1):
                    value += whitening[i, row, k] * difference[k]
                squared += value * value
            out[t, i] = log_norm[i] - 0.5 * squared
    return out


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


@compiled
def add_moments(
    sequence: Floats, gamma: Floats, ends: Ints, reference: Floats, weight: Floats, first: Floats, second: Floats
) -> None:
    """Add sum gamma, sum gamma (x - ref) and sum gamma (x - ref)(x - ref)^T of one sequence, in place.

    Moments about a reference near the data keep their precision where moments about zero would cancel.
    """
    dim = sequence.shape[1]
    difference = np.empty(dim)
    for i in range(reference.shape[0]):
        for t in range(ends[i, 0], ends[i + 1, 1]):
            share = gamma[t, i]
            if share < 1e-14:
                continue
            weight[i] += share
            for k in range(dim):
                difference[k] = sequence[t, k] - reference[i, k]
                first[i, k] += share * difference[k]
            for row in range(dim):
                scaled = share * difference[row]
                for k in range(row + 1):
                    second[i, row, k] += scaled * difference[k]
