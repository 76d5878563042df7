"""One method on one fold: everything it can do, measured."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from studies.movements.disturbed import aborted, stopped
from studies.movements.measures import covered, synthesis_errors, theta_error
from studies.movements.method import (
    BEGINNINGS,
    CLASSES,
    FRAMES,
    OUTLIERS,
    SYNTHESIS,
    THETA,
    THETA_OF_BEGINNINGS,
    Method,
)
from studies.movements.tasks import Fold

FRACTIONS = (0.25, 0.5, 0.75, 1.0)
"""Fractions of a movement, from its onset, after which its kind or theta is estimated."""
SHORTEST_BEGINNING = 5

REGIONS = {"covered_50": 0.5, "covered_80": 0.8, "covered": 0.95}
LEVELS = {"below_1": 0.01, "below_5": 0.05, "below_20": 0.2}

Numbers = dict[str, list[float]]


def able(method: Method, fold: Fold) -> bool:
    """Whether a method can do any of the tasks of a fold."""
    if not fold.several_actions:
        return bool(method.can & {SYNTHESIS, THETA, THETA_OF_BEGINNINGS, OUTLIERS})
    return (BEGINNINGS if fold.beginnings else CLASSES) in method.can


def measure(method: Method, fold: Fold) -> dict[str, Any]:
    """Fit and test. Per measure one value per test movement, and seconds: `fit`, and per question on average."""
    began = time.perf_counter()
    method.fit(fold.train)
    if fold.own is not None:
        method.adapt(fold.train, fold.own)
    seconds = {"fit": time.perf_counter() - began}
    values: Numbers = {}
    if fold.several_actions:
        _classification(method, fold, values, seconds)
    else:
        _single_action(method, fold, values, seconds)
    return {"task": fold.task, "fold": fold.name, "values": values, "seconds": seconds}


def _single_action(method: Method, fold: Fold, values: Numbers, seconds: dict[str, float]) -> None:
    if SYNTHESIS in method.can:
        began = time.perf_counter()
        made = {tuple(theta): method.synthesize(theta, FRAMES) for theta in fold.test.theta}
        seconds["synthesize"] = (time.perf_counter() - began) / len(made)
        for x, theta in zip(fold.test.sequences, fold.test.theta, strict=True):
            _add(values, synthesis_errors(made[tuple(theta)], x, fold.test.tip))
    if THETA in method.can:
        began = time.perf_counter()
        estimates = [method.estimate(x) for x in fold.test.sequences]
        seconds["estimate"] = (time.perf_counter() - began) / len(estimates)
        for estimate, theta in zip(estimates, fold.test.theta, strict=True):
            _add(values, {"theta": theta_error(estimate.theta, theta, fold.kind)})
            for name, fraction in REGIONS.items():
                inside = covered(estimate, theta, fraction)
                if inside is not None:
                    _add(values, {name: inside})
            if estimate.p_value is not None:
                _add(values, {name: float(estimate.p_value < level) for name, level in LEVELS.items()})
        if "covered" in values:
            values["covered_set"] = [float(np.mean(values["covered"]))]
    if THETA_OF_BEGINNINGS in method.can:
        for x, theta in zip(fold.test.sequences, fold.test.theta, strict=True):
            for fraction in FRACTIONS[:-1]:
                found = method.estimate_beginning(x[: max(SHORTEST_BEGINNING, round(fraction * len(x)))])
                _add(values, {f"theta_{round(100 * fraction)}": theta_error(found, theta, fold.kind)})
    if OUTLIERS in method.can:
        rng = np.random.default_rng(0)
        tests = fold.test.sequences
        for name, movements in (
            ("score_genuine", tests),
            ("score_aborted", [aborted(x) for x in tests]),
            ("score_stopped", [stopped(x, rng) for x in tests]),
            ("score_others", fold.others),
        ):
            values[name] = [float(method.score(x)) for x in movements]


def _classification(method: Method, fold: Fold, values: Numbers, seconds: dict[str, float]) -> None:
    began = time.perf_counter()
    if not fold.beginnings:
        answers = [method.classify(x, True) for x in fold.test.sequences]
        values["correct"] = [float(a == b) for a, b in zip(answers, fold.test.labels, strict=True)]
        seconds["classify"] = (time.perf_counter() - began) / len(answers)
        return
    for fraction in FRACTIONS:
        parts = [x[: max(2, round(fraction * len(x)))] for x in fold.test.sequences]
        answers = [method.classify(x, False) for x in parts]
        right = [float(a == b) for a, b in zip(answers, fold.test.labels, strict=True)]
        values[f"correct_{round(100 * fraction)}"] = right
    seconds["classify_beginning"] = (time.perf_counter() - began) / (len(FRACTIONS) * len(fold.test))


def _add(values: Numbers, measures: dict[str, float]) -> None:
    for name, value in measures.items():
        values.setdefault(name, []).append(float(value))
