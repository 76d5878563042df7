"""Checks and resampling of sequences."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints

CACHED_VALUES = 1 << 16
LARGEST = 1e100
MIN_RANGE = 1e-100


class NotFittedError(RuntimeError, ValueError, AttributeError):
    """A model is used before it was trained."""

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        """A worker of joblib raises it in its own process."""
        return not_fitted, (str(self),)


def not_fitted(message: str) -> NotFittedError:
    """The error, which is also scikit-learn's if that is in use."""
    theirs = getattr(sys.modules.get("sklearn.exceptions"), "NotFittedError", None)
    return NotFittedError(message) if theirs is None else type("NotFittedError", (NotFittedError, theirs), {})(message)


@dataclass(frozen=True)
class Stack:
    """All frames of several sequences side by side, as the kernels over many sequences take them.

    Attributes:
        columns: one column per frame, shape (D, frames).
        offsets: first column of each sequence, then the number of columns, shape (K + 1,).
    """

    columns: Floats
    offsets: Ints

    @classmethod
    def of(cls, sequences: Sequence[Floats]) -> "Stack":
        """Stack sequences of shape (T_k, D)."""
        offsets = np.cumsum([0, *(len(sequence) for sequence in sequences)])
        columns = np.empty((sequences[0].shape[1], int(offsets[-1])))
        for sequence, first, end in zip(sequences, offsets[:-1], offsets[1:], strict=True):
            columns[:, first:end] = sequence.T
        return cls(columns, offsets)

    @classmethod
    def parts(cls, sequences: Sequence[Floats], n_states: int) -> "list[Stack]":
        """Several stacks, so small that the results for N states fit into the processor's cache."""
        maximum = max(1, CACHED_VALUES // n_states)
        parts: list[list[Floats]] = [[]]
        filled = 0
        for sequence in sequences:
            if parts[-1] and filled + len(sequence) > maximum:
                parts.append([])
                filled = 0
            parts[-1].append(sequence)
            filled += len(sequence)
        return [cls.of(part) for part in parts]

    @property
    def n_frames(self) -> int:
        """Of all sequences together."""
        return int(self.offsets[-1])

    @property
    def lengths(self) -> Ints:
        """Number of frames of each sequence. Shape (K,)."""
        return np.diff(self.offsets)


class SequenceLengthError(ValueError):
    """A sequence is shorter or longer than the model's durations allow."""


def checked_sequence(sequence: ArrayLike, dim: int | None = None) -> Floats:
    """The sequence as contiguous float64, shape (T, D).

    Raises ValueError for a wrong shape, a wrong dimension or values that are not finite.
    """
    try:
        array = np.ascontiguousarray(sequence, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(
            "a sequence is an array of numbers of shape (frames, dimensions), the same number in each frame; "
            f"cannot convert this one: {error}"
        ) from error
    if array.ndim != 2 or array.shape[0] == 0 or array.shape[1] == 0:
        raise ValueError(f"a sequence has shape (frames, dimensions) with at least one frame, found {array.shape}")
    if dim is not None and array.shape[1] != dim:
        raise ValueError(f"the model describes {dim} dimensions per frame, the sequence has {array.shape[1]}")
    largest = np.abs(array).max()
    if largest <= LARGEST:  # false for NaN too
        return array
    bad = ~np.isfinite(array).all(axis=1)
    if bad.any():
        raise ValueError(f"{int(bad.sum())} of {len(array)} frames hold values that are not finite; "
                         f"the first is frame {int(bad.argmax())}; fill or cut them")  # fmt: skip
    raise ValueError(
        f"values up to {largest:.3g} cannot be squared and summed; check the unit, use at most {LARGEST:g}"
    )


def checked_sequences(sequences: Sequence[ArrayLike]) -> list[Floats]:
    """All sequences checked and of one dimension. Raises ValueError naming the bad sequence."""
    if len(sequences) == 0:
        raise ValueError("no sequences were given; at least one is needed")
    checked: list[Floats] = []
    for index, sequence in enumerate(sequences):
        try:
            array = checked_sequence(sequence)
        except ValueError as error:
            raise ValueError(f"sequence {index}: {error}") from error
        if checked and array.shape[1] != checked[0].shape[1]:
            raise ValueError(
                f"sequence {index}: it has {array.shape[1]} dimensions, sequence 0 has {checked[0].shape[1]}; "
                "give all the same columns"
            )
        checked.append(array)
    return checked


def check_demonstrations(sequences: Sequence[Floats], floor_deviation: float) -> None:
    """Raise ValueError for sequences that no model can learn from, with the sequence or dimension and the remedy.

    These are sequences of one frame, copies of another one, and dimensions that never change, unless a floor in the
    data's unit gives their accuracy.
    """
    by_ends: dict[tuple[int, bytes, bytes], list[int]] = {}
    for index, sequence in enumerate(sequences):
        if len(sequence) < 2:
            raise ValueError(f"sequence {index}: it has one frame, which is no movement; give at least 2 frames")
        candidates = by_ends.setdefault((len(sequence), sequence[0].tobytes(), sequence[-1].tobytes()), [])
        for other in candidates:
            if np.array_equal(sequences[other], sequence):
                raise ValueError(
                    f"sequence {index}: it is a copy of sequence {other}, which makes the variation look too "
                    "small; leave it out"
                )
        candidates.append(index)
    if floor_deviation > 0:
        return
    frames = np.concatenate(list(sequences))
    low, high = frames.min(axis=0), frames.max(axis=0)
    ranges, size = high - low, np.maximum(np.abs(low), np.abs(high))
    constant = (ranges <= 1e-12 * size) | (ranges < MIN_RANGE)
    if constant.any():
        dimension = int(constant.argmax())
        raise ValueError(
            f"dimension {dimension} has the value {low[dimension]:.6g} in all frames of all sequences, so its "
            "variance is zero; leave it out, or give TrainingOptions(floor_deviation=...) in its unit"
        )


def check_length(n_frames: int, n_states: int, d_min: int, d_max: int, prefix: str = "") -> None:
    """Raise SequenceLengthError unless N d_min <= T <= N d_max (thesis 4.1.2.1); its message begins with `prefix`."""
    shortest, longest = n_states * d_min, n_states * d_max
    if not shortest <= n_frames <= longest:
        raise SequenceLengthError(
            f"{prefix}a sequence of {n_frames} frames does not fit {n_states} states of {d_min} to {d_max} frames "
            f"each: allowed are {shortest} to {longest} frames; resample it, best to about {(shortest + longest) // 2}"
        )


def resample(sequence: ArrayLike, n_frames: int) -> Floats:
    """The sequence at `n_frames` equally spaced times, linearly interpolated; the ends stay. Shape (n_frames, D)."""
    array = checked_sequence(sequence)
    if n_frames < 2:
        raise ValueError(f"resampling needs at least 2 frames, found {n_frames}")
    if len(array) == n_frames:
        return array.copy()
    return interpolate(array, np.linspace(0.0, len(array) - 1.0, n_frames))


def interpolate(points: Floats, positions: Floats) -> Floats:
    """Rows of `points` at fractional row positions, linearly interpolated. Shape (len(positions), D)."""
    lower = np.clip(np.floor(positions).astype(np.int64), 0, len(points) - 1)
    upper = np.minimum(lower + 1, len(points) - 1)
    fraction = (positions - lower)[:, None]
    return (1.0 - fraction) * points[lower] + fraction * points[upper]
