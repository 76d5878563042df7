"""The report of a training: one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from paramove.demonstrations import embedded, new_figure
from paramove.documents import report_page, section, table
from paramove.training.drawing import ACTION_COLOURS, INK, WARN, bounds, with_unit
from paramove.training.leaving_out import LeaveOutResult
from paramove.training.pictures import plot_model
from paramove.training.training import Trained

DPI = 90
WORST = 8
MIN_COVERED = 0.85
"""Of the 95 % regions of left-out movements: with less there is a warning."""


def write_training_report(trained: Sequence[Trained], path: Path, remarks: Sequence[str] = ()) -> None:
    """Write what was trained, how training went, what the models have learned, and their cross-validation."""
    title = "Trained: " + ", ".join(one.action for one in trained)
    about = f"{sum(len(one.examples) for one in trained)} movements of {trained[0].examples.source or 'a set'}"
    parts = [
        *(f"<section class=why>{escape(remark)}</section>" for remark in remarks),
        *(_section(one) for one in trained),
    ]
    path.write_text(report_page(title, title, about, parts, style="img{max-width:100%}"), encoding="utf-8")


def sentences(facts: dict[str, Any]) -> list[tuple[str, str]]:
    """Result of training, as names and values for people."""
    low_high = [f"{with_unit(name)}: {low:.3g} to {high:.3g}" for name, (low, high) in facts["bounds"].items()]
    persons = f" of {len(facts['persons'])} persons" if len(facts["persons"]) > 1 else ""
    rows = [
        ("model", facts["model"]),
        ("movements", f"{facts['sequences']}{persons}, {facts['thetas']} thetas, {facts['frames']} frames at "
                      f"{facts['rate_hz']:g} Hz"),
        ("theta", "; ".join(low_high)),
        ("states", f"{facts['states']} of {facts['frames_per_state'][0]} to {facts['frames_per_state'][1]} frames; "
                   f"every movement resampled to {facts['resampled_frames']} frames"),
    ]  # fmt: skip
    if "iterations" in facts:
        how = "converged" if facts["converged"] else "not yet converged"
        rows.append((
            "training",
            f"{facts['iterations']} iterations, {how}, log-likelihood {facts['log_likelihood_per_frame']:.2f} per "
            f"frame, {facts['seconds']:.1f} s",
        ))  # fmt: skip
    if facts["left_out"]:
        rows += cross_validation_rows(facts["left_out"])
        warning = coverage_warning(facts)
        rows += [("  warning", warning)] if warning else []
    if facts["file"]:
        rows.append(("written", facts["file"]))
    return rows


def cross_validation_rows(left: dict[str, Any]) -> list[tuple[str, str]]:
    """Result of cross-validation, as names and values for people."""
    group = {"theta": "each theta", "subject": "each person", "repetition": "each repetition"}[left["left_out"]]
    if "theta_median_m" in left:
        theta = f"median {100 * left['theta_median_m']:.2g} cm, 95 % below {100 * left['theta_p95_m']:.2g} cm"
    else:
        theta = ", ".join(f"{name}: {value:.3g} RMS" for name, value in left["theta_rms"].items())
    outside = left["outside_the_training"]
    return [
        (f"without {group}", f"{left['folds']} trainings, {left['movements']} movements tested"
         + (f", {outside} of them outside the other thetas" if outside else "")),
        ("  error of theta", f"{theta}; {100 * left['theta_covered']:.0f} % of the 95 % regions hold the label"),
        ("  error of synthesis", f"median {100 * left['synthesis_median_m']:.2g} cm, 95 % below "
         f"{100 * left['synthesis_p95_m']:.2g} cm, after time warping"),
    ]  # fmt: skip


def coverage_warning(facts: dict[str, Any]) -> str | None:
    """What to say where regions of theta hold less than they promise; None where they hold it or were not tested."""
    left = facts["left_out"]
    if not left or left["theta_covered"] >= MIN_COVERED:
        return None
    return (
        f"{facts['action']}: only {100 * left['theta_covered']:.0f} % of the 95 % regions hold the label of a movement "
        "that was left out. Do not rely on them: show more thetas and repetitions, compare another --model, or give "
        "the persons"
    )


def _section(trained: Trained) -> str:
    rows = "".join(
        f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in sentences(trained.facts())
    )
    parts = [f"<section><h2>{escape(trained.action)}</h2><table>{rows}</table></section>"]
    pictures = [
        ("What the model has learned", "State means over a grid of theta, their scatter, how long states last, and "
         "where theta is visible.", plot_model(trained.model)),
        ("How training went", "Log-likelihood per frame after each iteration.", _curve(trained)),
    ]  # fmt: skip
    if trained.left_out is not None:
        pictures.append((
            "Movements that were left out", "Left the estimates of theta (dots) and the labels (crosses); right the "
            "error of synthesis of each movement. Red: outside the other thetas, extrapolated.",
            _left_out(trained, trained.left_out),
        ))  # fmt: skip
    parts += [section(title, why, embedded(figure, title, DPI)) for title, why, figure in pictures]
    if trained.left_out is not None:
        parts.append(_worst(trained, trained.left_out))
    return "".join(parts)


def _curve(trained: Trained) -> Figure:
    figure = new_figure(11.0, 2.6)
    axes = figure.subplots()
    summary = trained.model.training_
    if summary is not None:
        values = np.array(summary.log_likelihoods) / summary.n_frames
        axes.plot(np.arange(1, len(values) + 1), values, "o-", color=ACTION_COLOURS[0], markersize=3)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="iteration", ylabel="log-likelihood per frame")
    axes.grid(alpha=0.3)
    return figure


def _left_out(trained: Trained, result: LeaveOutResult) -> Figure:
    figure = new_figure(11.0, 4.2)
    left, right = figure.subplots(1, 2)
    span = np.ptp(bounds(trained.model), axis=0)
    chosen = sorted(np.argsort(-span)[:2].tolist())
    for one in result.movements:
        colour = WARN if one.outside else ACTION_COLOURS[0]
        x, y = (chosen[0], chosen[-1])
        if len(chosen) == 2:
            left.plot([one.theta[x], one.estimated[x]], [one.theta[y], one.estimated[y]], color=colour, lw=0.7)
            left.plot(one.estimated[x], one.estimated[y], "o", color=colour, markersize=3)
            left.plot(one.theta[x], one.theta[y], "x", color=INK, markersize=6)
        else:
            left.errorbar(one.theta[0], one.estimated[0], yerr=1.96 * one.deviation[0], fmt="o", color=colour, ms=3)
    names = [with_unit(name) for name in result.parameter_names]
    pair = (names[chosen[0]], names[chosen[1]]) if len(chosen) == 2 else (f"labelled {names[0]}", "estimated")
    left.set(xlabel=pair[0], ylabel=pair[1])
    errors = [100.0 * one.synthesis for one in result.movements]
    colours = [WARN if one.outside else ACTION_COLOURS[0] for one in result.movements]
    right.bar(range(len(errors)), errors, color=colours)
    right.set(xlabel="movement", ylabel="error of synthesis, cm")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    return figure


def _worst(trained: Trained, result: LeaveOutResult) -> str:
    names = [with_unit(name) for name in result.parameter_names]
    rows = [
        [
            str(one.number),
            escape(trained.examples.subjects[one.number]) or "–",
            *(f"{true:.3f} → {found:.3f}" for true, found in zip(one.theta, one.estimated, strict=True)),
            f"{100 * one.synthesis:.2f}",
            "outside" if one.outside else "inside",
        ]
        for one in sorted(result.movements, key=lambda one: -one.synthesis)[:WORST]
    ]
    heads = ["movement", "person", *names, "synthesis, cm", "of the training"]
    return section(
        "The worst of them", "Labelled → estimated theta.", table(heads, rows, numbers=range(2, len(names) + 3))
    )
