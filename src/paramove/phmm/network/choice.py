"""Number of hidden units and weight decay of the networks of a NeuralPHMM, chosen by cross-validation.

Groups of movements are left out (thesis 3.3.2.1), while the alignment of frames and states stays that of all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, Ints
from paramove.phmm.network.networks import StateNetworks, StateTargets, drawn_inner

NUMBERS_OF_UNITS = (1, 2, 4, 8)
DECAYS = (1e-4, 1e-2)
"""Ridge of the outer weights, as a fraction of the number of movements."""
MAX_FOLDS = 5
STEPS = 40
WORTH = 0.05
"""More units must reduce the error of left-out movements by this fraction; otherwise noise would choose some."""


@dataclass(frozen=True)
class Choice:
    """Number of hidden units, their weight decay, and W1 with b1 to begin with, (N, H, P + 1)."""

    n_hidden: int
    decay: float
    inner: Floats


def chosen_units(targets: StateTargets, groups: Ints, n_hidden: int | None, n_restarts: int, seed: int) -> Choice:
    """The best number of units, or the best start for a given one.

    Args:
        targets: with the ridge of the skip's columns only. groups: number of the group of each target, (K,).
        n_hidden: number of units if it is given.
    """
    targets, groups = _condensed(targets, groups)
    rng = np.random.default_rng(seed)
    n_groups = len(np.unique(groups))
    shape = targets.weights.shape[1], targets.positions.shape[1]
    if n_hidden is None and n_groups < 4:
        n_hidden = 0  # the rest may be noise
    numbers = NUMBERS_OF_UNITS if n_hidden is None else (n_hidden,)
    best = Choice(0, DECAYS[0], np.zeros((shape[0], 0, shape[1] + 1)))
    known = _left_out_errors(targets, groups, best) if n_hidden is None else None
    for number in numbers if n_hidden != 0 else ():
        if n_hidden is None and number > 2 * max(1, best.n_hidden):
            break  # half as many did not help
        starts = [drawn_inner(shape[0], number, shape[1], rng) for _ in range(max(1, n_restarts))]
        for decay in DECAYS:
            choice, start = _trained(targets, Choice(number, decay, starts[0]), starts)
            # The start must not depend on left-out groups either, so it is the drawn one again.
            again = replace(choice, inner=start)
            errors = _left_out_errors(targets, groups, again) if n_groups > 1 else np.array([-decay])
            if known is None or _better(errors, known, more=number > best.n_hidden):
                best, known = choice, errors
    return best


def with_decay(targets: StateTargets, choice: Choice) -> StateTargets:
    """The targets with the ridge of the outer weights too."""
    decay = np.full(choice.n_hidden, choice.decay * float(targets.weights.sum(axis=0).mean()))
    return replace(targets, ridge=np.concatenate([targets.ridge, decay]))


def _condensed(targets: StateTargets, groups: Ints) -> tuple[StateTargets, Ints]:
    """The same targets with those of one theta and group merged: Q changes by a constant."""
    kinds = np.column_stack([np.round(targets.positions, 9), groups])
    _, first, number = np.unique(kinds, axis=0, return_index=True, return_inverse=True)
    chosen = np.zeros((len(first), len(groups)))
    chosen[number.reshape(-1), np.arange(len(groups))] = 1.0
    weights = chosen @ targets.weights
    total = np.einsum("mk,kn,knd->mnd", chosen, targets.weights, targets.rotated, optimize=True)
    rotated = total / np.maximum(weights, 1e-300)[:, :, None]
    together = replace(
        targets, positions=targets.positions[first], features=targets.features[first], weights=weights, rotated=rotated
    )
    return together, groups[first]


def _trained(targets: StateTargets, choice: Choice, starts: list[Floats]) -> tuple[Choice, Floats]:
    """The choice with the best result from the starts, and that start."""
    whole = with_decay(targets, choice)
    reached = [whole.improved(start, STEPS) for start in starts]
    losses = [whole.loss_and_gradient(inner)[0] for inner in reached]
    best = int(np.argmin(losses))
    return replace(choice, inner=reached[best]), starts[best]


def _better(errors: Floats, known: Floats, more: bool) -> bool:
    """Whether the last of `errors`, of all folds together, is less.

    With more units by `WORTH`, and in the folds (all but the last) by more than one standard error: else one fold of a
    few groups would decide.
    """
    if not more:
        return bool(errors[-1] < known[-1])
    gains = known[:-1] - errors[:-1]
    by_chance = float(gains.std(ddof=1)) / np.sqrt(len(gains)) if len(gains) > 1 else 0.0
    return bool(errors[-1] < known[-1] + np.log(1.0 - WORTH) and gains.mean() > by_chance)


def _left_out_errors(targets: StateTargets, groups: Ints, choice: Choice) -> Floats:
    """Mean over states and dimensions of the logarithm of squared misses, of each left-out fold and of all together.

    Dimensions are those of the movements: the rotation of the targets is arbitrary where covariances are equal.
    """
    different = np.unique(groups)
    folds = np.searchsorted(different, groups) % MAX_FOLDS
    whole, back = with_decay(targets, choice), np.linalg.inv(targets.rotation)
    missed = []
    for fold in np.unique(folds):
        training, tested = folds != fold, folds == fold
        if not training.any():
            continue
        part = _part(whole, training)
        networks = part.networks(part.improved(choice.inner, STEPS))
        rotated_errors = targets.rotated[tested] - _rotated_means(networks, _part(whole, tested))
        squared = np.einsum("nde,kne->knd", back, rotated_errors) ** 2
        missed.append((squared * targets.weights[tested][:, :, None]).sum(axis=0))
    everything = np.stack([*missed, np.sum(missed, axis=0)])
    return np.asarray(np.log(everything + 1e-300).mean(axis=(1, 2)))


def _part(targets: StateTargets, chosen: NDArray[np.bool_]) -> StateTargets:
    return replace(
        targets,
        positions=targets.positions[chosen],
        features=targets.features[chosen],
        weights=targets.weights[chosen],
        rotated=targets.rotated[chosen],
    )


def _rotated_means(networks: StateNetworks, targets: StateTargets) -> Floats:
    means = networks.means(targets.positions, targets.features)
    result: Floats = np.einsum("nde,kne->knd", targets.rotation, means)
    return result
