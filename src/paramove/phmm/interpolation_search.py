"""Compiled search for the parameter of a sequence under an interpolative PHMM (thesis 3.4.4).

Inside a cell of the grid the likelihood is smooth; between cells, and where covariances stop to follow outside,
it has kinks. So the search goes from region to region, a region being a cell or what lies outside next to one.
"""

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, Ints
from paramove.hmm import compiled
from paramove.phmm.interpolation_kernels import expectation_at, value_at

BORDER = 1e-9
MAX_STEPS, TOLERANCE = 40, 1e-3
PROMISE = 1e-5
"""A step that promises a smaller gain is not tried."""
COARSE = 30.0
"""Tolerance of the search with widened covariances."""
NEAREST, FURTHEST = 4.0, 32.0
"""Of the places at which hills that rise again are looked for, in standard deviations of the summit found first."""


@compiled
def region_of(number: int, counts: Ints) -> Ints:
    """Regions are the cells and what lies outside: -1 before the first line, counts - 1 behind the last. Shape (P,)."""
    region = np.empty(len(counts), np.int64)
    for p in range(len(counts) - 1, -1, -1):
        region[p] = number % (counts[p] + 1) - 1
        number //= counts[p] + 1
    return region


@compiled
def cell_of(region: Ints, counts: Ints) -> Ints:
    """The cell that holds in a region: outside that of the border. Shape (P,)."""
    return np.minimum(np.maximum(region, 0), counts - 2)


@compiled
def region_bounds(region: Ints, knots: Floats, counts: Ints, margin: float) -> tuple[Floats, Floats]:
    """Minimum and maximum coordinates of a region. Shapes (P,)."""
    lower, upper = np.empty(len(region)), np.empty(len(region))
    for p in range(len(region)):
        lower[p] = -margin if region[p] < 0 else knots[p, region[p]]
        upper[p] = 1.0 + margin if region[p] > counts[p] - 2 else knots[p, region[p] + 1]
    return lower, upper


@compiled
def _step(place: Floats, gradient: Floats, curvature: Floats, lower: Floats, upper: Floats) -> Floats:
    """Newton step of the components that the gradient does not hold at a bound. Shape (P,)."""
    matrix, right = curvature.copy(), gradient.copy()
    ridge = 1e-9 * np.trace(curvature) / len(place) + 1e-300
    for p in range(len(place)):
        matrix[p, p] += ridge
        if (place[p] <= lower[p] and gradient[p] < 0.0) or (place[p] >= upper[p] and gradient[p] > 0.0):
            matrix[p, :] = 0.0
            matrix[:, p] = 0.0
            matrix[p, p] = 1.0
            right[p] = 0.0
    return np.linalg.solve(matrix, right).astype(np.float64)


@compiled
def _renewed(curvature: Floats, moved: Floats, fallen: Floats) -> Floats:
    """BFGS update of minus the Hessian after a move (P,) along which minus the gradient grew by `fallen` (P,)."""
    along = curvature @ moved
    bent, seen = moved @ along, moved @ fallen
    if bent <= 0.0 or seen <= 0.05 * bent:
        return curvature
    return curvature + np.outer(fallen, fallen) / seen - np.outer(along, along) / bent


@compiled
def climbed(
    start: Floats, region: Ints, margin: float, smoothing: float, tolerance: float, columns: Floats, knots: Floats,
    counts: Ints, means: Floats, covariances: Floats, durations: Floats, d_min: int,
) -> tuple[Floats, float, Floats]:  # fmt: skip
    """Greatest ln p within a region that is reached from `start`: the place (P,), its value, and the curvature (P, P).

    Newton steps with the information of the means to begin with, then with what the gradients tell, shortened while
    the likelihood would fall.
    """
    lower, upper = region_bounds(region, knots, counts, margin)
    cell = cell_of(region, counts)
    place = np.minimum(np.maximum(start, lower), upper)
    value, gradient, curvature = expectation_at(
        place, cell, smoothing, columns, knots, counts, means, covariances, durations, d_min
    )
    for _ in range(MAX_STEPS):
        if not value > -np.inf:
            break
        step = _step(place, gradient, curvature, lower, upper)
        if 0.0 <= np.dot(gradient, step) < 2.0 * PROMISE:
            break
        share, gain = 1.0, -np.inf
        for _ in range(8):
            candidate = np.minimum(np.maximum(place + share * step, lower), upper)
            found, slope, _ = expectation_at(
                candidate, cell, smoothing, columns, knots, counts, means, covariances, durations, d_min
            )
            gain = found - value
            if gain >= 0.0:
                break
            share *= 0.3
        if not gain >= 0.0:
            break
        curvature = _renewed(curvature, candidate - place, gradient - slope)
        place, value, gradient = candidate, found, slope
        if gain < tolerance:
            break
    return place, value, curvature


@compiled
def _touched(place: Floats, knots: Floats, counts: Ints, tried: NDArray[np.bool_]) -> int:
    """Number of a region that has not been tried and that touches the place; -1 if there is none."""
    for number in range(len(tried)):
        if tried[number]:
            continue
        lower, upper = region_bounds(region_of(number, counts), knots, counts, 1e9)
        touching = True
        for p in range(len(place)):
            touching = touching and lower[p] - BORDER <= place[p] <= upper[p] + BORDER
        if touching:
            return number
    return -1


@compiled
def _summit(
    start: Floats, number: int, margin: float, columns: Floats, knots: Floats, counts: Ints, means: Floats,
    covariances: Floats, durations: Floats, d_min: int,
) -> tuple[Floats, float, Floats, int]:  # fmt: skip
    """As `climbed` from a start in a region, going on over borders; last the number of the region reached."""
    n_regions = 1
    for p in range(len(counts)):
        n_regions *= counts[p] + 1
    tried = np.zeros(n_regions, np.bool_)
    best, value, curvature = start, -np.inf, np.eye(len(start))
    following, reached = number, number
    while following >= 0:
        tried[following] = True
        place, found, bent = climbed(
            best, region_of(following, counts), margin, 1.0, TOLERANCE, columns, knots, counts, means, covariances,
            durations, d_min,
        )  # fmt: skip
        if found > value:
            best, value, curvature, reached = place, found, bent, following
        following = _touched(best, knots, counts, tried)
    return best, value, curvature, reached


@compiled
def region_at(place: Floats, knots: Floats, counts: Ints) -> int:
    """Number of the region that a place lies in."""
    number = 0
    for p in range(len(place)):
        part = 0
        while part < counts[p] and place[p] > knots[p, part]:
            part += 1
        number = number * (counts[p] + 1) + part
    return number


@compiled
def likeliest(
    margin: float, smoothing: float, columns: Floats, knots: Floats, counts: Ints, means: Floats, covariances: Floats,
    durations: Floats, d_min: int,
) -> tuple[Floats, float, Ints]:  # fmt: skip
    """The place (P,) with the largest ln p, its value, and the cell that holds there.

    The search begins in the cell whose middle is likeliest, with widened covariances (paper 5.3). Between cells the
    likelihood has kinks, and a sequence that could be aligned in two ways has two summits side by side (corrected
    4.2.5): so the search goes on over borders, and hills that rise again within `FURTHEST` deviations are climbed too.
    """
    dimension, n_cells = len(counts), 1
    for p in range(dimension):
        n_cells *= counts[p] - 1
    middle, start, promise = np.empty(dimension), np.full(dimension, 0.5), -np.inf
    for cell_number in range(n_cells):
        rest = cell_number
        for p in range(dimension - 1, -1, -1):
            line = rest % (counts[p] - 1)
            rest //= counts[p] - 1
            middle[p] = 0.5 * (knots[p, line] + knots[p, line + 1])
        if n_cells > 1:
            cell = cell_of(region_of(region_at(middle, knots, counts), counts), counts)
            found = value_at(middle, cell, smoothing, columns, knots, counts, means, covariances, durations, d_min)
        else:
            found = 0.0
        if found > promise:
            start, promise = middle.copy(), found
    number = region_at(start, knots, counts)
    start, _, _ = climbed(
        start, region_of(number, counts), margin, smoothing, COARSE, columns, knots, counts, means, covariances,
        durations, d_min,
    )  # fmt: skip
    best, value, curvature, number = _summit(
        start, number, margin, columns, knots, counts, means, covariances, durations, d_min
    )
    spread, axes = np.linalg.eigh(curvature)
    centre = best.copy()
    for axis in range(2 * dimension):
        direction = axes[:, axis // 2] / np.sqrt(max(spread[axis // 2], 1.0)) * (1.0 if axis % 2 else -1.0)
        distance, before = NEAREST, value
        while distance <= FURTHEST:
            place = np.minimum(np.maximum(centre + distance * direction, -margin), 1.0 + margin)
            region = region_at(place, knots, counts)
            cell = cell_of(region_of(region, counts), counts)
            found = value_at(place, cell, 1.0, columns, knots, counts, means, covariances, durations, d_min)
            if found > before:
                other, found, _, reached = _summit(
                    place, region, margin, columns, knots, counts, means, covariances, durations, d_min
                )
                if found > value:
                    best, value, number = other, found, reached
                break
            before = found
            distance *= 2.0
    return best, value, cell_of(region_of(number, counts), counts)
