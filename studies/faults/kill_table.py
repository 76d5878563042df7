"""The results of an evaluation by kills as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.table import Table
from rich.text import Text

LEGEND = (
    "reported: from the signal to the launcher's log; restarted, ready: from the signal to the new process and to its "
    "report that it is ready; ended: to the end of the whole run; step: largest step of any joint in a millisecond, in "
    "the firmware's own log of the whole run, as a fraction of the allowed one; pace: simulated seconds per second"
)
_NUMBERS = (
    ("reported\nms", "report_ms", "{:.0f}"),
    ("restarted\ns", "restart_s", "{:.2f}"),
    ("ready\ns", "ready_s", "{:.1f}"),
    ("ended\ns", "end_s", "{:.1f}"),
)


def table_of(results: Sequence[dict[str, Any]]) -> Table:
    """One row per case, and a last one that counts."""
    passed = sum(bool(result["passed"]) for result in results)
    table = Table(show_edge=False, pad_edge=False, show_footer=True)
    table.add_column("process", footer=f"{len(results)} cases", no_wrap=True)
    table.add_column("signal")
    table.add_column("moment")
    table.add_column("must", no_wrap=True)
    for heading, key, form in _NUMBERS:
        values = [result[key] for result in results if result[key] is not None]
        table.add_column(heading, justify="right", footer=f"max {form.format(max(values))}" if values else "–")
    steps = [result["step"]["share"] for result in results if result["step"]]
    table.add_column("step", justify="right", footer=f"max {max(steps):.2f}" if steps else "–")
    table.add_column("pace", justify="right")
    table.add_column("result", footer=f"{passed}/{len(results)}")
    for result in results:
        case = result["case"]
        numbers = ["–" if result[key] is None else form.format(result[key]) for _, key, form in _NUMBERS]
        step = f"{result['step']['share']:.2f}" if result["step"] else "–"
        pace = "–" if result["pace"] is None else f"{result['pace']:.2f}"
        verdict = Text("passed", style="green") if result["passed"] else Text("failed", style="red")
        table.add_row(case["node"], case["signal"], case["moment"], case["expected"], *numbers, step, pace, verdict)
    return table


def problems_of(results: Sequence[dict[str, Any]]) -> list[str]:
    """One line per problem, per delay and per case that was never run."""
    return [
        f"{result['case']['node']} {result['case']['signal']} {result['case']['moment']}: {problem} "
        f"({result['run_folder']})"
        for result in results
        for problem in (*result["problems"], *result["late"], *([result["not_sent"]] if result["not_sent"] else []))
    ]
