"""Tables of a comparison: each measure over all folds, with a confidence interval by resampling whole folds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from paramove.documents import Floats
from studies.movements.measures import auroc

RESAMPLES = 400
INTERVAL = (2.5, 97.5)


class Measured(NamedTuple):
    """A value and the interval that holds 95 % of the resampled ones."""

    value: float
    low: float
    high: float


class Quantity(NamedTuple):
    """A column: what it is made of, its heading, its unit, and whether more is better."""

    name: str
    heading: str
    unit: str
    more_is_better: bool
    sources: tuple[str, ...]
    statistic: Callable[..., float]


def _mean(values: Floats) -> float:
    return float(values.mean())


def _percent(values: Floats) -> float:
    return float(100.0 * values.mean())


def _smallest_percent(values: Floats) -> float:
    return float(100.0 * values.min())


def _p95(values: Floats) -> float:
    return float(np.percentile(values, 95.0))


def _median(values: Floats) -> float:
    return float(np.median(values))


QUANTITIES = (
    Quantity("dtw", "RMS, warped", "cm", False, ("dtw",), _mean),
    Quantity("dtw_cut", "RMS, warped, without ends", "cm", False, ("dtw_cut",), _mean),
    Quantity("rms", "RMS, same fraction of time", "cm", False, ("rms",), _mean),
    Quantity("tip_rms", "fingertip RMS", "cm", False, ("tip_rms",), _mean),
    Quantity("end", "end-point miss", "cm", False, ("end",), _mean),
    Quantity("theta", "θ error, mean", "θ", False, ("theta",), _mean),
    Quantity("theta_median", "θ error, median", "θ", False, ("theta",), _median),
    Quantity("theta_p95", "θ error, 95 %", "θ", False, ("theta",), _p95),
    *(
        Quantity(f"theta_{percent}", f"θ error after {percent} %", "θ", False, (f"theta_{percent}",), _mean)
        for percent in (25, 50, 75)
    ),
    Quantity("covered_50", "50 % region covers", "%", True, ("covered_50",), _percent),
    Quantity("covered_80", "80 % region covers", "%", True, ("covered_80",), _percent),
    Quantity("covered", "95 % region covers", "%", True, ("covered",), _percent),
    Quantity("covered_set", "95 % region covers, worst fold", "%", True, ("covered_set",), _smallest_percent),
    Quantity("below_1", "genuine with p < 1 %", "%", False, ("below_1",), _percent),
    Quantity("below_5", "genuine with p < 5 %", "%", False, ("below_5",), _percent),
    Quantity("below_20", "genuine with p < 20 %", "%", False, ("below_20",), _percent),
    Quantity("correct", "right action", "%", True, ("correct",), _percent),
    *(
        Quantity(f"correct_{percent}", f"right after {percent} %", "%", True, (f"correct_{percent}",), _percent)
        for percent in (25, 50, 75, 100)
    ),
    Quantity("auroc_others", "AUROC other movements", "", True, ("score_genuine", "score_others"), auroc),
    Quantity("auroc_aborted", "AUROC aborted", "", True, ("score_genuine", "score_aborted"), auroc),
    Quantity("auroc_stopped", "AUROC stopped", "", True, ("score_genuine", "score_stopped"), auroc),
)

SECONDS = ("fit", "synthesize", "estimate", "classify", "classify_beginning")


def summarised(results: Sequence[dict[str, Any]]) -> dict[str, dict[str, dict[str, Any]]]:
    """task -> row -> {"measures": name -> Measured, "seconds": name -> minimum, "folds": number}."""
    grouped: dict[str, dict[str, list[dict[str, Any]]]] = {}
    for result in results:
        grouped.setdefault(result["task"], {}).setdefault(result["row"], []).append(result)
    return {task: {row: _row(own) for row, own in rows.items()} for task, rows in grouped.items()}


def _row(results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    measures = {}
    for quantity in QUANTITIES:
        if all(len(result["values"].get(source, [])) for result in results for source in quantity.sources):
            measures[quantity.name] = measured(results, quantity.sources, quantity.statistic)
    seconds = {
        name: float(np.min([result["seconds"][name] for result in results]))  # the first folds also compile
        for name in SECONDS
        if all(name in result["seconds"] for result in results)
    }
    return {"measures": measures, "seconds": seconds, "folds": len({result["fold"] for result in results})}


def measured(
    results: Sequence[dict[str, Any]], sources: Sequence[str], statistic: Callable[..., float], seed: int = 0
) -> Measured:
    """A statistic over the values of all folds, and its interval when folds are drawn again with replacement."""
    names = sorted({result["fold"] for result in results})
    by_fold = [
        [
            np.concatenate([np.asarray(result["values"][source]) for result in results if result["fold"] == name])
            for source in sources
        ]
        for name in names
    ]

    def over(folds: Sequence[int]) -> float:
        return statistic(*(np.concatenate([by_fold[fold][k] for fold in folds]) for k in range(len(sources))))

    rng = np.random.default_rng(seed)
    drawn = [over(rng.integers(0, len(names), len(names)).tolist()) for _ in range(RESAMPLES)]
    low, high = np.percentile(drawn, INTERVAL)
    return Measured(over(range(len(names))), float(low), float(high))
