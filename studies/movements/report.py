"""The report of a comparison: one HTML file that needs no other, and the numbers as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from paramove.documents import report_page
from studies.movements import plots
from studies.movements.summary import QUANTITIES, SECONDS, Measured, Quantity
from studies.movements.tasks import FIRST_MS

THETA_UNITS = {"pointing": "°", "table": "cm", "raster": "cm", "scripted": "cm"}
TEXTS = {
    "pointing/direction": "Pointing, one target left out: per person, all directions but one are learned.",
    "pointing/corners": "Pointing, learned from the corners: per person, the four corner directions of all depths are "
    "learned, all other targets are tested.",
    "table/actions": "Kinds of movement at the table, one person left out; finished movements.",
    "table/beginnings": "Kinds of movement at the table while they go on, one person left out. All are cut at their "
    "beginning by one absolute rule for speeds, and the length of a movement is unknown.",
    **{
        f"table/first {milliseconds} ms": f"Kinds of movement at the table after the first {milliseconds} ms, one "
        "person left out. Learned from as much of the others' movements."
        for milliseconds in FIRST_MS
    },
    "raster/actions": "Kinds of movement of the synthetic demonstrator; finished movements.",
    "raster/beginnings": "Kinds of movement of the synthetic demonstrator while they go on.",
}
NOMINAL = {"covered_50": 50.0, "covered_80": 80.0, "covered": 95.0, "below_1": 1.0, "below_5": 5.0, "below_20": 20.0}
"""Percentages that are right, so neither more nor less is better."""
SECOND_HEADINGS = {
    "fit": "learn, s",
    "synthesize": "synthesise, ms",
    "estimate": "θ, ms",
    "classify": "action, ms",
    "classify_beginning": "beginning, ms",
}
NOTE = (
    "In brackets the interval that holds 95 % of the values when whole folds are drawn again. Bold: the best of the "
    "column and all that its interval does not exclude. A dash: the method cannot do it. The tuned rows choose their "
    "hyper-parameters inside the training folds."
)


def plain(summary: dict[str, dict[str, dict[str, Any]]]) -> dict[str, Any]:
    """The summary as plain numbers, for JSON."""
    return {
        task: {
            row: {
                "measures": {name: measured._asdict() for name, measured in values["measures"].items()},
                "seconds": values["seconds"],
                "folds": values["folds"],
            }
            for row, values in rows.items()
        }
        for task, rows in summary.items()
    }


def write_report(
    summary: dict[str, dict[str, dict[str, Any]]],
    folder: Path,
    *,
    title: str,
    ours: frozenset[str],
    notes: Sequence[str] = (),
) -> Path:
    """Write `report.html` and `movements.json` into the folder. Returns the page."""
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(plain(summary), indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    (folder / "movements.json").write_text(text, encoding="utf-8")
    parts = [
        *(f"<section class=why>{escape(note)}</section>" for note in notes),
        *(_section(task, rows, ours) for task, rows in summary.items()),
    ]
    page = folder / "report.html"
    page.write_text(report_page(title, title, NOTE, parts, style="main{max-width:1500px}"), encoding="utf-8")
    return page


def _section(task: str, rows: dict[str, dict[str, Any]], ours: frozenset[str]) -> str:
    text = TEXTS.get(task, f"{task}: synthesis, parameters and rejection.")
    folds = max(row["folds"] for row in rows.values())
    if task.endswith("/beginnings"):
        picture = plots.beginnings(rows, ours)
    else:
        names = ("dtw", "end", "theta", "covered", "auroc_aborted", "auroc_stopped", "auroc_others", "correct")
        picture = plots.intervals(rows, [q for q in QUANTITIES if q.name in names], ours)
    return (
        f"<section><h2>{escape(task)}</h2><p class=why>{escape(text)} {folds} folds.</p>{picture}"
        f"<div class=scroll>{_table(task, rows, ours)}</div></section>"
    )


def _table(task: str, rows: dict[str, dict[str, Any]], ours: frozenset[str]) -> str:
    quantities = quantities_of(rows)
    timed = [name for name in SECONDS if any(name in row["seconds"] for row in rows.values())]
    heads = "".join(f"<th class=n>{escape(heading(q, task))}</th>" for q in quantities)
    heads += "".join(f"<th class=n>{SECOND_HEADINGS[name]}</th>" for name in timed)
    lines = []
    for name, row in rows.items():
        cells = "".join(f"<td class=n>{_cell(rows, name, q)}</td>" for q in quantities)
        cells += "".join(f"<td class=n>{_seconds(row, second)}</td>" for second in timed)
        label = f"<b>{escape(name)}</b>" if name in ours else escape(name)
        lines.append(f"<tr><td style='white-space:nowrap'>{label}</td>{cells}</tr>")
    return f"<table><tr><th>method</th>{heads}</tr>{''.join(lines)}</table>"


def quantities_of(rows: dict[str, dict[str, Any]]) -> list[Quantity]:
    """The quantities that any of the rows has."""
    return [q for q in QUANTITIES if any(q.name in row["measures"] for row in rows.values())]


def heading(quantity: Quantity, task: str) -> str:
    """Heading of a column with its unit."""
    unit = THETA_UNITS.get(task.split("/")[0], "") if quantity.unit == "θ" else quantity.unit
    return f"{quantity.heading}, {unit}" if unit else quantity.heading


def formatted(quantity: Quantity, measured: Measured | None) -> str:
    """A value as text: two digits for lengths and angles, one for per cent, three for AUROC."""
    if measured is None:
        return "–"
    digits = 3 if not quantity.unit else 1 if quantity.unit == "%" else 2
    return f"{measured.value:.{digits}f}"


def leading(rows: dict[str, dict[str, Any]], quantity: Quantity) -> set[str]:
    """The best row and those whose value lies within its interval; for coverage those whose interval holds 95 %."""
    measured: dict[str, Measured] = {
        name: row["measures"][quantity.name] for name, row in rows.items() if quantity.name in row["measures"]
    }
    if not measured:
        return set()
    if quantity.name in NOMINAL:
        return {name for name, one in measured.items() if one.low <= NOMINAL[quantity.name] <= one.high}
    if quantity.more_is_better:
        best = max(measured.values(), key=lambda one: one.value)
        return {name for name, one in measured.items() if one.value >= best.low}
    best = min(measured.values(), key=lambda one: one.value)
    return {name for name, one in measured.items() if one.value <= best.high}


def _cell(rows: dict[str, dict[str, Any]], name: str, quantity: Quantity) -> str:
    measured: Measured | None = rows[name]["measures"].get(quantity.name)
    text = formatted(quantity, measured)
    if measured is None:
        return text
    digits = len(text.partition(".")[2])
    interval = f"<br><span class=soft>[{measured.low:.{digits}f}, {measured.high:.{digits}f}]</span>"
    value = f"<b>{text}</b>" if name in leading(rows, quantity) else text
    return f"{value}{interval}"


def _seconds(row: dict[str, Any], name: str) -> str:
    value = row["seconds"].get(name)
    if value is None:
        return "–"
    return f"{value:.2f}" if name == "fit" else f"{1000.0 * value:.1f}"
