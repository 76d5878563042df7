"""Search for theta of one movement, and hmmlearn's score with scipy's L-BFGS-B: rows for `benchmarks/models.py`.

hmmlearn knows no parametric models. It is compared with what a user of it would write: interpolate the local models at
each theta of the optimiser, and score the movement. With the same durations that takes d_max sub-states per
state ("expanded"); the plain chain is another, simpler model, for comparison.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize

from benchmarks.models_peers import NotInstalledError, hmmlearn_model
from paramove.demonstrations import demonstrations_at, table_targets
from paramove.hmm import resample
from paramove.phmm import InterpolativePHMM, NeuralPHMM, ParametricHMM, PolynomialPHMM

FRAMES = 100
MARGIN = 0.25

Task = Callable[[], object]


def grid(columns: int, rows: int, repetitions: int, seed: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Pointing movements over the table (thesis 4.2.1), 100 frames of 21 coordinates, and (u, v)."""
    targets, coordinates = table_targets(columns, rows)
    rng = np.random.default_rng(seed)
    demonstrations = demonstrations_at(targets, rng, action="pointing", repetitions=repetitions).sequences
    return [resample(one, FRAMES) for one in demonstrations], np.repeat(coordinates, repetitions, axis=0)


def hmmlearn_search(model: ParametricHMM, movement: np.ndarray, lengths: tuple[int, int]) -> Task:
    """The most likely theta by hmmlearn and L-BFGS-B with its numerical gradient, from the middle of the grid."""

    def falling(theta: np.ndarray) -> float:
        local = model.at(theta)
        return -float(hmmlearn_model(local.means_, local.covariances_, *lengths, "log", 1).score(movement))

    bounds = [(-MARGIN, 1.0 + MARGIN)] * 2
    return lambda: minimize(falling, [0.5, 0.5], method="L-BFGS-B", bounds=bounds)


def _searches(model: ParametricHMM, untrained: list[np.ndarray]) -> list[tuple[str, Task | None, str]]:
    """The rows of hmmlearn for a model."""
    rows: list[tuple[str, Task | None, str]] = []
    for name, lengths in (("hmmlearn, expanded, L-BFGS-B", (4, 6)), ("hmmlearn, plain chain, L-BFGS-B", (1, 1))):
        try:
            searches = [hmmlearn_search(model, movement, lengths) for movement in untrained]
            searches[0]()
        except NotInstalledError as error:
            rows.append((name, None, str(error)))
        else:
            rows.append((name, _in_turn(searches), ""))
    return rows


def _in_turn(searches: list[Task]) -> Task:
    return lambda: [search() for search in searches]


def estimate_rows(kind: str) -> list[tuple[str, Task | None, str]]:
    """Name, work and note of each row; the work is one estimate in turn over the same eight movements.

    `kind` is "interpolative", "linear", "quadratic" or "neural".
    """
    training, theta = grid(3, 3, 10, seed=0)
    untrained = grid(4, 2, 1, seed=1)[0]
    if kind == "neural":
        return [("paramove, neural", _all(NeuralPHMM(20, 4, 6).fit(training, theta), untrained), "")]
    if kind == "interpolative":
        local = InterpolativePHMM(20, 4, 6, search_margin=MARGIN, residuals="independent").fit(training, theta)
        return [("paramove, interpolative 3 x 3", _all(local, untrained), ""), *_searches(local, untrained)]
    models = {
        residuals: PolynomialPHMM(20, 4, 6, degree=1 if kind == "linear" else 2, residuals=residuals).fit(
            training, theta
        )
        for residuals in ("independent", "correlated")
    }
    own = [(f"paramove, {kind}, {residuals}", _all(model, untrained), "") for residuals, model in models.items()]
    return own + _searches(models["independent"], untrained)


UNTRAINED = 8
"""Movements of one run of a row: `estimate_rows` of 4 x 2 targets."""


def _all(model: ParametricHMM, movements: list[np.ndarray]) -> Task:
    return lambda: [model.estimate(movement) for movement in movements]
