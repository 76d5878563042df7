"""The runs of a batch as a table and as medians and totals."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import Any

from rich.table import Table

from paramove.evaluation.verdict_table import below

COLUMNS: tuple[tuple[str, tuple[str, ...], str], ...] = (
    ("placed", ("objects_placed",), "total"),
    ("grasps", ("grasps",), "total"),
    ("first try", ("grasps_first_try",), "total"),
    ("calib. grasps", ("calibration_grasps",), "total"),
    ("first try ", ("calibration_grasps_first_try",), "total"),
    ("unwanted contacts", ("unwanted_contacts",), "total"),
    ("penetr. mm", ("deepest_penetration_mm",), "max"),
    ("homogr. mm", ("homography_error_mm", "median"), "median"),
    ("max", ("homography_error_mm", "max"), "max"),
    ("commanded mm", ("gripper_error_commanded_mm", "both", "max"), "max"),
    ("physical mm", ("gripper_error_physical_mm", "both", "max"), "max"),
    ("lost", ("loss", "total"), "total"),
    ("simulated s", ("simulated_s",), "median"),
    ("× real time", ("wall", "realtime_factor"), "median"),
)
"""Heading, keys in run.json, and how the column is summed up."""

NEEDED_SHARE = 0.9


def value_of(result: dict[str, Any], keys: Sequence[str]) -> float | None:
    """A number of a result; None where it is not known."""
    found: Any = result
    for key in keys:
        found = found.get(key) if isinstance(found, dict) else None
    return found if isinstance(found, int | float) else None


def totals_of(results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Counts, and for each column its total, median or largest value, under the path of its keys."""
    succeeded = sum(bool(result.get("success")) for result in results)
    found: dict[str, Any] = {"runs": len(results), "succeeded": succeeded, "needed_share": NEEDED_SHARE}
    for _, keys, way in COLUMNS:
        values = [value for result in results if (value := value_of(result, keys)) is not None]
        found[f"{'.'.join(keys)} ({way})"] = _summed_up(values, way) if values else None
    return found


def _summed_up(values: Sequence[float], way: str) -> float:
    if way == "total":
        return sum(values)
    return median(values) if way == "median" else max(values)


def enough(results: Sequence[dict[str, Any]]) -> bool:
    """Whether 9 of 10 runs succeeded."""
    return sum(bool(result.get("success")) for result in results) >= NEEDED_SHARE * len(results) > 0


def table_of(results: Sequence[dict[str, Any]]) -> Table:
    """One row per seed, and a last one that sums up."""
    table = Table(show_edge=False, pad_edge=False, show_footer=True)
    totals = totals_of(results)
    table.add_column("seed", justify="right", footer="all")
    table.add_column("success", footer=f"{totals['succeeded']}/{totals['runs']}")
    for heading, keys, way in COLUMNS:
        foot = totals[f"{'.'.join(keys)} ({way})"]
        footer = f"{shown(foot)}\n{way}" if foot is not None else "–"
        table.add_column(heading, justify="right", footer=footer)
    for result in sorted(results, key=lambda item: int(item["seed"])):
        verdict = "[green]yes[/]" if result.get("success") else "[red]no[/]"
        cells = [_cell(heading, value_of(result, keys)) for heading, keys, _ in COLUMNS]
        table.add_row(str(result["seed"]), verdict, *cells)
    return table


def shown(value: float | None) -> str:
    """A number as short as it may be."""
    if value is None:
        return "–"
    if isinstance(value, int):
        return str(value)
    return f"{value:.0f}" if value >= 100 else f"{value:.2f}"


_LIMITS = {
    "unwanted contacts": 0.0,
    "penetr. mm": 0.7,
    "homogr. mm": 3.0,
    "commanded mm": 0.5,
    "physical mm": 2.0,
    "lost": 0.0,
}


def _cell(heading: str, value: float | None) -> str:
    limit = _LIMITS.get(heading)
    return shown(value) if limit is None or below(value, limit) else f"[yellow]{shown(value)}[/]"
