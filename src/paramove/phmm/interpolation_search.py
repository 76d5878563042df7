"""Compiled search for the parameter of a sequence under an interpolative PHMM (thesis 3.4.4).

Inside a cell of the grid the likelihood is smooth; between cells, and where covariances become constant outside,
it has kinks. So the search goes from region to region; a region is a cell or the part outside next to one.
"""

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, Ints
from paramove.hmm import compiled
from paramove.phmm.interpolation_kernels import expectation_at, value_at

BORDER = 1e-9
MAX_STEPS, TOLERANCE = 40, 1e-3
MIN_PREDICTED_GAIN = 1e-5
"""A step with a smaller predicted gain is not tried."""
COARSE = 30.0
"""Tolerance of the search with widened covariances."""
NEAREST, FURTHEST = 4.0, 32.0
"""Distances of the search for further maxima, in standard deviations of the first maximum."""


@compiled
def region_of(number: int, counts: Ints) -> Ints:
    """Regions are the cells and the parts outside: -1 before the first line, counts - 1 behind the last. Shape (P,)."""
    region = np.empty(len(counts), np.int64)
    for p in range(len(counts) - 1, -1, -1):
        region[p] = number % (counts[p] + 1) - 1
        number //= counts[p] + 1
    return region


@compiled
def cell_of(region: Ints, counts: Ints) -> Ints:
    """The cell of a region: outside, that at the border. Shape (P,)."""
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
def _step(position: Floats, gradient: Floats, curvature: Floats, lower: Floats, upper: Floats) -> Floats:
    """Newton step of the components that the gradient does not keep at a bound. Shape (P,)."""
    matrix, right = curvature.copy(), gradient.copy()
    ridge = 1e-9 * np.trace(curvature) / len(position) + 1e-300
    for p in range(len(position)):
        matrix[p, p] += ridge
        if (position[p] <= lower[p] and gradient[p] < 0.0) or (position[p] >= upper[p] and gradient[p] > 0.0):
            matrix[p, :] = 0.0
            matrix[:, p] = 0.0
            matrix[p, p] = 1.0
            right[p] = 0.0
    return np.linalg.solve(matrix, right).astype(np.float64)


@compiled
def _renewed(curvature: Floats, moved: Floats, fallen: Floats) -> Floats:
    """BFGS update of minus the Hessian after a move (P,) along which minus the gradient grew by `fallen` (P,)."""
    along = curvature @ moved
    predicted, observed = moved @ along, moved @ fallen
    if predicted <= 0.0 or observed <= 0.05 * predicted:
        return curvature
    return curvature + np.outer(fallen, fallen) / observed - np.outer(along, along) / predicted


@compiled
def climbed(
    start: Floats, region: Ints, margin: float, smoothing: float, tolerance: float, columns: Floats, knots: Floats,
    counts: Ints, means: Floats, covariances: Floats, durations: Floats, d_min: int,
) -> tuple[Floats, float, Floats]:  # fmt: skip
    """Maximum of ln p within a region, reached from `start`: the position (P,), its value, and the curvature (P, P).

    Newton steps with the information of the means first, then with the gradients, shortened while the likelihood
    would fall.
    """
    lower, upper = region_bounds(region, knots, counts, margin)
    cell = cell_of(region, counts)
    position = np.minimum(np.maximum(start, lower), upper)
    value, gradient, curvature = expectation_at(
        position, cell, smoothing, columns, knots, counts, means, covariances, durations, d_min
    )
    for _ in range(MAX_STEPS):
        if not value > -np.inf:
            break
        step = _step(position, gradient, curvature, lower, upper)
        if 0.0 <= np.dot(gradient, step) < 2.0 * MIN_PREDICTED_GAIN:
            break
        fraction, gain = 1.0, -np.inf
        for _ in range(8):
            candidate = np.minimum(np.maximum(position + fraction * step, lower), upper)
            candidate_value, slope, _ = expectation_at(
                candidate, cell, smoothing, columns, knots, counts, means, covariances, durations, d_min
            )
            gain = candidate_value - value
            if gain >= 0.0:
                break
            fraction *= 0.3
        if not gain >= 0.0:
            break
        curvature = _renewed(curvature, candidate - position, gradient - slope)
        position, value, gradient = candidate, candidate_value, slope
        if gain < tolerance:
            break
    return position, value, curvature


@compiled
def _touched(position: Floats, knots: Floats, counts: Ints, tried: NDArray[np.bool_]) -> int:
    """Number of a region that has not been tried and that touches the position; -1 if there is none."""
    for number in range(len(tried)):
        if tried[number]:
            continue
        lower, upper = region_bounds(region_of(number, counts), knots, counts, 1e9)
        touching = True
        for p in range(len(position)):
            touching = touching and lower[p] - BORDER <= position[p] <= upper[p] + BORDER
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
        position, candidate_value, bent = climbed(
            best, region_of(following, counts), margin, 1.0, TOLERANCE, columns, knots, counts, means, covariances,
            durations, d_min,
        )  # fmt: skip
        if candidate_value > value:
            best, value, curvature, reached = position, candidate_value, bent, following
        following = _touched(best, knots, counts, tried)
    return best, value, curvature, reached


@compiled
def region_at(position: Floats, knots: Floats, counts: Ints) -> int:
    """Number of the region of a position."""
    number = 0
    for p in range(len(position)):
        part = 0
        while part < counts[p] and position[p] > knots[p, part]:
            part += 1
        number = number * (counts[p] + 1) + part
    return number


@compiled
def cell_at(position: Floats, knots: Floats, counts: Ints) -> Ints:
    """The cell of a position; outside, that at the border. Shape (P,)."""
    return cell_of(region_of(region_at(position, knots, counts), counts), counts)


@compiled
def likeliest(
    margin: float, smoothing: float, columns: Floats, knots: Floats, counts: Ints, means: Floats, covariances: Floats,
    durations: Floats, d_min: int,
) -> tuple[Floats, float, Ints]:  # fmt: skip
    """The position (P,) with the largest ln p, its value, and its cell.

    The search begins in the cell whose middle is likeliest, with widened covariances (paper 5.3). Between cells the
    likelihood has kinks, and a sequence that could be aligned in two ways has two neighbouring maxima (corrected
    4.2.5): so the search goes on over borders, and further maxima within `FURTHEST` deviations are climbed too.
    """
    dimension, n_cells = len(counts), 1
    for p in range(dimension):
        n_cells *= counts[p] - 1
    middle, start, best_value = np.empty(dimension), np.full(dimension, 0.5), -np.inf
    for cell_number in range(n_cells):
        rest = cell_number
        for p in range(dimension - 1, -1, -1):
            line = rest % (counts[p] - 1)
            rest //= counts[p] - 1
            middle[p] = 0.5 * (knots[p, line] + knots[p, line + 1])
        if n_cells > 1:
            cell = cell_at(middle, knots, counts)
            candidate_value = value_at(
                middle, cell, smoothing, columns, knots, counts, means, covariances, durations, d_min
            )
        else:
            candidate_value = 0.0
        if candidate_value > best_value:
            start, best_value = middle.copy(), candidate_value
    number = region_at(start, knots, counts)
    start, _, _ = climbed(
        start, region_of(number, counts), margin, smoothing, COARSE, columns, knots, counts, means, covariances,
        durations, d_min,
    )  # fmt: skip
    best, value, curvature, number = _summit(
        start, number, margin, columns, knots, counts, means, covariances, durations, d_min
    )
    curvatures, axes = np.linalg.eigh(curvature)
    centre = best.copy()
    for axis in range(2 * dimension):
        direction = axes[:, axis // 2] / np.sqrt(max(curvatures[axis // 2], 1.0)) * (1.0 if axis % 2 else -1.0)
        distance, before = NEAREST, value
        while distance <= FURTHEST:
            position = np.minimum(np.maximum(centre + distance * direction, -margin), 1.0 + margin)
            region = region_at(position, knots, counts)
            cell = cell_of(region_of(region, counts), counts)
            candidate_value = value_at(
                position, cell, 1.0, columns, knots, counts, means, covariances, durations, d_min
            )
            if candidate_value > before:
                other, candidate_value, _, reached = _summit(
                    position, region, margin, columns, knots, counts, means, covariances, durations, d_min
                )
                if candidate_value > value:
                    best, value, number = other, candidate_value, reached
                break
            before = candidate_value
            distance *= 2.0
    return best, value, cell_of(region_of(number, counts), counts)
