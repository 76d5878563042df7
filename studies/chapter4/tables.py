"""The tables of the report on chapter 4, as HTML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from paramove.documents import table
from studies.chapter4.findings import THESIS_CLASSIFICATION, THESIS_VARIATION, Finding
from studies.chapter4.summary import UNTYPICAL, Interval
from studies.chapter4.targets import Target

MARKS = {
    "yes": "<span class=yes>yes</span>",
    "in part": "<span class=soft>in part</span>",
    "no": "<span class=no>no</span>",
}


def targets_table(targets: Sequence[Target]) -> str:
    """Goals: required, measured, met."""
    rows = [(*map(escape, target[:4]), MARKS["yes" if target.met else "no"]) for target in targets]
    return table(("goal", "required", "measured", "of", "met"), rows)


def findings_table(findings: Sequence[Finding]) -> str:
    """What the thesis observed, and what is observed here."""
    rows = [(*map(escape, finding[:3]), MARKS[finding.verdict]) for finding in findings]
    return table(("where", "the thesis", "here", "the same"), rows)


def models_table(summary: Mapping[str, Any]) -> str:
    """Errors and rates of all models, the thesis's rates of table 4.1 in a column."""
    rows: list[tuple[str, ...]] = [
        (
            str(row["states"]),
            escape(row["name"]),
            interval(row["synthesis_pointing"]),
            interval(row["linear_pointing"]),
            interval(row["synthesis_reaching"]),
            interval(row["theta_pointing"]),
            interval(row["theta_reaching"]),
            interval(row["correct"], 3),
            _rate(THESIS_CLASSIFICATION.get((row["states"], row["name"]))),
            f"{row['fit'].mean:.2f}",
            f"{1000.0 * row['classify'].mean:.1f}",
        )
        for row in summary["models"]
    ]
    for name, rate in summary["classification"].items():
        if rate is not None:
            rows.append(("20", escape(NAMES[name]), *["–"] * 5, interval(rate, 3), "–", "–", "–"))
    heads = (
        *("states", "model", "synthesis, cm", "with straight lines, as the thesis", "synthesis, reaching"),
        *("θ, pointing, cm", "θ, reaching, cm", "right of 280", "thesis, table 4.1", "learn, s", "classify, ms"),
    )
    return table(heads, rows, numbers=(0, *range(2, 11)))


NAMES = {"hmmlearn": "hmmlearn, diagonal covariances, no θ", "plain HMM": "HMM, full covariances, no θ"}


def rejection_table(summary: Mapping[str, Any]) -> str:
    """Coverage and AUROC of all models."""
    rows = [
        (
            str(row["states"]),
            escape(row["name"]),
            interval(_percent(row["covered"]), 1),
            *(interval(row[name], 3) for name in UNTYPICAL),
        )
        for row in summary["models"]
    ]
    heads = ("states", "model", "95 % region covers, %", "AUROC, the other action", *UNTYPICAL[1:])
    return table(heads, rows, numbers=(0, *range(2, 7)))


def learning_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Errors over the numbers of targets and repetitions."""
    cells = [
        (
            escape(row["name"]),
            str(row["side"] ** 2),
            str(row["repetitions"]),
            str(row["demonstrations"]),
            interval(row["synthesis"]),
            interval(row["theta"]),
        )
        for row in sorted(rows, key=lambda row: (row["name"], row["side"], row["repetitions"]))
    ]
    return table(
        ("model", "targets", "repetitions", "demonstrations", "synthesis, cm", "θ, cm"), cells, numbers=range(1, 6)
    )


def variation_table(variation: Mapping[str, Any]) -> str:
    """The demonstrator compared with the thesis's person."""
    rows = [
        (escape(name), interval(one), f"{THESIS_VARIATION[name]:g}" if name in THESIS_VARIATION else "–")
        for name, one in variation.items()
    ]
    return table(("", "here", "thesis"), rows, numbers=(1, 2))


def redirect_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Errors and jerk of the redirect action."""
    cells = [
        (
            escape(row["training"]),
            escape(row["model"]),
            interval(row["error"]),
            interval(row["start_miss"]),
            interval(row["end_miss"]),
            interval(row["jerk"]),
            f"{row['most_jerk']:.2f}",
        )
        for row in rows
    ]
    heads = (
        *("learned from", "model", "error (4.3), cm", "misses the first target, cm", "the second, cm"),
        *("jerk ratio", "maximum"),
    )
    return table(heads, cells, numbers=range(2, 7))


def interval(value: Interval | None, digits: int = 2) -> str:
    """A mean and its interval."""
    if value is None:
        return "–"
    if np.isnan(value.low):
        return f"{value.mean:.{digits}f}"
    return f"{value.mean:.{digits}f} <span class=soft>[{value.low:.{digits}f}, {value.high:.{digits}f}]</span>"


def _percent(value: Interval) -> Interval:
    return value._replace(mean=100.0 * value.mean, low=100.0 * value.low, high=100.0 * value.high)


def _rate(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"
