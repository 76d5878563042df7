"""The hidden Markov models of `benchmarks/models.py` in other libraries; paramove itself never imports them."""

import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

SELF_TRANSITION = 0.8


class NotInstalledError(ImportError):
    """A peer is missing."""


def library(module: str) -> ModuleType:
    """A module of a peer. Raises NotInstalledError."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise NotInstalledError("not installed") from error


def transitions(n_states: int, d_min: int, d_max: int) -> np.ndarray:
    """Expanded left-right chain (thesis 2.2.3.2); d_max = 1 gives a plain chain with self-transitions."""
    if d_max == 1:
        matrix = SELF_TRANSITION * np.eye(n_states) + (1.0 - SELF_TRANSITION) * np.eye(n_states, k=1)
        matrix[-1, -1] = 1.0
        return matrix
    matrix = np.zeros((n_states * d_max,) * 2)
    for row in range(len(matrix)):
        state, sub = divmod(row, d_max)
        leave = 0.0 if sub + 1 < d_min else 1.0 if sub + 1 == d_max else 0.5
        exit_to = min((state + 1) * d_max, len(matrix) - 1)
        matrix[row, exit_to] += leave
        matrix[row, min(row + 1, len(matrix) - 1)] += 1.0 - leave
    return matrix


def hmmlearn_model(
    means: np.ndarray, covariances: np.ndarray, d_min: int, d_max: int, implementation: str, iterations: int
) -> Any:
    """hmmlearn's model with the given start.

    Of the expanded form only the transitions are trained: it cannot tie sub-states, and those that no path uses would
    lose their means. So its time is a lower bound.
    """
    model = library("hmmlearn.hmm").GaussianHMM(
        len(means) * d_max, "full", init_params="", params="tmc" if d_max == 1 else "t", n_iter=iterations, tol=-np.inf,
        implementation=implementation,
    )  # fmt: skip
    model.transmat_ = transitions(len(means), d_min, d_max)
    model.startprob_ = np.eye(len(model.transmat_))[0]
    model.means_ = np.repeat(means, d_max, axis=0)
    model.covars_ = np.repeat(covariances, d_max, axis=0)
    return model


def hmmlearn_training(
    sequences: list[np.ndarray], means: np.ndarray, covariances: np.ndarray, d_min: int, d_max: int,
    implementation: str, iterations: int,
) -> Callable[[], object]:  # fmt: skip
    """Training by hmmlearn."""
    stacked, lengths = np.concatenate(sequences), [len(sequence) for sequence in sequences]
    return lambda: hmmlearn_model(means, covariances, d_min, d_max, implementation, iterations).fit(stacked, lengths)


def dynamax_training(
    sequences: list[np.ndarray], means: np.ndarray, covariances: np.ndarray, d_min: int, d_max: int, bits: int,
    iterations: int,
) -> Callable[[], object]:  # fmt: skip
    """Training by dynamax, compiled in the first call. It takes sequences of one length alone."""
    compiled: list[Callable[[], object]] = []

    def run() -> object:
        if not compiled:
            compiled.append(
                _dynamax(sequences, means, covariances, transitions(len(means), d_min, d_max), bits, iterations)
            )
        return compiled[0]()

    return run


def _dynamax(
    sequences: list[np.ndarray], means: np.ndarray, covariances: np.ndarray, matrix: np.ndarray, bits: int,
    iterations: int,
) -> Callable[[], object]:  # fmt: skip
    jax = library("jax")
    hidden_markov_model = library("dynamax.hidden_markov_model")
    repeats = len(matrix) // len(means)
    with jax.enable_x64(bits == 64):
        kind = np.float64 if bits == 64 else np.float32
        number = len(matrix)
        model = hidden_markov_model.GaussianHMM(number, means.shape[1], transition_matrix_concentration=1.0001)
        params, props = model.initialize(
            jax.random.PRNGKey(0),
            initial_probs=jax.numpy.asarray(np.eye(number)[0], kind),
            transition_matrix=jax.numpy.asarray(matrix, kind),
            emission_means=jax.numpy.asarray(np.repeat(means, repeats, axis=0), kind),
            emission_covariances=jax.numpy.asarray(np.repeat(covariances, repeats, axis=0), kind),
        )
        emissions = jax.numpy.asarray(np.stack(sequences), kind)
        train = jax.jit(lambda begin, x: model.fit_em(begin, props, x, num_iters=iterations, verbose=False))

    def run() -> object:
        with jax.enable_x64(bits == 64):
            return jax.block_until_ready(train(params, emissions))

    return run
