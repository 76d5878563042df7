"""How far the true means may lie from those interpolated between grid lines, as uncertainty of theta."""

import numpy as np

from paramove.documents.array_types import Floats
from paramove.phmm.grid import ParameterGrid

UNSEEN_BEND = 0.03
"""Standard deviation of theta half-way between the only two lines of a dimension, as a share of the grid: what lies
between cannot be known from them. The 2 x 2 model of thesis 4.2.5 is 3.5 cm off in the middle of 80 cm."""


def bending(grid: ParameterGrid, means: Floats, coordinates: Floats, gain: Floats) -> Floats:
    """Covariance of theta in grid coordinates (P, P) at a place (P,).

    Interpolation between lines h apart misses s (1 - s) h^2 f'' / 2, with s the share of the way; f'' follows from
    three neighbouring lines.

    Args:
        means: of the local models, (G, N, D). gain: what averages of the states move theta by, (P, N D).
    """
    shaped = means.reshape(*grid.shape, -1)
    total = np.zeros((grid.dimension, grid.dimension))
    for p, knots in enumerate(grid.knots):
        line = int(np.clip(np.searchsorted(knots, coordinates[p], side="right") - 1, 0, len(knots) - 2))
        width = knots[line + 1] - knots[line]
        share = float(np.clip((coordinates[p] - knots[line]) / width, 0.0, 1.0))
        if len(knots) == 2:
            total[p, p] += (4.0 * UNSEEN_BEND * share * (1.0 - share)) ** 2
            continue
        for middle in {max(1, line), min(line + 1, len(knots) - 2)}:
            moved = (
                0.5 * share * (1.0 - share) * width**2 * gain @ _second_derivative(shaped, grid, p, middle, coordinates)
            )
            total += np.outer(moved, moved)
    return total


def _second_derivative(shaped: Floats, grid: ParameterGrid, p: int, middle: int, coordinates: Floats) -> Floats:
    """Of the means along dimension p at an inner line, at the nearest lines of the other dimensions. (N D,)."""
    place = [int(np.abs(knots - at).argmin()) for knots, at in zip(grid.knots, coordinates, strict=True)]
    before, here, after = (shaped[(*place[:p], middle + step, *place[p + 1 :])] for step in (-1, 0, 1))
    knots = grid.knots[p]
    low, high = knots[middle] - knots[middle - 1], knots[middle + 1] - knots[middle]
    result: Floats = 2.0 * ((after - here) / high - (here - before) / low) / (low + high)
    return result
