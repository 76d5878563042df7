"""Synthesis of movements from state means and durations (thesis 2.2.4)."""

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm.sequences import interpolate

Timing = Literal["uniform", "expected"]
Path = Literal["linear", "smooth"]
LONGEST_PATH = 1_000_000


def minimum_jerk(progress: Floats, start: float, end: float) -> Floats:
    """0 before start, 1 after end, smooth as a human reach in between (Flash and Hogan 1985)."""
    x = np.clip((progress - start) / (end - start), 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def expected_durations(durations: Floats) -> Floats:
    """Expected number of frames of each state (2.28). Shape (N,)."""
    return durations @ np.arange(1, durations.shape[1] + 1)


def prototype(means: Floats, lengths: Floats, n_samples: int | None, timing: Timing, path: Path = "linear") -> Floats:
    """Method D: the state means in order. Shape (n_samples, D).

    Args:
        means: shape (N, D). lengths: expected number of frames of each state (2.28), (N,).
        n_samples: without it one sample per expected frame.
        timing: "uniform" spends the same time in each state, "expected" its expected duration.
        path: "linear" interpolates between the means, from the first to the last (thesis). "smooth" gives the curve
            whose mean over the time of each state is the state's mean: means are averages over a state's frames, so
            straight lines between them cut every corner and end before the movement does.
    """
    if n_samples is None:
        n_samples = max(2, round(float(lengths.sum())))
    if n_samples < 2:
        raise ValueError(f"a movement has at least 2 samples, found {n_samples}")
    if timing not in get_args(Timing) or path not in get_args(Path):
        raise ValueError(f"timing is 'uniform' or 'expected' and path 'linear' or 'smooth', found {timing!r}, {path!r}")
    dwell = lengths if timing == "expected" else np.ones(len(means))
    if path == "smooth" and len(means) > 1:
        return _smooth(means, dwell, n_samples)
    centres = np.cumsum(dwell) - 0.5 * dwell
    times = np.linspace(centres[0], centres[-1], n_samples)
    return interpolate(means, np.interp(times, centres, np.arange(len(means), dtype=np.float64)))


def _smooth(means: Floats, dwell: Floats, n_samples: int) -> Floats:
    """Derivative of a cubic spline through the cumulated means: its mean over each state's time is the state's."""
    from scipy.interpolate import CubicSpline

    borders = np.concatenate([[0.0], np.cumsum(dwell)])
    cumulated = np.concatenate([np.zeros((1, means.shape[1])), np.cumsum(means * dwell[:, None], axis=0)])
    result: Floats = CubicSpline(borders, cumulated)(np.linspace(0.0, borders[-1], n_samples), 1)
    return result


def drawn_durations(durations: Floats, rng: np.random.Generator) -> Ints:
    """One number of frames per state. Shape (N,)."""
    cumulative = durations.cumsum(axis=1)
    draws = rng.random(len(durations)) * cumulative[:, -1]
    result: Ints = (draws[:, None] >= cumulative).sum(axis=1) + 1
    return result


def drawn_path(
    start: Floats, transitions: Floats, exits: Floats, n_frames: int | None, rng: np.random.Generator
) -> Ints:
    """States of a chain, to the finish state or for a number of frames. Shape (T,)."""
    states = [_drawn(start, rng)]
    while len(states) < (LONGEST_PATH if n_frames is None else n_frames):
        step = _drawn(np.append(transitions[states[-1]], exits[states[-1]] if n_frames is None else 0.0), rng)
        if step == len(start):
            return np.array(states, dtype=np.int64)
        states.append(step)
    if n_frames is None:
        raise ValueError(f"a drawn path did not reach the finish state in {LONGEST_PATH} frames; give n_frames")
    return np.array(states, dtype=np.int64)


def _drawn(probabilities: Floats, rng: np.random.Generator) -> int:
    cumulative = probabilities.cumsum()
    return int((rng.random() * cumulative[-1] >= cumulative).sum())


def emitted(states: Ints, means: Floats, covariances: Floats, rng: np.random.Generator) -> Floats:
    """Method A: an output drawn for each state of a path. Shape (T, D)."""
    factors = np.linalg.cholesky(covariances)
    noise = rng.standard_normal((len(states), means.shape[1]))
    result: Floats = means[states] + np.einsum("tij,tj->ti", factors[states], noise)
    return result


def averaged(drawn: Sequence[Floats]) -> Floats:
    """Method B: the mean of drawn sequences, each stretched to the mean length. Shape (T, D)."""
    length = max(2, round(float(np.mean([len(sequence) for sequence in drawn]))))
    stretched = [interpolate(one, np.linspace(0.0, len(one) - 1.0, length)) for one in drawn]
    result: Floats = np.mean(stretched, axis=0)
    return result


def splined(states: Ints, means: Floats, covariances: Floats, rng: np.random.Generator) -> Floats:
    """Method C: a cubic spline through one drawn output per stay in a state, at its middle. Shape (T, D)."""
    from scipy.interpolate import CubicSpline  # half a second, which only this method should cost

    borders = np.flatnonzero(np.diff(states)) + 1
    begins, ends = np.append(0, borders), np.append(borders, len(states))
    controls = emitted(states[begins], means, covariances, rng)
    centres = 0.5 * (begins + ends - 1)
    frames = np.clip(np.arange(len(states), dtype=np.float64), centres[0], centres[-1])
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
    fraction = (position - lower).reshape(position.shape + (1,) * (values.ndim - 1))  # Equation (6.4)
    return (1.0 - fraction) * values[lower] + fraction * values[upper]
