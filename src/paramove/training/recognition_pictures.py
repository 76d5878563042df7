"""Pictures of recognised movements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from paramove.demonstrations import new_figure, space_axes
from paramove.phmm import ParametricHMM
from paramove.training.drawing import (
    ACTION_COLOURS,
    FAINT,
    INK,
    WARN,
    add_ellipse,
    bounds,
    drawn_point,
    grid,
    with_unit,
)
from paramove.training.examining import SIGNIFICANCE_LEVEL, Recognition, confusion, percent


def plot_recognition(models: Mapping[str, ParametricHMM], recognitions: Sequence[Recognition]) -> Figure:
    """One movement with the model's synthesis, or all estimates and the confusion matrix of many."""
    if len(recognitions) == 1:
        return _plot_one(models, recognitions[0])
    return _plot_many(models, recognitions)


def _plot_one(models: Mapping[str, ParametricHMM], recognition: Recognition) -> Figure:
    """Left the recorded path and the synthesised one, in the middle theta, right the actions."""
    model = models[recognition.action]
    drawn = drawn_point(model)
    recorded = recognition.movement.frames[:, drawn.columns]
    synthesised = model.synthesize(recognition.estimate.theta, 100)[:, drawn.columns]
    around = model.state_means(grid(bounds(model)))[..., drawn.columns]
    figure = new_figure(13.0, 5.2)
    layout = figure.add_gridspec(1, 3, width_ratios=[1.2, 1.1, 0.7])
    space = space_axes(figure, layout[0], [*around, recorded], f"path of {drawn.name}")
    for other in around:
        space.plot(*other.T, color=FAINT, linewidth=0.6, alpha=0.6)
    space.plot(*recorded.T, color=INK, linewidth=1.8, label="recorded")
    space.plot(
        *synthesised.T, "--", color=ACTION_COLOURS[0], linewidth=1.4, label="the model's, for the estimated theta"
    )
    space.legend(loc="upper left", fontsize=8, frameon=False)
    axes = figure.add_subplot(layout[1])
    _plane(axes, models, [recognition])
    axes.set_title("theta, its 95 % region, and the bounds of the training", fontsize=10)
    _posterior(figure.add_subplot(layout[2]), recognition)
    figure.suptitle(f"{recognition.movement.source}", fontsize=10)
    return figure


def _plot_many(models: Mapping[str, ParametricHMM], recognitions: Sequence[Recognition]) -> Figure:
    """Left all estimates of theta with their labels, right the confusion matrix."""
    table = confusion(recognitions)
    figure = new_figure(13.0, 5.6)
    left, right = figure.subplots(1, 2, width_ratios=[1.4, 1.0])
    _plane(left, models, recognitions)
    left.set_title("theta with 95 % regions; crosses: labels; red: rejected", fontsize=10)
    if len(table) > 1:
        _matrix(right, table, [*models, "none"])
    else:
        _counts(right, recognitions)
    figure.suptitle(f"{len(recognitions)} movements", fontsize=11)
    return figure


def _plane(axes: Axes, models: Mapping[str, ParametricHMM], recognitions: Sequence[Recognition]) -> None:
    """Estimates in the plane of the two parameters that vary most; for a single parameter one below the other."""
    first = models[recognitions[0].action]
    span = np.ptp(bounds(first), axis=0)
    chosen = sorted(np.argsort(-span)[:2].tolist())
    colours = {action: ACTION_COLOURS[number % 8] for number, action in enumerate(models)}
    for number, one in enumerate(recognitions):
        colour = colours[one.action] if one.known else WARN
        if len(chosen) == 2:
            _point(axes, one, chosen, colour, alpha=min(0.18, 6.0 / len(recognitions)))
        else:
            _interval(axes, one, number, colour)
    names = recognitions[0].parameter_names
    axes.set_xlabel(with_unit(names[chosen[0]]))
    axes.set_ylabel(with_unit(names[chosen[1]]) if len(chosen) == 2 else "movement")
    for action, model in models.items():
        low, high = bounds(model)[:, chosen]
        if len(chosen) == 2:
            width, height = high - low
            axes.add_patch(Rectangle((low[0], low[1]), width, height, fill=False, ls="--", ec=colours[action], lw=0.9))
        else:
            axes.axvspan(low[0], high[0], color=colours[action], alpha=0.08)
        axes.plot([], [], "o", color=colours[action], label=action)
    axes.margins(0.08)
    axes.autoscale_view()
    axes.legend(fontsize=8, frameon=False, loc="best")
    axes.grid(alpha=0.3)


def _point(axes: Axes, one: Recognition, chosen: list[int], colour: Any, alpha: float) -> None:
    position = one.estimate.theta[chosen]
    add_ellipse(axes, position, one.estimate.covariance[np.ix_(chosen, chosen)], colour, alpha=alpha, lw=0)
    axes.plot(*position, "o", color=colour, markersize=4)
    if one.labelled is not None:
        label = one.labelled[chosen]
        axes.plot(*label, "x", color=INK, markersize=6)
        axes.plot(*zip(position, label, strict=True), color=colour, linewidth=0.7)


def _interval(axes: Axes, one: Recognition, number: int, colour: Any) -> None:
    axes.errorbar(one.estimate.theta[0], number, xerr=one.half_widths[0], fmt="o", color=colour, markersize=4)
    if one.labelled is not None:
        axes.plot(one.labelled[0], number, "x", color=INK, markersize=6)


def _posterior(axes: Axes, recognition: Recognition) -> None:
    names = list(recognition.posterior)
    height = min(0.8, 0.2 * len(names))
    axes.barh(
        range(len(names)), [100.0 * recognition.posterior[name] for name in names], height, color=ACTION_COLOURS[0]
    )
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.set(xlim=(0, 100), xlabel="probability, %")
    axes.invert_yaxis()
    if recognition.p_value is None:
        title, colour = "no p-value from this model", INK
    else:
        title = f"p-value {percent(recognition.p_value)}" + ("" if recognition.known else ": rejected")
        colour = INK if recognition.p_value >= SIGNIFICANCE_LEVEL else WARN
    axes.set_title(title, fontsize=10, color=colour)


def _matrix(axes: Axes, table: dict[str, dict[str, int]], columns: Sequence[str]) -> None:
    rows = sorted(table)
    counts = np.array([[table[row].get(column, 0) for column in columns] for row in rows])
    fractions = counts / counts.sum(axis=1, keepdims=True)
    axes.imshow(fractions, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for (row, column), count in np.ndenumerate(counts):
        axes.text(
            column, row, str(count), ha="center", va="center", color="white" if fractions[row, column] > 0.6 else INK
        )
    axes.set_xticks(range(len(columns)), columns)
    axes.set_yticks(range(len(rows)), rows)
    axes.set(xlabel="recognised", ylabel="labelled")
    axes.set_title("confusion", fontsize=10)


def _counts(axes: Axes, recognitions: Sequence[Recognition]) -> None:
    recognised = [one.action if one.known else "none" for one in recognitions]
    names = sorted(set(recognised))
    axes.barh(range(len(names)), [recognised.count(name) for name in names], color=ACTION_COLOURS[0], alpha=0.75)
    axes.set_yticks(range(len(names)), names)
    axes.set_xlabel("movements")
    axes.set_title("recognised", fontsize=10)
