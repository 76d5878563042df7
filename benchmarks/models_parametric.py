"""The search for theta of one movement, beside hmmlearn's score with scipy's L-BFGS-B: rows for `benchmarks/models.py`.

hmmlearn knows no parametric models. Its opponent here is what a user of it would write: interpolate the local models at
each theta that the optimiser asks for, and score the movement. With the same durations that takes d_max sub-states per
state ("expanded"); the plain chain is another, simpler model and is shown for comparison.
"""

from collections.abc import Callable

import numpy as np
from models_peers import NotInstalledError, hmmlearn_model
from scipy.optimize import minimize

from paramove.demonstrations import demonstrations_at, table_targets
from paramove.hmm import resample
from paramove.phmm import InterpolativePHMM, NeuralPHMM, ParametricHMM, PolynomialPHMM

FRAMES = 100
MARGIN = 0.25

Task = Callable[[], object]


def raster(columns: int, rows: int, repetitions: int, seed: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Pointing movements over the table (thesis 4.2.1), 100 frames of 21 coordinates, and (u, v)."""
    targets, places = table_targets(columns, rows)
    rng = np.random.default_rng(seed)
    shown = demonstrations_at(targets, rng, action="pointing", repetitions=repetitions).sequences
    return [resample(one, FRAMES) for one in shown], np.repeat(places, repetitions, axis=0)


def hmmlearn_search(model: ParametricHMM, movement: np.ndarray, lengths: tuple[int, int]) -> Task:
    """The most likely theta by hmmlearn and L-BFGS-B with its numerical gradient, from the middle of the raster."""

    def falling(theta: np.ndarray) -> float:
        local = model.at(theta)
        return -hmmlearn_model(local.means_, local.covariances_, *lengths, "log", 1).score(movement)

    bounds = [(-MARGIN, 1.0 + MARGIN)] * 2
    return lambda: minimize(falling, [0.5, 0.5], method="L-BFGS-B", bounds=bounds)


def _searches(model: ParametricHMM, unseen: list[np.ndarray]) -> list[tuple[str, Task | None, str]]:
    """The rows of hmmlearn for a model."""
    rows: list[tuple[str, Task | None, str]] = []
    for name, lengths in (("hmmlearn, expanded, L-BFGS-B", (4, 6)), ("hmmlearn, plain chain, L-BFGS-B", (1, 1))):
        try:
            searches = [hmmlearn_search(model, movement, lengths) for movement in unseen]
            searches[0]()
        except NotInstalledError as error:
            rows.append((name, None, str(error)))
        else:
            rows.append((name, lambda searches=searches: [search() for search in searches], ""))
    return rows


def estimate_rows(kind: str) -> list[tuple[str, Task | None, str]]:
    """Name, work and note of each row; the work is one estimate in turn over the same eight movements.

    `kind` is "interpolative", "linear", "quadratic" or "neural".
    """
    shown, theta = raster(3, 3, 10, seed=0)
    unseen = raster(4, 2, 1, seed=1)[0]
    if kind == "neural":
        return [("paramove, neural", _all(NeuralPHMM(20, 4, 6).fit(shown, theta), unseen), "")]
    if kind == "interpolative":
        local = InterpolativePHMM(20, 4, 6, search_margin=MARGIN).fit(shown, theta)
        return [("paramove, interpolative 3 x 3", _all(local, unseen), ""), *_searches(local, unseen)]
    models = {
        residuals: PolynomialPHMM(20, 4, 6, degree=1 if kind == "linear" else 2, residuals=residuals).fit(shown, theta)
        for residuals in ("independent", "correlated")
    }
    own = [(f"paramove, {kind}, {residuals}", _all(model, unseen), "") for residuals, model in models.items()]
    return own + _searches(models["independent"], unseen)


UNSEEN = 8
"""Movements of one run of a row: `estimate_rows` of 4 x 2 places."""


def _all(model: ParametricHMM, movements: list[np.ndarray]) -> Task:
    return lambda: [model.estimate(movement) for movement in movements]
