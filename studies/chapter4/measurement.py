"""What one kind of model, trained on one seed's movements, makes of the tests (4.2.4, 4.2.5)."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from paramove.alignment import movement_distance
from paramove.documents import Floats
from paramove.hmm import Path
from paramove.phmm import InterpolativePHMM, MovementClassifier, NeuralPHMM, ParametricHMM, has_p_values
from studies.chapter4.grid import (
    ACTIONS,
    COMPARED_SAMPLES,
    REPETITIONS,
    Grid,
    MovementSet,
    grid,
    redirects,
    references,
)
from studies.chapter4.kinds import BY_NAME, Kind
from studies.chapter4.unfinished import aborted, stopped
from studies.movements.measures import covered, theta_error
from studies.movements.method import Estimate

Values = dict[str, list[float]]

NOISES_M = (0.0, 0.05, 0.10, 0.15, 0.20)


def measured_kind(name: str, states: int, seed: int, every: int = 1) -> dict[str, Any]:
    """All measures of one kind of model; with `every` only each so many-th repetition of the tests is classified."""
    kind, movements = BY_NAME[name], grid(seed)
    began = time.perf_counter()
    models: dict[str, ParametricHMM] = {action: trained(kind, states, movements.train[action]) for action in ACTIONS}
    seconds = {"fit": (time.perf_counter() - began) / len(ACTIONS)}
    values: Values = {}
    for action, model in models.items():
        averages, targets = references(seed, action), movements.test[action].theta
        values[f"synthesis_{action}"] = synthesis_errors(model, averages, targets)
        values[f"linear_{action}"] = synthesis_errors(model, averages, targets, "linear")
    began = time.perf_counter()
    _classified(models, movements, every, values)
    seconds["classify"] = (time.perf_counter() - began) / len(values["correct"])
    _unfinished(models, movements, seed, every, values)
    durations = {}
    if isinstance(models["reaching"], InterpolativePHMM):
        corners = (models["reaching"].at(theta) for theta in ((0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)))
        durations = {"durations": [model.expected_durations().tolist() for model in corners]}
    hidden = [model.n_hidden_ for model in models.values() if isinstance(model, NeuralPHMM)]
    return {"values": values, "seconds": seconds, **durations, **({"hidden": hidden} if hidden else {})}


def trained(kind: Kind, states: int, movements: MovementSet) -> ParametricHMM:
    """A model of one action."""
    chosen = movements.at_corners() if kind.corners else movements
    return kind.untrained(states).fit(chosen.sequences, chosen.theta)


def synthesis_errors(model: ParametricHMM, averages: Floats, targets: Floats, path: Path = "smooth") -> list[float]:
    """Distance (4.3) of the prototype for each target from the average of the movements to it, cm.

    path "linear": straight lines between the means, as in the thesis.
    """
    return [
        100.0 * movement_distance(model.synthesize(target, COMPARED_SAMPLES, path=path), average)
        for target, average in zip(targets[::REPETITIONS], averages, strict=True)
    ]


def _classified(models: Mapping[str, ParametricHMM], movements: Grid, every: int, values: Values) -> None:
    """Parameters, their regions, the action, and the score of movements of the model's and of the other action."""
    classifier = MovementClassifier.from_models(models)
    for action, other in zip(ACTIONS, ACTIONS[::-1], strict=True):
        tests = movements.test[action]
        for x, target in zip(tests.sequences[::every], tests.theta[::every], strict=True):
            result = classifier.classify(x)
            estimate = Estimate(result.estimates[action].theta, result.estimates[action].covariance)
            _add(values, f"theta_{action}", theta_error(estimate.theta, target, "raster"))
            _add(values, f"covered_{action}", covered(estimate, target) or 0.0)
            _add(values, "correct", float(result.action == action))
            _add(values, f"score_genuine_{action}", score(models[action], x, result.estimates[action].log_likelihood))
            _add(values, f"score_action_{other}", score(models[other], x, result.estimates[other].log_likelihood))


def _unfinished(models: Mapping[str, ParametricHMM], movements: Grid, seed: int, every: int, values: Values) -> None:
    """Scores of movements that the model has not learned: not finished, or to two targets one after the other."""
    rng = np.random.default_rng([seed, 4])
    step = max(every, REPETITIONS)
    different = redirects(seed)[:: step // REPETITIONS]
    for action, model in models.items():
        tests = movements.test[action].sequences[::step]
        values[f"score_aborted_{action}"] = [score(model, aborted(x, rng)) for x in tests]
        values[f"score_stopped_{action}"] = [score(model, stopped(x, rng)) for x in tests]
        values[f"score_redirect_{action}"] = [score(model, x) for x in different]


def score(model: ParametricHMM, x: Floats, log_likelihood: float | None = None) -> float:
    """How well a movement fits a model: the likelihood of the thesis (2.2.5), or minus the outlier score."""
    if has_p_values(model):
        return -float(model.examine(x).outlier_score)
    return float(model.estimate(x).log_likelihood) if log_likelihood is None else log_likelihood


def measured_noise(name: str, states: int, seed: int) -> dict[str, Any]:
    """Error of theta of pointing, cm, when Gaussian noise is added to every coordinate of every frame (4.2.5)."""
    movements = grid(seed)
    model = trained(BY_NAME[name], states, movements.train["pointing"])
    tests = movements.test["pointing"]
    values: Values = {}
    for noise in NOISES_M:
        rng = np.random.default_rng([seed, 5])
        for x, target in zip(tests.sequences[::REPETITIONS], tests.theta[::REPETITIONS], strict=True):
            estimate = model.estimate(x + noise * rng.standard_normal(x.shape))
            _add(values, f"{100.0 * noise:g}", theta_error(estimate.theta, target, "raster"))
    return {"values": values}


def _add(values: Values, name: str, value: float) -> None:
    values.setdefault(name, []).append(float(value))
