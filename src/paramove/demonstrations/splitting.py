"""Splits movements into training and test sets, by movement, person or parameter cell; the same for the same seed."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Literal, TypeVar

import numpy as np

from paramove.demonstrations.movement import DemonstrationError, Movement

Drawn = TypeVar("Drawn")
SplitBy = Literal["movement", "subject", "theta"]
SAME_THETA = 1e-6
"""Parameters that differ by less lie in one cell."""


def split_groups(
    movements: Sequence[Movement], by: SplitBy, fraction: float, seed: int, bins: int | None = None
) -> tuple[list[int], list[int]]:
    """Indices of the movements that train and of those that test, each in their old order.

    Args:
        movements: All.
        by: movement: a fraction of the movements of each action. subject: whole persons. theta: whole parameter cells,
            so that no parameter of a test was trained with.
        fraction: Fraction of the movements of an action, of the persons or of the cells that test; at least one.
        seed: The same seed and movements, in whatever order, give the same split.
        bins: With theta: number of cells of equal width per parameter; None: each parameter vector is its own cell.

    Raises ValueError for a fraction outside (0, 1), DemonstrationError if there is nothing to choose from.
    """
    if not 0.0 < fraction < 1.0:
        raise ValueError(f"expected a fraction for the test above 0 and below 1, found {fraction}")
    rng = np.random.default_rng(seed)
    if by == "movement":
        tested: set[int] = set()
        for action in sorted({movement.action for movement in movements}):
            chosen = [n for n, movement in enumerate(movements) if movement.action == action]
            chosen.sort(key=lambda n: _identity(movements[n]))
            tested.update(_drawn(chosen, fraction, rng, f"movements of {action}"))
    else:
        group = _subject if by == "subject" else _cells(movements, bins)
        groups = sorted({group(movement) for movement in movements}, key=repr)
        drawn = set(_drawn(groups, fraction, rng, "persons" if by == "subject" else "parameter cells"))
        tested = {n for n, movement in enumerate(movements) if group(movement) in drawn}
    return [n for n in range(len(movements)) if n not in tested], sorted(tested)


def _identity(movement: Movement) -> tuple[object, ...]:
    """Key that identifies a movement of an action, independent of their order."""
    labels = (movement.subject, movement.side, tuple(movement.theta.tolist()), movement.repetition)
    return (*labels, len(movement.time), movement.positions[0].tobytes(), movement.positions[-1].tobytes())


def _subject(movement: Movement) -> Hashable:
    return movement.subject


def _cells(movements: Sequence[Movement], bins: int | None) -> Callable[[Movement], Hashable]:
    if bins is None:
        return lambda movement: tuple(np.round(movement.theta / SAME_THETA).astype(np.int64).tolist())
    if bins < 1:
        raise ValueError(f"at least one cell per parameter expected, found {bins}")
    theta = np.stack([movement.theta for movement in movements])
    low, width = theta.min(axis=0), np.ptp(theta, axis=0)
    width = np.where(width > 0.0, width, 1.0)

    def cell(movement: Movement) -> Hashable:
        cell = np.floor((movement.theta - low) / width * bins).astype(np.int64)
        return tuple(np.minimum(cell, bins - 1).tolist())

    return cell


def _drawn(choices: list[Drawn], fraction: float, rng: np.random.Generator, what: str) -> list[Drawn]:
    if len(choices) < 2:
        raise DemonstrationError(
            f"{len(choices)} {what} cannot be split into training and test; "
            "record more, or split by something else (movement, subject, theta)"
        )
    count = min(max(1, round(fraction * len(choices))), len(choices) - 1)
    return [choices[n] for n in rng.permutation(len(choices))[:count]]
