"""The numbers of chapter 4: means over seeds with their intervals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import t as student

from paramove.documents import Floats
from studies.chapter4.experiments import (
    FIT,
    HMMLEARN,
    LEARNING,
    LINE,
    MODELS,
    NOISE,
    PLAIN,
    REDIRECT,
    VARIATION,
)
from studies.chapter4.grid import ACTIONS
from studies.chapter4.variation import CORNERS
from studies.movements.measures import auroc

Results = Sequence[dict[str, Any]]

UNTYPICAL = ("action", "redirect", "aborted", "stopped")
MEASURES = (
    *("synthesis_pointing", "synthesis_reaching", "linear_pointing", "linear_reaching"),
    *("theta_pointing", "theta_reaching", "theta", "covered", "correct"),
    *UNTYPICAL,
)
FRACTIONS = ("covered", "correct", *UNTYPICAL)


class Interval(NamedTuple):
    """Mean over seeds, and the interval that holds the true mean with 95 % (Student's t; NaN with one seed).

    Attributes:
        minimum, maximum: of single seeds.
    """

    mean: float
    low: float
    high: float
    seeds: int
    minimum: float
    maximum: float


def over_seeds(values: Iterable[float], *, fraction: bool = False) -> Interval:
    """From one value per seed; the interval of fractions ends at 0 and 1."""
    each = np.array(list(values))
    mean, count = float(each.mean()), len(each)
    ends = float(each.min()), float(each.max())
    if count < 2:
        return Interval(mean, float("nan"), float("nan"), count, *ends)
    half = float(student.ppf(0.975, count - 1) * each.std(ddof=1) / np.sqrt(count))
    low, high = (max(0.0, mean - half), min(1.0, mean + half)) if fraction else (mean - half, mean + half)
    return Interval(mean, low, high, count, *ends)


def of_group(results: Results, group: str, **labels: Any) -> list[dict[str, Any]]:
    """Results of one part with given labels."""
    return [
        one for one in results if one["group"] == group and all(one[name] == value for name, value in labels.items())
    ]


def summarised(results: Results) -> dict[str, Any]:
    """All numbers as plain JSON; intervals as [mean, low, high, seeds, minimum, maximum]."""
    return {
        "models": _models(results),
        "classification": {
            "hmmlearn": _mean_of(of_group(results, HMMLEARN), "correct"),
            "plain HMM": _mean_of(of_group(results, PLAIN), "correct"),
        },
        "noise": _by_name(of_group(results, NOISE), lambda one: {k: float(np.mean(v)) for k, v in one.items()}),
        "learning": _learning(of_group(results, LEARNING)),
        "fit to averages": _by_name_values(of_group(results, FIT)),
        "variation": _variation(of_group(results, VARIATION)),
        "line": _line(of_group(results, LINE)),
        "redirect": _redirect(of_group(results, REDIRECT)),
    }


def _models(results: Results) -> list[dict[str, Any]]:
    models = of_group(results, MODELS)
    rows = []
    for states, name in dict.fromkeys((one["states"], one["name"]) for one in models):
        own = of_group(models, MODELS, states=states, name=name)
        each = [measures_of(one["values"]) for one in own]
        rows.append(
            {
                "name": fitted_name(name, own),
                "states": states,
                **{
                    measure: over_seeds((one[measure] for one in each), fraction=measure in FRACTIONS)
                    for measure in MEASURES
                },
                **{name: over_seeds(one["seconds"][name] for one in own) for name in ("fit", "classify")},
            }
        )
    order = list(dict.fromkeys(row["name"] for row in rows))
    return sorted(rows, key=lambda row: (row["states"], order.index(row["name"])))


def fitted_name(name: str, results: Results) -> str:
    """A model's name with what was fitted: cross-validation chooses a network's hidden units, and may choose none."""
    units = sorted({number for one in results for number in one.get("hidden", ())})
    if not units:
        return name
    if units == [0]:
        return f"{name} (no hidden unit: a quadratic)"
    return f"{name} ({units[0]} to {units[-1]} hidden units)"


def measures_of(values: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """The measures of one model and seed: lengths in cm, fractions, AUROC as the mean of both actions."""
    measures = {name: float(np.mean(values[name])) for name in MEASURES if name in values}
    measures["theta"] = float(np.mean([measures[f"theta_{action}"] for action in ACTIONS]))
    measures["covered"] = float(np.mean([values[f"covered_{action}"] for action in ACTIONS]))
    for kind in UNTYPICAL:
        measures[kind] = float(
            np.mean(
                [
                    auroc(np.array(values[f"score_genuine_{action}"]), np.array(values[f"score_{kind}_{action}"]))
                    for action in ACTIONS
                ]
            )
        )
    return measures


def surface(results: Results, name: str, states: int, measure: str) -> Floats:
    """Mean over seeds (and over the tests to a target) of a measure at each of the 7 x 5 targets. Shape (7, 5)."""
    own = of_group(results, MODELS, states=states, name=name)
    values = np.mean([np.asarray(one["values"][measure]) for one in own], axis=0)
    by_target = values.reshape(35, -1) if len(values) % 35 == 0 else np.full((35, 1), np.nan)
    return np.asarray(by_target.mean(axis=1).reshape(7, 5))


def _learning(results: Results) -> list[dict[str, Any]]:
    keys = dict.fromkeys((one["name"], one["side"], one["repetitions"]) for one in results)
    return [
        {
            "name": name,
            "side": side,
            "repetitions": repetitions,
            "demonstrations": side**2 * repetitions,
            **{
                measure: _mean_of(of_group(results, LEARNING, name=name, side=side, repetitions=repetitions), measure)
                for measure in ("synthesis", "theta")
            },
        }
        for name, side, repetitions in keys
    ]


def _variation(results: Results) -> dict[str, Any]:
    corners = [f"corner {corner}" for corner in CORNERS]
    worst = [max((one["values"][name] for name in corners), key=np.mean) for one in results]
    return {
        "pairs at the centre": _mean_of(results, "centre"),
        "their deviation": over_seeds(float(np.std(one["values"]["centre"])) for one in results),
        "pairs at the worst corner": over_seeds(float(np.mean(one)) for one in worst),
        "deviation there": over_seeds(float(np.std(one)) for one in worst),
        "miss at the centre": _mean_of(results, "miss"),
        "prototype from averages": _mean_of(results, "prototype"),
    }


def _line(results: Results) -> dict[str, Any]:
    names = results[0]["values"]
    return {name: over_seeds(float(np.max(one["values"][name])) for one in results) for name in names} | {
        "training, s": over_seeds(one["seconds"]["fit"] for one in results)
    }


def _redirect(results: Results) -> list[dict[str, Any]]:
    rows = [row for one in results for row in one["rows"]]
    summary = []
    for training, model in dict.fromkeys((row["training"], row["model"]) for row in rows):
        own = [row for row in rows if (row["training"], row["model"]) == (training, model)]
        summary.append(
            {
                "training": training,
                "model": model,
                "jerk": over_seeds(row["jerk_ratio"] for row in own),
                "most_jerk": max(row["jerk_ratio"] for row in own),
                **{
                    name: over_seeds(row[f"{name}_cm"]["mean"] for row in own)
                    for name in ("error", "start_miss", "end_miss")
                },
            }
        )
    return summary


def _mean_of(results: Results, measure: str) -> Interval | None:
    return over_seeds(float(np.mean(one["values"][measure])) for one in results) if results else None


def _by_name(results: Results, reduced: Callable[[Mapping[str, Any]], dict[str, float]]) -> dict[str, Any]:
    names = dict.fromkeys(one["name"] for one in results)
    intervals = {}
    for name in names:
        each = [reduced(one["values"]) for one in results if one["name"] == name]
        intervals[name] = {key: over_seeds(one[key] for one in each) for key in each[0]}
    return intervals


def _by_name_values(results: Results) -> dict[str, Any]:
    return {name: _mean_of(results, name) for name in results[0]["values"]}
