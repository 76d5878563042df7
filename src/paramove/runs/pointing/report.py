"""The report on a pointing run: one HTML file that needs no other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from paramove.demonstrations import table_place
from paramove.documents import film, report_page, section
from paramove.runs import plots
from paramove.runs.after_a_run import write_report
from paramove.runs.pointing.run import PointingRun

TRUE, ESTIMATED = "#1d2530", "#2f9e57"


def write_pointing_report(run: PointingRun, summary: dict[str, Any], video: Path | None) -> Path:
    """Write `report.html` into the run's folder; the video is put into it."""
    good = summary["success"] is not False
    title = "Pointing" if summary["success"] is None else "Pointing: found" if good else "Pointing: not found"
    subtitle = summary["reason"] or f"{summary['gestures']} gestures in {summary['seconds']:.0f} s"
    parts = [
        film(video),
        section(
            "The table from above", "Rings: where the person pointed. Dots: what was answered.",
            plots.svg_of(plan, run, (7, 4.6)),
        ),
        section(
            "The hand", "Black: true. Green: estimated, with its standard deviation. Grey: the hand is at a target.",
            plots.svg_of(hand, run, (11, 5)),
        ),
        _how_sure(run),
    ]  # fmt: skip
    return write_report(run.folder, report_page(title, title, subtitle, parts, good=good))


def _how_sure(run: PointingRun) -> str:
    """Nothing for a body tracker, which has no particles."""
    if not np.isfinite(run.pointed_deviation).any():
        return ""
    legend = "Standard deviation of the estimated target; effective number of particles."
    return section("How sure", legend, plots.svg_of(certainty, run, (11, 3)))


def plan(run: PointingRun, figure: Figure) -> None:
    """Targets and answers on the table."""
    axes = figure.subplots()
    corners = 100 * table_place([[0.0, 0.0], [1.0, 1.0]])
    (x0, y0, _), (x1, y1, _) = corners
    axes.add_patch(Rectangle((-y0, x0), y0 - y1, x1 - x0, fill=False, edgecolor=plots.OTHER, linestyle=":"))
    for one in run.pointings:
        axes.plot(-100 * one.target[1], 100 * one.target[0], "o", mfc="none", mec=TRUE, ms=11)
        axes.annotate(
            str(one.number), (-100 * one.target[1], 100 * one.target[0]), xytext=(8, 6), textcoords="offset points"
        )
        for _, answer, sure in one.answers:
            axes.plot(-100 * answer[1], 100 * answer[0], "o", color=(1 - sure, sure, 0.1), ms=5)
    for _, target in run.spurious:
        axes.plot(-100 * target[1], 100 * target[0], "x", color="#b3372b")
    axes.set(xlabel="to the right, cm", ylabel="forward, cm", aspect="equal")


def hand(run: PointingRun, figure: Figure) -> None:
    """Estimated and true hand over time."""
    for number, axes in enumerate(figure.subplots(3, 1, sharex=True)):
        for one in run.pointings:
            axes.axvspan(one.arrived_s, one.left_s, color="#e7eaee")
        axes.plot(run.time_s, 100 * run.true_hand[:, number], color=TRUE, lw=1.0)
        middle, wide = 100 * run.hand[:, number], 100 * run.hand_deviation
        axes.fill_between(run.time_s, middle - wide, middle + wide, color=ESTIMATED, alpha=0.25, lw=0)
        axes.plot(run.time_s, middle, color=ESTIMATED, lw=1.2)
        axes.set_ylabel(f"{'xyz'[number]}, cm")
    axes.set_xlabel("time, s")


def certainty(run: PointingRun, figure: Figure) -> None:
    """Deviation of the target and effective sample size over time."""
    left = figure.subplots()
    left.semilogy(run.time_s, 100 * np.maximum(run.pointed_deviation, 1e-4), color=ESTIMATED)
    left.set(xlabel="time, s", ylabel="deviation, cm")
    right = left.twinx()
    right.plot(run.time_s, run.effective, color="#3367d6", lw=0.8)
    right.set_ylabel("effective particles")
    for begin in run.time_s[run.unsure]:
        left.axvline(begin, color="#b3372b", alpha=0.2)
