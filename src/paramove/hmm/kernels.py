"""Compiled recursions of the left-right HMM with explicit durations, in the log domain.

The model of thesis 2.2.3.2 (N no-skip states, each replaced by d_max tied sub-states, and a finish state) is a
left-right chain with a free duration distribution p_i(d), d = d_min..d_max (corrected form: same likelihood, fewer
terms). Every sum runs over segments (state i, start, d). Only those (frame, state) pairs are visited that d_min, d_max
and T leave feasible.

Index convention: `ending[i, t]` belongs to "i states are complete and t frames are used", so `ending[0, 0] = 0`.
"""

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm.compilation import compiled, compiled_arithmetic, compiled_sums
from paramove.hmm.gaussians import add_moments, stacked_log_outputs, stacked_moments
from paramove.hmm.vector_functions import exp_of_negative, log_of_positive

__all__ = [
    "add_moments",
    "best_segmentation",
    "feasible_ends",
    "filled",
    "segment_windows",
    "segments_log_likelihood",
    "stacked_log_outputs",
    "stacked_moments",
    "stacked_segments",
]


LANES = 8
"""Numbers in a vector register: rows are padded to a multiple of it."""


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
def best_segmentation(log_output: Floats, log_duration: Floats, d_min: int, ends: Ints) -> tuple[float, Ints]:
    """Log probability of the best segmentation and the number of frames used after each state, shape (N + 1,).

    `log_output` holds ln b_i(x_t), shape (N, T).
    """
    n_states, n_frames = log_output.shape
    d_max = log_duration.shape[1]
    best = np.full((n_states + 1, n_frames + 1), -np.inf)
    choice = np.zeros((n_states + 1, n_frames + 1), np.int64)
    best[0, 0] = 0.0
    for i in range(n_states):
        for t in range(ends[i + 1, 0], ends[i + 1, 1] + 1):
            outputs = 0.0
            for d in range(1, min(d_max, t) + 1):
                outputs += log_output[i, t - d]
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
def _feasible_range(begins: Ints, d: int, low: int, n: int) -> tuple[int, int]:
    """Of n ends from `low` on, the first whose segment of d frames has a feasible begin, and the one after the last."""
    begin = min(n, max(0, begins[0] + d - low))
    return begin, max(begin, min(n, begins[1] + d - low + 1))


@compiled_arithmetic
def _compared(
    before: Floats, log_duration: float, sums: Floats, sums_before: Floats, terms: Floats, largest: Floats
) -> None:
    """Terms of one duration, and the largest of all durations so far."""
    for j in range(len(terms)):
        terms[j] = before[j] + log_duration + (sums[j] - sums_before[j])
        largest[j] = max(largest[j], terms[j])


@compiled_arithmetic
def _without_largest(terms: Floats, largest: Floats, result: Floats) -> None:
    for j in range(len(largest)):
        result[j] = terms[j] - largest[j] if largest[j] > -np.inf else -np.inf


@compiled_arithmetic
def _add(source: Floats, target: Floats) -> None:
    for j in range(len(target)):
        target[j] += source[j]


@compiled_arithmetic
def _scale(factors: Floats, target: Floats) -> None:
    for j in range(len(factors)):
        target[j] *= factors[j]


@compiled_arithmetic
def _forward(
    log_output: Floats, offset: int, log_duration: Floats, d_min: int, ends: Ints, ending: Floats, fractions: Floats
) -> float:
    """Log probability of the frames, and the terms for smoothing. Each step is done for all ends of a state at once.

    ending[i, t]: log probability of the first t frames with i states complete (2.7, segment form); (N + 1, T + 1).
    fractions[i, (d - d_min) whole + t - ends[i + 1, 0]]: probability that state i, which ends there, has d frames,
    where `whole` is `filled` of the number of ends.
    Entries outside the feasible ends are neither read nor written.
    """
    n_states, d_max = log_duration.shape
    room = fractions.shape[1]
    largest, total, logarithm, sums = np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    differences, bits = np.empty(room), np.empty(room, np.int64)
    ending[0, 0] = 0.0
    for i in range(n_states):
        early, low, n = ends[i, 0], ends[i + 1, 0], ends[i + 1, 1] - ends[i + 1, 0] + 1
        whole = filled(n)
        count = (d_max - d_min + 1) * whole
        sums[0] = 0.0
        for t in range(ends[i + 1, 1] - early):
            sums[t + 1] = sums[t] + log_output[i, offset + early + t]
        largest[:whole], total[:whole] = -np.inf, 0.0
        terms = fractions[i]
        terms[:count] = -np.inf
        for d in range(d_min, d_max + 1):
            begin, end = _feasible_range(ends[i], d, low, n)
            k, first = (d - d_min) * whole, low + begin
            _compared(
                ending[i, first - d :], log_duration[i, d - 1], sums[first - early :], sums[first - early - d :],
                terms[k + begin : k + end], largest[begin:end],
            )  # fmt: skip
        for k in range(0, count, whole):
            _without_largest(terms[k:], largest[:whole], differences[k:])
        exp_of_negative(differences, count, bits, terms)
        for k in range(0, count, whole):
            _add(terms[k:], total[:whole])
        for j in range(whole):
            total[j] = total[j] if total[j] > 0.0 else 1.0
        log_of_positive(total, whole, bits, logarithm)
        _add(largest, logarithm[:whole])
        ending[i + 1, low : low + n] = logarithm[:n]
        for j in range(whole):
            total[j] = 1.0 / total[j]
        for k in range(0, count, whole):
            _scale(total[:whole], terms[k:])
    return float(ending[n_states, ends[n_states, 1]])


@compiled
def filled(n: int) -> int:
    """The next multiple of `LANES`."""
    return (n + LANES - 1) // LANES * LANES


@compiled_sums
def _distributed(posterior: Floats, fractions: Floats, complete: Floats, running: Floats) -> float:
    """Posteriors of the segments of one duration, added to those of their begins, and their sum."""
    total = 0.0
    for j in range(len(fractions)):
        joint = posterior[j] * fractions[j]
        complete[j] += joint
        running[j] += joint
        total += joint
    return total


@compiled
def _smooth(
    offset: int, d_min: int, ends: Ints, fractions: Floats, complete: Floats, running: Floats, gamma: Floats,
    counts: Floats,
) -> None:  # fmt: skip
    """Posterior of all segments from the last frame backwards: p(i ends at t | X) times the fractions of its durations.

    The same as alpha beta / p(X) (2.14), for what follows t does not depend on what was before, and without any
    exponential function.
    """
    n_states, d_max = counts.shape
    complete[n_states, ends[n_states, 0]] = 1.0
    for i in range(n_states - 1, -1, -1):
        complete[i, ends[i, 0] : ends[i, 1] + 1] = 0.0
        gamma[i, offset + ends[i, 0] : offset + ends[i + 1, 1]] = 0.0
        low, n = ends[i + 1, 0], ends[i + 1, 1] - ends[i + 1, 0] + 1
        whole = filled(n)
        running[:n] = 0.0
        for d in range(d_max, 0, -1):
            begin, end = _feasible_range(ends[i], d, low, n)
            first = low + begin
            if d >= d_min:
                k = (d - d_min) * whole
                counts[i, d - 1] += _distributed(
                    complete[i + 1, first:],
                    fractions[i, k + begin : k + end],
                    complete[i, first - d :],
                    running[begin:],
                )
            # Frame t - d is of this state wherever a segment of d frames or more ends at t.
            _add(running[begin:], gamma[i, offset + first - d : offset + low + n - d])


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
    room = np.diff(offsets).max() + 1
    ending, complete = np.empty((n_states + 1, room)), np.empty((n_states + 1, room))
    fractions, running = np.empty((n_states, (d_max - d_min + 1) * filled(room))), np.empty(room)
    log_likelihood = np.empty(len(offsets) - 1)
    for s in range(len(offsets) - 1):
        log_likelihood[s] = -np.inf
        ends = feasible_ends(n_states, d_min, d_max, offsets[s + 1] - offsets[s])
        if ends[n_states, 0] > ends[n_states, 1]:
            continue
        log_likelihood[s] = _forward(log_output, offsets[s], log_duration, d_min, ends, ending, fractions)
        if log_likelihood[s] > -np.inf:
            _smooth(offsets[s], d_min, ends, fractions, complete, running, gamma, counts)
    return log_likelihood


@compiled
def segments_log_likelihood(log_output: Floats, log_duration: Floats, d_min: int) -> float:
    """ln p(X | lambda) of one sequence from ln b_i(x_t), shape (N, T)."""
    (n_states, n_frames), d_max = log_output.shape, log_duration.shape[1]
    ends = feasible_ends(n_states, d_min, d_max, n_frames)
    if ends[n_states, 0] > ends[n_states, 1]:
        return -np.inf
    ending = np.empty((n_states + 1, n_frames + 1))
    fractions = np.empty((n_states, (d_max - d_min + 1) * filled(n_frames + 1)))
    return _forward(log_output, 0, log_duration, d_min, ends, ending, fractions)


@compiled
def segment_windows(offsets: Ints, n_states: int, d_min: int, d_max: int) -> Ints:
    """First frame that state i can have in each sequence, and the one after the last. Shape (K, N, 2)."""
    windows = np.empty((len(offsets) - 1, n_states, 2), np.int64)
    for s in range(len(offsets) - 1):
        ends = feasible_ends(n_states, d_min, d_max, offsets[s + 1] - offsets[s])
        windows[s, :, 0] = offsets[s] + ends[:-1, 0]
        windows[s, :, 1] = offsets[s] + ends[1:, 1]
    return windows
