"""The verdict of a run as a table in the terminal."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

from paramove.runs.after_a_run import verdict


def show_verdict(summary: dict[str, Any], console: Console) -> None:
    """Print the verdict, and the main numbers with their goals."""
    console.print(
        f"\n{verdict(summary['success'])}: {summary['objects_placed']} of {len(summary['rules'])} objects rest "
        f"in their own opening after {summary['simulated_s']:.0f} s of simulated time",
        soft_wrap=True,
    )
    if not summary["success"]:
        console.print(summary["reason"], markup=False, soft_wrap=True)
    table = Table(show_edge=False, pad_edge=False)
    table.add_column("what")
    table.add_column("result", justify="right")
    table.add_column("goal", justify="right", style="dim")
    for name, result, goal, good in rows_of(summary):
        table.add_row(name, result if good else f"[yellow]{result}[/]", goal)
    console.print(table)
    for rule in summary["rules"]:
        mark = "[green]✓[/]" if rule["right"] else "[red]✗[/]"
        console.print(mark, f"“{rule['sentence'] or rule['object'] + ': nothing learnt'}”", style="dim", soft_wrap=True)


def rows_of(summary: dict[str, Any]) -> list[tuple[str, str, str, bool]]:
    """Name, result, goal, and whether it is met."""
    homography = summary["homography_error_mm"]
    rules = [rule["error_mm"] for rule in summary["rules"]]
    factor = summary["wall"]["realtime_factor"]
    return [
        (
            "rules learnt",
            f"{sum(rule['right'] for rule in summary['rules'])} of {len(rules)}",
            "all",
            all(rule["right"] for rule in summary["rules"]),
        ),
        ("farthest rule from its opening", mm(max((e for e in rules if e is not None), default=None)), "< 14 mm", True),
        (
            "grasps, at first try",
            f"{summary['grasps']}, {summary['grasps_first_try']}",
            "3, 3",
            summary["grasps"] == summary["grasps_first_try"] > 0,
        ),
        *_pointing_rows(summary),
        ("unwanted contacts", str(summary["unwanted_contacts"]), "0", summary["unwanted_contacts"] == 0),
        (
            "deepest penetration",
            mm(summary["deepest_penetration_mm"]),
            "≤ 0.7 mm",
            summary["deepest_penetration_mm"] <= 0.7,
        ),
        (
            "homography error, median (max)",
            f"{mm(homography['median'])} ({mm(homography['max'])})",
            "≤ 3 mm",
            below(homography["median"], 3.0),
        ),
        *_gripper_rows(summary),
        ("messages lost", str(summary["loss"]["total"]), "0", summary["loss"]["total"] == 0),
        *(
            (f"not recorded ({gap['recording']})", f"{gap['begin_s']:.2f} to {gap['end_s']:.2f} s", "", False)
            for gap in summary["gaps"]
        ),
        ("times real time", "–" if factor is None else f"{factor:.1f}", "", True),
    ]


def _gripper_rows(summary: dict[str, Any]) -> list[tuple[str, str, str, bool]]:
    """Of a robot whose wire messages are recorded."""
    errors = (
        ("gripper: commanded to target, max", summary["gripper_error_commanded_mm"]["both"]["max"], 0.5),
        ("gripper: in the world to commanded, max", summary["gripper_error_physical_mm"]["both"]["max"], 2.0),
    )
    known = [(name, value, goal) for name, value, goal in errors if value is not None]
    return [(name, mm(value), f"< {goal:g} mm", below(value, goal)) for name, value, goal in known]


def _pointing_rows(summary: dict[str, Any]) -> list[tuple[str, str, str, bool]]:
    """With tracking in action space: the estimated targets of the arm."""
    if "pointings" not in summary:
        return []
    count, right, unrequested = summary["pointings"], summary["pointings_right"], len(summary["unasked_fetches"])
    error, of_spacing = summary["pointing_error_mm"], summary["pointing_error_of_spacing"]
    return [
        ("pointings, object recognised", f"{count}, {right}", "all", count == right > 0),
        ("fetched without being pointed at", str(unrequested), "0", unrequested == 0),
        ("error of pointing, median (max)", f"{mm(error['median'])} ({mm(error['max'])})", "", True),
        (
            "of the spacing of the objects",
            f"{percent(of_spacing['median'])} ({percent(of_spacing['max'])})",
            "< 50 %",
            below(of_spacing["max"], 0.5) or not of_spacing["samples"],
        ),
    ]


def percent(value: float | None) -> str:
    """A fraction in per cent; a dash where there is none."""
    return "–" if value is None else f"{100 * value:.0f} %"


def below(value: float | None, limit: float) -> bool:
    """Whether a value is known and not above a limit."""
    return value is not None and value <= limit


def mm(value: float | None) -> str:
    """A length in mm; a dash where there is none."""
    return "–" if value is None else f"{value:.2f} mm"
