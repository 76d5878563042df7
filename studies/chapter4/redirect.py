"""Learning a bi-parametric movement: the redirect action (thesis 4.3), beyond the one picture that the thesis shows.

Training movements are blended from pointing movements, of a model or demonstrated; tests are pairs of targets drawn
over the whole region, blended without noise from the same pointing model.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from paramove.alignment import movement_distance
from paramove.demonstrations import (
    POINT_NAMES,
    Demonstrations,
    corner_pairs,
    nine_pairs,
    redirect_demonstrations,
    redirect_from_model,
    table_place,
    train_pointing_model,
)
from paramove.documents import Floats
from paramove.phmm import LinearPHMM, ParametricHMM, QuadraticPHMM

STATES, D_MIN, D_MAX, FRAMES = 32, 2, 3, 80
THESIS_PAIR = (0.25, 0.80, 0.80, 0.30)
"""Targets of figure 4.17."""
FEWEST = "9 pairs, demonstrated"
MODELS: dict[str, Callable[[], ParametricHMM]] = {
    "linear": lambda: LinearPHMM(STATES, D_MIN, D_MAX, resampled_frames=FRAMES),
    "quadratic": lambda: QuadraticPHMM(STATES, D_MIN, D_MAX, resampled_frames=FRAMES),
}


def redirects(seed: int, tests: int, only: str) -> dict[str, Any]:
    """The experiment as plain JSON: its rows, and the jerk of each."""
    rows = redirect_experiment(seed, tests, only)
    return {"values": {"jerk": [row["jerk_ratio"] for row in rows]}, "rows": rows}


def redirect_experiment(seed: int, tests: int = 40, only: str = "") -> list[dict[str, Any]]:
    """One row per training set (all whose name has `only`) and model: errors in cm, and jerk as multiple of training's.

    `error`: (4.3) against the blended movement; `start_miss`, `end_miss`: minimum distance of the fingertip from each
    target in its half of the movement; each with mean and maximum over the test pairs. The first test pair is that of
    figure 4.17.
    """
    rng = np.random.default_rng(seed)
    pointing = train_pointing_model(seed)
    pairs = np.vstack([THESIS_PAIR, rng.uniform(0.0, 1.0, (tests - 1, 4))])
    truth = redirect_from_model(pointing, pairs, FRAMES).sequences
    training: dict[str, Callable[[], Demonstrations]] = {
        "16 corner pairs, from the model": lambda: redirect_from_model(pointing, corner_pairs(), FRAMES),
        "12 corner pairs, from the model": lambda: redirect_from_model(pointing, corner_pairs(staying=False), FRAMES),
        "9 pairs, from the model": lambda: redirect_from_model(pointing, nine_pairs(), FRAMES),
        "16 corner pairs, demonstrated": lambda: redirect_demonstrations(corner_pairs(), rng, n_samples=FRAMES),
        FEWEST: lambda: redirect_demonstrations(nine_pairs(), rng, n_samples=FRAMES),
    }
    demonstrations = {name: demonstrate() for name, demonstrate in training.items() if only in name}
    return [
        {"seed": seed, "training": name, "model": kind, **_errors(make(), movements, pairs, truth)}
        for name, movements in demonstrations.items()
        for kind, make in MODELS.items()
    ]


def _errors(
    model: ParametricHMM, training: Demonstrations, pairs: Floats, truth: Sequence[Floats]
) -> dict[str, dict[str, float] | float]:
    model.fit(training.sequences, training.theta)
    made = [model.synthesize(pair, FRAMES) for pair in pairs]
    errors = [100.0 * movement_distance(one, true) for one, true in zip(made, truth, strict=True)]
    misses = 100.0 * np.array([target_misses(one, pair) for one, pair in zip(made, pairs, strict=True)])
    ratio = np.mean([jerk(one) for one in made]) / np.mean([jerk(one) for one in training.sequences])
    return {
        "error_cm": _summary(errors),
        "start_miss_cm": _summary(misses[:, 0]),
        "end_miss_cm": _summary(misses[:, 1]),
        "jerk_ratio": float(ratio),
    }


def _summary(values: Sequence[float] | Floats) -> dict[str, float]:
    return {"mean": float(np.mean(values)), "max": float(np.max(values))}


def target_misses(movement: Floats, pair: Floats) -> tuple[float, float]:
    """Minimum distance of the fingertip from the first target in the first half, and from the second, m."""
    index = POINT_NAMES.index("index")
    tip = movement.reshape(len(movement), len(POINT_NAMES), 3)[:, index]
    start, end = table_place(np.reshape(pair, (2, 2)))
    half = len(tip) // 2
    first = np.linalg.norm(tip[:half] - start, axis=1).min()
    second = np.linalg.norm(tip[half:] - end, axis=1).min()
    return float(first), float(second)


def jerk(movement: Floats) -> float:
    """Root mean square of the third difference over the frames, in the movement's unit per frame cubed."""
    third = np.diff(movement, 3, axis=0)
    return float(np.sqrt((third**2).sum(axis=1).mean()))
