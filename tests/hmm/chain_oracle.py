"""Baum-Welch of a plain chain in numpy, every quantity a logarithm, written as the thesis writes it (2.7)-(2.24).

A finish state is state N + 1 with its dummy sample (2.2.3.1). Sub-states that share one Gaussian are given by `shared`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from paramove.documents.array_types import Floats, Ints


@dataclass
class Chain:
    """Start (n,), transitions with the finish state as last column (n, n + 1), outputs (N, D), (N, D, D)."""

    start: Floats
    transitions: Floats
    means: Floats
    covariances: Floats
    shared: Ints


def forward_backward(chain: Chain, sequence: Floats, finish: bool) -> tuple[float, Floats, Floats, Floats]:
    """Log-likelihood, gamma (T, n), summed xi (n, n), gamma of the last frame (n,)."""
    n_states = len(chain.start)
    outputs = np.array(
        [
            multivariate_normal(mean, covariance, allow_singular=False).logpdf(sequence)
            for mean, covariance in zip(chain.means, chain.covariances, strict=True)
        ]
    ).reshape(len(chain.means), len(sequence))
    log_b = outputs[chain.shared].T
    with np.errstate(divide="ignore"):
        log_a, log_start = np.log(chain.transitions), np.log(chain.start)
    inner, leave = log_a[:, :n_states], log_a[:, n_states] if finish else np.zeros(n_states)
    alpha, beta = np.empty_like(log_b), np.empty_like(log_b)
    alpha[0], beta[-1] = log_start + log_b[0], leave
    for t in range(1, len(sequence)):
        alpha[t] = logsumexp(alpha[t - 1][:, None] + inner, axis=0) + log_b[t]
    for t in range(len(sequence) - 2, -1, -1):
        beta[t] = logsumexp(inner + (log_b[t + 1] + beta[t + 1])[None, :], axis=1)
    value = float(logsumexp(alpha[-1] + beta[-1]))
    gamma = np.exp(alpha + beta - value)
    xi = np.zeros((n_states, n_states))
    for t in range(len(sequence) - 1):
        xi += np.exp(alpha[t][:, None] + inner + (log_b[t + 1] + beta[t + 1])[None, :] - value)
    return value, gamma, xi, gamma[-1]


def trained(chain: Chain, sequences: list[Floats], iterations: int, finish: bool) -> tuple[Chain, list[float]]:
    """Plain maximum likelihood; shared outputs are pooled. The history has the value before each M-step."""
    history = []
    for _ in range(iterations):
        found = [forward_backward(chain, sequence, finish) for sequence in sequences]
        history.append(sum(one[0] for one in found))
        counts = np.column_stack(
            [sum(one[2] for one in found), sum(one[3] for one in found) * (1.0 if finish else 0.0)]
        )
        total = counts.sum(axis=1, keepdims=True)
        transitions = np.where(total > 0, counts / np.where(total > 0, total, 1.0), chain.transitions)
        start = sum(one[1][0] for one in found)
        n_shared = len(chain.means)
        pooling = np.eye(n_shared)[chain.shared]
        gamma = np.concatenate([one[1] for one in found]) @ pooling
        frames = np.concatenate(sequences)
        means = gamma.T @ frames / gamma.sum(axis=0)[:, None]
        covariances = np.array(
            [((frames - m).T * gamma[:, i]) @ (frames - m) / gamma[:, i].sum() for i, m in enumerate(means)]
        )
        chain = Chain(start / start.sum(), transitions, means, covariances, chain.shared)
    return chain, history
