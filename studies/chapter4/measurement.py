"""What one kind of model, trained on one seed's movements, makes of the tests (4.2.4, 4.2.5)."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from paramove.alignment import movement_distance
from paramove.documents import Floats
from paramove.hmm import Path
from paramove.phmm import InterpolativePHMM, MovementClassifier, NeuralPHMM, ParametricHMM, PolynomialPHMM
from studies.chapter4.kinds import BY_NAME, Kind
from studies.chapter4.raster import (
    ACTIONS,
    COMPARED_SAMPLES,
    REPETITIONS,
    Raster,
    Shown,
    raster,
    redirects,
    references,
)
from studies.chapter4.unfinished import aborted, stopped
from studies.movements.measures import covered, theta_error
from studies.movements.method import Estimate

Values = dict[str, list[float]]

NOISES_M = (0.0, 0.05, 0.10, 0.15, 0.20)


def measured_kind(name: str, states: int, seed: int, every: int = 1) -> dict[str, Any]:
    """All measures of one kind of model; with `every` only each so many-th repetition of the tests is asked."""
    kind, shown = BY_NAME[name], raster(seed)
    began = time.perf_counter()
    models: dict[str, ParametricHMM] = {action: trained(kind, states, shown.train[action]) for action in ACTIONS}
    seconds = {"fit": (time.perf_counter() - began) / len(ACTIONS)}
    values: Values = {}
    for action, model in models.items():
        averages, places = references(seed, action), shown.test[action].places
        values[f"synthesis_{action}"] = synthesis_errors(model, averages, places)
        values[f"linear_{action}"] = synthesis_errors(model, averages, places, "linear")
    began = time.perf_counter()
    _classified(models, shown, every, values)
    seconds["classify"] = (time.perf_counter() - began) / len(values["correct"])
    _unfinished(models, shown, seed, every, values)
    durations = {}
    if isinstance(models["reaching"], InterpolativePHMM):
        corners = (models["reaching"].at(theta) for theta in ((0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)))
        durations = {"durations": [model.expected_durations().tolist() for model in corners]}
    hidden = [model.n_hidden_ for model in models.values() if isinstance(model, NeuralPHMM)]
    return {"values": values, "seconds": seconds, **durations, **({"hidden": hidden} if hidden else {})}


def trained(kind: Kind, states: int, shown: Shown) -> ParametricHMM:
    """A model of one action."""
    chosen = shown.at_corners() if kind.corners else shown
    return kind.untrained(states).fit(chosen.sequences, chosen.places)


def synthesis_errors(model: ParametricHMM, averages: Floats, places: Floats, path: Path = "smooth") -> list[float]:
    """Distance (4.3) of the prototype for each place from the average of the movements to it, cm.

    path "linear": straight lines between the means, as in the thesis.
    """
    return [
        100.0 * movement_distance(model.synthesize(place, COMPARED_SAMPLES, path=path), average)
        for place, average in zip(places[::REPETITIONS], averages, strict=True)
    ]


def _classified(models: Mapping[str, ParametricHMM], shown: Raster, every: int, values: Values) -> None:
    """Parameters, their regions, the action, and the score of movements of the model's and of the other action."""
    classifier = MovementClassifier.from_models(models)
    for action, other in zip(ACTIONS, ACTIONS[::-1], strict=True):
        tests = shown.test[action]
        for x, place in zip(tests.sequences[::every], tests.places[::every], strict=True):
            found = classifier.classify(x)
            estimate = Estimate(found.estimates[action].theta, found.estimates[action].covariance)
            _add(values, f"theta_{action}", theta_error(estimate.theta, place, "raster"))
            _add(values, f"covered_{action}", covered(estimate, place) or 0.0)
            _add(values, "correct", float(found.action == action))
            _add(values, f"score_genuine_{action}", score(models[action], x, found.estimates[action].log_likelihood))
            _add(values, f"score_action_{other}", score(models[other], x, found.estimates[other].log_likelihood))


def _unfinished(models: Mapping[str, ParametricHMM], shown: Raster, seed: int, every: int, values: Values) -> None:
    """Scores of movements that are none of the model's: not finished, or to two places one after the other."""
    rng = np.random.default_rng([seed, 4])
    step = max(every, REPETITIONS)
    different = redirects(seed)[:: step // REPETITIONS]
    for action, model in models.items():
        tests = shown.test[action].sequences[::step]
        values[f"score_aborted_{action}"] = [score(model, aborted(x, rng)) for x in tests]
        values[f"score_stopped_{action}"] = [score(model, stopped(x, rng)) for x in tests]
        values[f"score_redirect_{action}"] = [score(model, x) for x in different]


def score(model: ParametricHMM, x: Floats, log_likelihood: float | None = None) -> float:
    """How well a movement fits a model: the likelihood of the thesis (2.2.5), or minus the outlier score."""
    if isinstance(model, PolynomialPHMM) and model.performances_ is not None:
        return -float(model.examine(x).outlier_score)
    return float(model.estimate(x).log_likelihood) if log_likelihood is None else log_likelihood


def measured_noise(name: str, states: int, seed: int) -> dict[str, Any]:
    """Error of theta of pointing, cm, when Gaussian noise is added to every coordinate of every frame (4.2.5)."""
    shown = raster(seed)
    model = trained(BY_NAME[name], states, shown.train["pointing"])
    tests = shown.test["pointing"]
    values: Values = {}
    for noise in NOISES_M:
        rng = np.random.default_rng([seed, 5])
        for x, place in zip(tests.sequences[::REPETITIONS], tests.places[::REPETITIONS], strict=True):
            found = model.estimate(x + noise * rng.standard_normal(x.shape))
            _add(values, f"{100.0 * noise:g}", theta_error(found.theta, place, "raster"))
    return {"values": values}


def _add(values: Values, name: str, value: float) -> None:
    values.setdefault(name, []).append(float(value))
