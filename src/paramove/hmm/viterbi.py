"""The likeliest path of states through a chain (Viterbi)."""

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm.compilation import compiled


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
