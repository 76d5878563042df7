"""Synthesis of movements from state means and durations (thesis 2.2.4)."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from paramove.hmm.sequences import interpolate

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Timing = Literal["uniform", "expected"]


def expected_durations(durations: Floats) -> Floats:
    """Expected number of frames of each state (2.28). Shape (N,)."""
    result: Floats = durations @ np.arange(1, durations.shape[1] + 1)
    return result


def prototype(means: Floats, durations: Floats, n_samples: int | None, timing: Timing) -> Floats:
    """Method D: the state means in order, linearly interpolated. Shape (n_samples, D).

    timing "uniform" spends the same time between any two means; "expected" puts each mean at the middle of its expected
    duration (2.28). Without n_samples: one sample per expected frame.
    """
    lengths = expected_durations(durations)
    if n_samples is None:
        n_samples = max(2, round(float(lengths.sum())))
    if n_samples < 2:
        raise ValueError(f"a movement has at least 2 samples, found {n_samples}")
    states = np.arange(len(means), dtype=np.float64)
    if timing == "uniform":
        positions = np.linspace(0.0, len(means) - 1.0, n_samples)
    elif timing == "expected":
        centres = np.cumsum(lengths) - 0.5 * lengths
        positions = np.interp(np.linspace(centres[0], centres[-1], n_samples), centres, states)
    else:
        raise ValueError(f"timing is 'uniform' or 'expected', found {timing!r}")
    return interpolate(means, positions)


def drawn_durations(durations: Floats, rng: np.random.Generator) -> Ints:
    """One number of frames per state. Shape (N,)."""
    cumulative = durations.cumsum(axis=1)
    draws = rng.random(len(durations)) * cumulative[:, -1]
    result: Ints = (draws[:, None] >= cumulative).sum(axis=1) + 1
    return result


def sampled(means: Floats, covariances: Floats, durations: Floats, rng: np.random.Generator) -> Floats:
    """Method A: one sequence drawn from the model, every path through all states. Shape (T, D)."""
    states = np.repeat(np.arange(len(means)), drawn_durations(durations, rng))
    factors = np.linalg.cholesky(covariances)
    noise = rng.standard_normal((len(states), means.shape[1]))
    result: Floats = means[states] + np.einsum("tij,tj->ti", factors[states], noise)
    return result


def averaged(
    means: Floats, covariances: Floats, durations: Floats, rng: np.random.Generator, n_sequences: int
) -> Floats:
    """Method B: the mean of many drawn sequences, each stretched to the mean length. Shape (T, D)."""
    drawn = [sampled(means, covariances, durations, rng) for _ in range(n_sequences)]
    length = max(2, round(float(np.mean([len(sequence) for sequence in drawn]))))
    stretched = [interpolate(one, np.linspace(0.0, len(one) - 1.0, length)) for one in drawn]
    result: Floats = np.mean(stretched, axis=0)
    return result


def splined(means: Floats, covariances: Floats, durations: Floats, rng: np.random.Generator) -> Floats:
    """Method C: a cubic spline through one drawn output per state, timed by the drawn durations. Shape (T, D)."""
    lengths = drawn_durations(durations, rng)
    factors = np.linalg.cholesky(covariances)
    controls = means + np.einsum("ijk,ik->ij", factors, rng.standard_normal(means.shape))
    centres = np.cumsum(lengths) - 0.5 * (lengths + 1)
    frames = np.clip(np.arange(int(lengths.sum()), dtype=np.float64), centres[0], centres[-1])
    if len(controls) == 1:
        return np.repeat(controls, len(frames), axis=0)
    result: Floats = CubicSpline(centres, controls)(frames)
    return result


def at_progress(values: Floats, tau: float | Floats) -> Floats:
    """Values per state, linearly interpolated at progress tau in [0, 1] (6.2)-(6.6). Shape tau.shape + D..."""
    clipped = np.asarray(tau, dtype=np.float64)
    if not np.all((clipped >= 0.0) & (clipped <= 1.0)):
        raise ValueError(f"progress lies in [0, 1], found {clipped.min():.3g} to {clipped.max():.3g}")
    position = clipped * (len(values) - 1)
    lower = np.floor(position).astype(np.int64)  # Equation (6.5), counted from 0
    upper = np.ceil(position).astype(np.int64)  # Equation (6.6)
    share = (position - lower).reshape(position.shape + (1,) * (values.ndim - 1))  # Equation (6.4)
    result: Floats = (1.0 - share) * values[lower] + share * values[upper]
    return result
