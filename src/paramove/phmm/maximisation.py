"""Maximum of a log-likelihood that is smooth inside grid cells and has kinks between them (thesis 4.2.5, corrected)."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

Floats = NDArray[np.float64]
Objective = Callable[[Floats], float]


def maximum_over_cells(
    objective: Objective, knots: Sequence[Floats], margin: float, most_cells: int
) -> tuple[Floats, float]:
    """Best place and value: bounded maximisation in the most promising cells, the outer cells widened by `margin`.

    "Smooth and strictly concave" does not hold across cell borders, hence one search per cell (corrected).
    """
    cells = list(itertools.product(*(range(len(line) - 1) for line in knots)))
    bounds = [[_widened(line, index, margin) for line, index in zip(knots, cell, strict=True)] for cell in cells]
    centres = [np.array([0.5 * (line[i] + line[i + 1]) for line, i in zip(knots, cell, strict=True)]) for cell in cells]
    promise = np.array([objective(centre) for centre in centres])
    best, best_value = centres[int(promise.argmax())], float(promise.max())
    for number in np.argsort(-promise)[:most_cells]:
        start = np.clip(best, *np.transpose(bounds[number]))
        found = minimize(
            lambda place: -objective(place), start, method="L-BFGS-B", bounds=bounds[number], options={"eps": 1e-5}
        )
        if -found.fun > best_value:
            best, best_value = found.x, float(-found.fun)
    return best, best_value


def _widened(line: Floats, index: int, margin: float) -> tuple[float, float]:
    lower = line[index] - (margin if index == 0 else 0.0)
    upper = line[index + 1] + (margin if index == len(line) - 2 else 0.0)
    return float(lower), float(upper)


def curvature_covariance(objective: Objective, place: Floats, widest: float, step: float = 1e-3) -> Floats:
    """Inverse of the negative Hessian by central differences; no standard deviation above `widest`. Shape (P, P)."""
    dimension = len(place)
    hessian = np.empty((dimension, dimension))
    steps = step * np.eye(dimension)
    centre = objective(place)
    for i in range(dimension):
        hessian[i, i] = (objective(place + steps[i]) - 2.0 * centre + objective(place - steps[i])) / step**2
        for j in range(i):
            corners = (
                objective(place + steps[i] + steps[j])
                - objective(place + steps[i] - steps[j])
                - objective(place - steps[i] + steps[j])
                + objective(place - steps[i] - steps[j])
            )
            hessian[i, j] = hessian[j, i] = corners / (4.0 * step**2)
    values, vectors = np.linalg.eigh(-hessian)
    values = np.maximum(values, 1.0 / widest**2)
    result: Floats = (vectors / values) @ vectors.T
    return result
