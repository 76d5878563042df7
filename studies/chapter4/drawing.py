"""The plots of the report on chapter 4."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paramove.documents import Floats
from paramove.runs import STYLE
from studies.chapter2.drawing import BLUE, GREY, RED, ellipse
from studies.chapter2.movement import prototype
from studies.chapter4.line_movement import PARAMETERS
from studies.movements.plots import svg_of

COLOURS = (RED, GREY, BLUE)
HUES = ("#2f6fc4", "#c8372d", "#1f7a45", "#a86a00", "#7a4fb5", "#5b6470")
DASHES = ("-", "--", "-.", ":", "-", "--")


def drawn(draw: Callable[[Figure], None], size: tuple[float, float]) -> str:
    """A plot as SVG; `size` in inches."""
    with mpl.rc_context(cast(Any, STYLE)):
        figure = Figure(figsize=size, layout="constrained")
        draw(figure)
        return svg_of(figure)


def line_states(figure: Figure, states: Mapping[str, Any]) -> None:
    """Figure 4.2: the states of the 21-state LPHMM for three parameters."""
    axes = figure.subplots()
    _true_lines(axes)
    for means, colour in zip(states["means"], COLOURS, strict=True):
        for mean, covariance in zip(np.array(means), np.array(states["covariances"]), strict=True):
            axes.plot(*ellipse(mean, covariance).T, color=colour, lw=0.9)
        axes.plot(*np.array(means).T, ".", color=colour, ms=3)
    axes.set(xlabel="x", ylabel="y", ylim=(-0.34, 0.34))


def line_curves(figure: Figure, curves: Mapping[str, Any], titles: Mapping[str, str]) -> None:
    """Figures 4.3 to 4.6: synthesised movements over the true ones."""
    for axes, (number, made) in zip(figure.subplots(1, 4, sharey=True), curves.items(), strict=True):
        _true_lines(axes)
        for one, colour in zip(made, COLOURS, strict=True):
            axes.plot(*np.array(one).T, color=colour, lw=1.3)
        axes.set(xlabel="x", ylim=(-0.34, 0.34), title=f"{number}: {titles[number]}")


def _true_lines(axes: Axes) -> None:
    times = np.linspace(0.0, 2.0, 201)
    for p in PARAMETERS:
        axes.plot(*prototype(p, times).T, color="#bcc4cc", lw=2.4)


def surfaces(figure: Figure, errors: Mapping[str, Floats], columns: int, maximum: float) -> None:
    """Error at each target of the 7 x 5 grid, cm; v = 0, near the person, is below."""
    rows = -(-len(errors) // columns)
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for axes in panels.flat[len(errors) :]:
        axes.set_visible(False)
    image = None
    for axes, (name, values) in zip(panels.flat, errors.items(), strict=False):
        image = axes.imshow(values.T, origin="lower", cmap="YlOrRd", vmin=0.0, vmax=maximum, aspect="auto")
        for column, row in np.ndindex(*values.shape):
            value = values[column, row]
            colour = "white" if value > 0.7 * maximum else "#39424e"
            axes.text(column, row, f"{value:.1f}", ha="center", va="center", fontsize=7, color=colour)
        axes.set_title(f"{name}: {np.nanmean(values):.2f} cm", fontsize=9)
        axes.grid(visible=False)
        axes.set_xticks([0, 3, 6], ["0", "½", "1"])
        axes.set_yticks([0, 2, 4], ["0", "½", "1"])
    for axes in panels[-1]:
        axes.set_xlabel("u")
    for axes in panels[:, 0]:
        axes.set_ylabel("v")
    if image is not None:
        figure.colorbar(image, ax=panels, shrink=0.8, label="cm")


def durations(figure: Figure, expected: Mapping[int, Sequence[Sequence[float]]]) -> None:
    """Figures 4.12 and 4.13: expected frames of each state, at the four corners."""
    panels = figure.subplots(1, len(expected), squeeze=False)[0]
    for axes, (states, corners) in zip(panels, expected.items(), strict=True):
        for values, corner, colour in zip(corners, ("0, 0", "0, 1", "1, 0", "1, 1"), HUES, strict=False):
            axes.plot(np.arange(1, len(values) + 1), values, "o-", ms=3, lw=1.0, color=colour, label=f"({corner})")
        frames = round(100 / states)
        axes.set(xlabel="state", title=f"{states} states", ylim=(0.0, 1.7 * max(frames, 2)))
    panels[0].set_ylabel("expected frames")
    panels[-1].legend(title="(u, v)", ncols=2, fontsize=7)


def likelihoods(
    figure: Figure, values: Mapping[str, Sequence[float]], estimates: Mapping[str, Sequence[float]]
) -> None:
    """Figure 4.15: ln p(X | u, v) of a movement to (0.5, 0.5)."""
    for axes, (name, flat) in zip(figure.subplots(1, len(values), sharey=True), values.items(), strict=True):
        side = round(len(flat) ** 0.5)
        line = np.linspace(0.0, 1.0, side)
        levels = np.array(flat).reshape(side, side)
        picture = axes.contourf(line, line, levels.T / 1000.0, 24, cmap="viridis")
        axes.plot(0.5, 0.5, "+", color="white", ms=12, mew=2)
        axes.plot(*estimates[name], "o", mfc="none", color="#ff6b5e", ms=9, mew=1.8)
        axes.set(xlabel="u", title=f"{name}")
        axes.grid(visible=False)
        figure.colorbar(picture, ax=axes, label="ln p / 1000")
    figure.axes[0].set_ylabel("v")


def noise(figure: Figure, errors: Mapping[str, Mapping[str, Any]]) -> None:
    """Error of theta over the noise that is added; errors above 10 cm are cut off."""
    axes = figure.subplots()
    for number, (name, values) in enumerate(errors.items()):
        x = [float(key) for key in values]
        _with_interval(axes, x, list(values.values()), number, name)
    axes.set(xlabel="standard deviation of the noise per component, cm", ylabel="error of θ, cm", ylim=(0.0, 10.0))
    axes.legend(fontsize=8)


def learning(figure: Figure, rows: Sequence[Mapping[str, Any]]) -> None:
    """Errors over repetitions at nine targets, and over the number of targets."""
    names = list(dict.fromkeys(row["name"] for row in rows))
    maximum = max(row["repetitions"] for row in rows)
    for line, (measure, title) in enumerate((("synthesis", "synthesis, cm"), ("theta", "error of θ, cm"))):
        by_repetitions, by_targets = figure.add_subplot(2, 2, 2 * line + 1), figure.add_subplot(2, 2, 2 * line + 2)
        for number, name in enumerate(names):
            own = [row for row in rows if row["name"] == name]
            nine = sorted((row for row in own if row["side"] == 3), key=lambda row: int(row["repetitions"]))
            full = sorted((row for row in own if row["repetitions"] == maximum), key=lambda row: int(row["side"]))
            if nine:
                _with_interval(
                    by_repetitions, [row["repetitions"] for row in nine], [row[measure] for row in nine], number, name
                )
            _with_interval(by_targets, [row["side"] ** 2 for row in full], [row[measure] for row in full], number, name)
        by_repetitions.set(xlabel="repetitions at each of 9 targets", ylabel=title, ylim=(0.0, None))
        by_targets.set(xlabel=f"targets with {maximum} repetitions", ylim=(0.0, None))
        by_targets.set_xscale("log")
        by_targets.set_xticks([4, 9, 36], ["4", "9", "36"])
        by_targets.minorticks_off()
    figure.axes[0].legend(fontsize=7)


def _with_interval(axes: Axes, x: Sequence[float], intervals: Sequence[Any], number: int, name: str) -> None:
    colour, dash = HUES[number % len(HUES)], DASHES[number % len(DASHES)]
    axes.plot(x, [one.mean for one in intervals], "o", ls=dash, ms=4, lw=1.4, color=colour, label=name)
    axes.fill_between(
        x, [one.low for one in intervals], [one.high for one in intervals], color=colour, alpha=0.12, lw=0
    )
