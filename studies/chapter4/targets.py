"""The goals for the models of chapter 4, and whether they are met."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from studies.chapter4.kinds import IPHMM_3, OURS
from studies.chapter4.redirect import FEWEST
from studies.chapter4.summary import Interval


class Target(NamedTuple):
    """A goal: what, how much, what was measured, which case that is, and whether the goal is met."""

    what: str
    wanted: str
    measured: str
    of: str
    met: bool


def targets_of(summary: dict[str, Any]) -> list[Target]:
    """All goals. Where several models and numbers of states are meant, the worst of them counts."""
    full = [row for row in summary["models"] if "2×2" not in row["name"]]
    trusted = [row for row in full if OURS in row["name"]]
    linear, quadratic = ([row for row in full if row["name"].startswith(start)] for start in ("LPHMM", "QPHMM"))
    interpolative = [row for row in full if row["name"] == IPHMM_3]
    return [
        _at_most("error of θ, LPHMM", linear, "theta", 1.2),
        _at_most("error of θ, QPHMM", quadratic, "theta", 1.2),
        _at_most("error of θ, IPHMM 3×3", interpolative, "theta", 1.5),
        _at_most("synthesis, IPHMM 3×3", interpolative, "synthesis_pointing", 1.7),
        _at_most("synthesis, QPHMM", quadratic, "synthesis_pointing", 1.7),
        *_classification(summary, full),
        *_coverage(trusted),
        _at_least("AUROC, the other action", trusted, "action", 0.99),
        _at_least("AUROC, redirect movements", trusted, "redirect", 0.99),
        _at_least("AUROC, aborted", trusted, "aborted", 0.99),
        _at_least("AUROC, stopped", trusted, "stopped", 0.90),
        _jerk(summary["redirect"]),
    ]


def _at_most(what: str, rows: list[dict[str, Any]], measure: str, limit: float) -> Target:
    worst = max(rows, key=_mean(measure))
    value = worst[measure].mean
    return Target(
        what, f"≤ {limit:g} cm", f"{value:.2f} cm{_of_seeds(worst[measure], 2)}", _case(worst), bool(value <= limit)
    )


def _at_least(what: str, rows: list[dict[str, Any]], measure: str, limit: float) -> Target:
    worst = min(rows, key=_mean(measure))
    value = worst[measure].mean
    measured = f"{value:.3f}{_of_seeds(worst[measure], 3)}"
    return Target(what, f"≥ {limit:.2f}", measured, _case(worst), bool(value >= limit))


def _classification(summary: dict[str, Any], rows: list[dict[str, Any]]) -> list[Target]:
    worst, best = min(rows, key=_mean("correct")), max(rows, key=_mean("correct"))
    targets = [
        Target(
            "right action, best", "≥ 0.960", f"{best['correct'].mean:.3f}", _case(best), best["correct"].mean >= 0.96
        )
    ]
    peer = summary["classification"]["hmmlearn"]
    if peer is None:
        return targets
    above = peer.mean if np.isnan(peer.high) else peer.high
    below = worst["correct"].mean if np.isnan(worst["correct"].low) else worst["correct"].low
    return [
        Target(
            "right action, every 3×3 model",
            f"its interval above hmmlearn's (up to {above:.3f})",
            f"from {below:.3f}",
            _case(worst),
            bool(below > above),
        ),
        *targets,
    ]


def _coverage(rows: list[dict[str, Any]]) -> list[Target]:
    minimum, maximum = min(rows, key=_mean("covered")), max(rows, key=_mean("covered"))
    low, high = minimum["covered"], maximum["covered"]
    return [
        Target("95 % regions cover, least", "≥ 85 %", _percent(low), _case(minimum), low.mean >= 0.85),
        Target("95 % regions cover, most", "≤ 99 %", _percent(high), _case(maximum), high.mean <= 0.99),
    ]


def _percent(value: Interval) -> str:
    return f"{100 * value.mean:.1f} %{_of_seeds(value, 1, 100.0)}"


def _of_seeds(value: Interval, digits: int, scale: float = 1.0) -> str:
    """How single seeds differ: a mean at its bound is met with some of them and missed with others."""
    if value.seeds < 2:
        return ""
    return f" (seeds: {scale * value.minimum:.{digits}f} to {scale * value.maximum:.{digits}f})"


def _jerk(rows: list[dict[str, Any]]) -> Target:
    own = [row for row in rows if row["training"] == FEWEST]
    worst = max(own, key=lambda row: float(row["most_jerk"]))
    value = float(worst["most_jerk"])
    case = f"{worst['model']}, worst of {worst['jerk'].seeds} seeds"
    return Target("jerk of redirect, 9 demonstrations", "≤ 1.2 × training's", f"{value:.2f}", case, value <= 1.2)


def _mean(measure: str) -> Callable[[dict[str, Any]], float]:
    return lambda row: float(row[measure].mean)


def _case(row: dict[str, Any]) -> str:
    return f"{row['name']}, {row['states']} states"
