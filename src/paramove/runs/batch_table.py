"""The runs of a batch as a table and as medians and totals."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import Any

from rich.table import Table

from paramove.runs.verdict_table import below

Column = tuple[str, tuple[str, ...], str, float | None]
"""Heading, keys in run.json, how the column is summed up, and the goal: no larger value, if there is one."""

COLUMNS: tuple[Column, ...] = (
    ("placed", ("objects_placed",), "total", None),
    ("grasps", ("grasps",), "total", None),
    ("first\ntry", ("grasps_first_try",), "total", None),
    ("calib.\ngrasps", ("calibration_grasps",), "total", None),
    ("first\ntry ", ("calibration_grasps_first_try",), "total", None),
    ("unw.\ncont.", ("unwanted_contacts",), "total", 0.0),
    ("penetr.\nmm", ("deepest_penetration_mm",), "max", 0.7),
    ("homogr.\nmm", ("homography_error_mm", "median"), "median", 3.0),
    ("max\nmm", ("homography_error_mm", "max"), "max", None),
    ("comm.\nmm", ("gripper_error_commanded_mm", "both", "max"), "max", 0.5),
    ("phys.\nmm", ("gripper_error_physical_mm", "both", "max"), "max", 2.0),
    ("lost", ("loss", "total"), "total", 0.0),
    ("sim.\ns", ("simulated_s",), "median", None),
    ("× real\ntime", ("wall", "realtime_factor"), "median", None),
)

POINTING_COLUMNS: tuple[Column, ...] = (
    ("pointed", ("pointings",), "total", None),
    ("right", ("pointings_right",), "total", None),
    ("error\nmm", ("pointing_error_mm", "median"), "median", None),
    ("max\nmm ", ("pointing_error_mm", "max"), "max", None),
    ("max of\nspacing", ("pointing_error_of_spacing", "max"), "max", None),
)
"""The same for runs in which pointing is tracked in action space."""

HULL_COLUMNS: tuple[tuple[str, str], ...] = (("inside\nhull", "inside"), ("outside\nhull", "outside"))
"""Heading, and which fetches: "succeeded/tried", by where they fetch."""

LEGEND = (
    "unw. cont.: contacts with anything but the handled object; penetr.: deepest penetration; homogr., max: the "
    "robot's own calibration; comm.: commanded gripper to its target; phys.: gripper to the commanded one, both the "
    "largest while grasping and placing; inside, outside hull: relocations that succeeded of those tried, by whether "
    "the object is fetched within the convex hull of the targets that the movement model was trained with; pointed, "
    "right: pointings that were tracked, and those whose object was recognised, with the error of the target, also "
    "as a fraction of the distance to the next object; yellow: not within its goal"
)
NEEDED_FRACTION = 0.9
TABLE_WIDTH = 140
"""On a narrower terminal the rows are broken by the terminal."""


def value_of(result: dict[str, Any], keys: Sequence[str]) -> float | None:
    """A number of a result; None where it is not known."""
    value: Any = result
    for key in keys:
        value = value.get(key) if isinstance(value, dict) else None
    return value if isinstance(value, int | float) else None


def totals_of(results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Counts, and for each column its total, median or largest value, under the path of its keys."""
    succeeded = sum(bool(result.get("success")) for result in results)
    totals: dict[str, Any] = {"runs": len(results), "succeeded": succeeded, "needed_share": NEEDED_FRACTION}
    for _, keys, statistic, _ in columns_of(results):
        values = [value for result in results if (value := value_of(result, keys)) is not None]
        totals[f"{'.'.join(keys)} ({statistic})"] = _summed_up(values, statistic) if values else None
    return totals | {"training_hull.from": {where: _hull_total(results, where) for _, where in HULL_COLUMNS}}


def columns_of(results: Sequence[dict[str, Any]]) -> tuple[Column, ...]:
    """The columns that these results fill."""
    tracked = any("pointings" in result for result in results)
    return (*COLUMNS, *POINTING_COLUMNS) if tracked else COLUMNS


def _hull_total(results: Sequence[dict[str, Any]], where: str) -> dict[str, int]:
    """Of all runs, and of runs with such relocations: in how many there were any, and in how many all succeeded."""
    counts = [count for result in results if (count := hull_counts(result, where)) is not None]
    some = [count for count in counts if count["tried"] + count["refused"] > 0]
    total = {key: sum(count[key] for count in counts) for key in ("tried", "succeeded", "refused")}
    whole = sum(count["succeeded"] == count["tried"] > 0 for count in some)
    return total | {"runs": len(some), "runs_all_succeeded": whole}


def hull_counts(result: dict[str, Any], where: str) -> dict[str, int] | None:
    """Counts of the relocations that fetch there; None in results of earlier releases."""
    found = result.get("training_hull", {}).get("from", {}).get(where)
    return found if isinstance(found, dict) else None


def _succeeded_of_tried(counts: dict[str, int] | None) -> str:
    return "–" if counts is None else f"{counts['succeeded']}/{counts['tried']}"


def _summed_up(values: Sequence[float], statistic: str) -> float:
    if statistic == "total":
        return sum(values)
    return median(values) if statistic == "median" else max(values)


def enough(results: Sequence[dict[str, Any]]) -> bool:
    """Whether 9 of 10 runs succeeded."""
    return sum(bool(result.get("success")) for result in results) >= NEEDED_FRACTION * len(results) > 0


def table_of(results: Sequence[dict[str, Any]]) -> Table:
    """One row per seed, and a last one that sums up."""
    table = Table(show_edge=False, pad_edge=False, show_footer=True)
    totals = totals_of(results)
    table.add_column("seed", justify="right", footer="all")
    table.add_column("success", footer=f"{totals['succeeded']}/{totals['runs']}")
    for heading, where in HULL_COLUMNS:
        table.add_column(heading, justify="right", footer=_succeeded_of_tried(totals["training_hull.from"][where]))
    columns = columns_of(results)
    for heading, keys, statistic, _ in columns:
        foot = totals[f"{'.'.join(keys)} ({statistic})"]
        footer = f"{short(foot)}\n{statistic}" if foot is not None else "–"
        table.add_column(heading, justify="right", footer=footer)
    for result in sorted(results, key=lambda item: int(item["seed"])):
        verdict = "[green]yes[/]" if result.get("success") else "[red]no[/]"
        cells = [_cell(value_of(result, keys), limit) for _, keys, _, limit in columns]
        hulls = [_succeeded_of_tried(hull_counts(result, where)) for _, where in HULL_COLUMNS]
        table.add_row(str(result["seed"]), verdict, *hulls, *cells)
    return table


def short(value: float | None) -> str:
    """A number with few digits."""
    if value is None:
        return "–"
    if isinstance(value, int):
        return str(value)
    return f"{value:.0f}" if value >= 100 else f"{value:.2f}"


def _cell(value: float | None, limit: float | None) -> str:
    return short(value) if limit is None or below(value, limit) else f"[yellow]{short(value)}[/]"
