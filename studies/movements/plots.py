"""The plots of a comparison: measures with their intervals, and classification of beginnings."""

from __future__ import annotations

import io
from collections.abc import Sequence
from textwrap import fill
from typing import Any, cast

import matplotlib as mpl
from matplotlib.figure import Figure

from paramove.runs import STYLE
from studies.movements.summary import Measured, Quantity
from studies.movements.trial import FRACTIONS

OURS, THEIRS = "#2f6fc4", "#7a838e"
TITLES = 100
"""Characters that the titles of all panels have room for, side by side."""


def svg_of(figure: Figure) -> str:
    """A figure as an SVG element for a page."""
    file = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "paramove", "svg.fonttype": "none"}):
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    text = file.getvalue()
    return text[text.index("<svg") :]


def intervals(rows: dict[str, dict[str, Any]], quantities: Sequence[Quantity], ours: frozenset[str]) -> str:
    """One panel per quantity, one line per method: the value and its 95 % interval."""
    chosen = [q for q in quantities if any(q.name in row["measures"] for row in rows.values())]
    with mpl.rc_context(cast(Any, STYLE)):
        figure = Figure(figsize=(11.0, 1.2 + 0.24 * len(rows)), layout="constrained")
        panels = figure.subplots(1, len(chosen), sharey=True, squeeze=False)[0]
        for axes, quantity in zip(panels, chosen, strict=True):
            for line, (name, row) in enumerate(rows.items()):
                measured: Measured | None = row["measures"].get(quantity.name)
                if measured is not None:
                    colour = OURS if name in ours else THEIRS
                    axes.plot([measured.low, measured.high], [line, line], c=colour, lw=2.0, solid_capstyle="butt")
                    axes.plot(measured.value, line, "o", c=colour, ms=4.5)
            if quantity.name == "covered":
                axes.axvline(95.0, c="#1f7a45", lw=1.0, ls=":")
            unit = f", {quantity.unit}" if quantity.unit else ""
            axes.set_title(fill(f"{quantity.heading}{unit}", TITLES // len(chosen)), fontsize=8.5)
        panels[0].set_yticks(range(len(rows)), list(rows))
        panels[0].invert_yaxis()
        return svg_of(figure)


def beginnings(rows: dict[str, dict[str, Any]], ours: frozenset[str]) -> str:
    """Right answers over the elapsed fraction of the movement."""
    with mpl.rc_context(cast(Any, STYLE)):
        figure = Figure(figsize=(11.0, 4.2), layout="constrained")
        axes = figure.subplots()
        percents = [round(100 * fraction) for fraction in FRACTIONS]
        for name, row in rows.items():
            measured = [row["measures"].get(f"correct_{percent}") for percent in percents]
            if all(one is not None for one in measured):
                width = 2.4 if name in ours else 1.2
                axes.plot(percents, [one.value for one in measured], "o-", ms=4, lw=width, label=name)
        axes.set(xlabel="elapsed part of the movement, %", ylabel="right, %", xticks=percents)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
        return svg_of(figure)
