"""The thesis's own form of the model, as an oracle: every state replaced by d_max sub-states (2.2.3.2), plain numpy."""

import numpy as np
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from paramove.documents.array_types import Floats


def expanded_transitions(durations: Floats) -> Floats:
    """Transition matrix of the N * R sub-states and the finish state. Shape (N R + 1, N R + 1)."""
    n_states, longest = durations.shape
    matrix = np.zeros((n_states * longest + 1,) * 2)
    for i in range(n_states):
        for r in range(longest):
            here = i * longest + r
            survival = durations[i, r:].sum()
            leave = durations[i, r] / survival if survival > 0 else 1.0
            matrix[here, (i + 1) * longest] = leave
            if r + 1 < longest:
                matrix[here, here + 1] += 1.0 - leave
    matrix[-1, -1] = 1.0
    return matrix


def expanded_forward_backward(
    sequence: Floats, means: Floats, covariances: Floats, durations: Floats
) -> tuple[float, Floats]:
    """Log-likelihood with the finish state, and responsibilities summed over sub-states, shape (T, N)."""
    n_states, longest = durations.shape
    n_frames, n_sub = len(sequence), n_states * longest
    with np.errstate(divide="ignore"):
        log_a = np.log(expanded_transitions(durations))
    log_b = np.column_stack(
        [multivariate_normal(means[i // longest], covariances[i // longest]).logpdf(sequence) for i in range(n_sub)]
    ).reshape(n_frames, n_sub)
    alpha = np.full((n_frames, n_sub), -np.inf)
    alpha[0, 0] = log_b[0, 0]  # pi = (1, 0, ..., 0)
    for t in range(1, n_frames):
        alpha[t] = logsumexp(alpha[t - 1][:, None] + log_a[:-1, :-1], axis=0) + log_b[t]
    beta = np.full((n_frames, n_sub), -np.inf)
    beta[-1] = log_a[:-1, -1]
    for t in range(n_frames - 2, -1, -1):
        beta[t] = logsumexp(log_a[:-1, :-1] + (log_b[t + 1] + beta[t + 1])[None, :], axis=1)
    log_likelihood = float(logsumexp(alpha[-1] + beta[-1]))
    gamma = np.exp(alpha + beta - log_likelihood)
    return log_likelihood, gamma.reshape(n_frames, n_states, longest).sum(axis=2)
