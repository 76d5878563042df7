"""Pictures of models: what one has learned, a movement that it makes, and movements that were recognised."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from paramove.demonstrations import new_figure, space_axes
from paramove.documents import Floats
from paramove.hmm import expected_durations
from paramove.phmm import ParametricHMM
from paramove.training.drawing import (
    ACTION_COLOURS,
    COLOURS,
    FAINT,
    INK,
    WARN,
    DrawnPoint,
    add_ellipse,
    bounds,
    description_of,
    drawn_point,
    grid,
    parameter_names,
    point_names,
    with_unit,
)
from paramove.training.examining import SIGNIFICANCE_LEVEL, Recognition, confusion, percent
from paramove.training.kinds import kind_of

STEP = 1e-3
"""Of the training's range: for derivatives with respect to theta."""
CHAINS = 7
"""The arm is drawn at this many times."""


def plot_model(model: ParametricHMM, point: str | None = None) -> Figure:
    """Draws what a model has learned.

    Above: the state means of one body point over a grid of theta as paths in space, and from above and from the side
    with the regions that hold 95 % of the frames of each state. Below: how long each state lasts, and by how many
    standard deviations the pose of a state changes over the range of each parameter.

    Raises InputError for a point that the model does not have.
    """
    drawn = drawn_point(model, point)
    low_high = bounds(model)
    thetas = grid(low_high)
    wide = int(np.ptp(low_high, axis=0).argmax())
    norm = Normalize(float(low_high[0, wide]), float(max(low_high[1, wide], low_high[0, wide] + 1e-9)))
    paths = model.state_means(thetas)[..., drawn.columns]
    figure = new_figure(13.5, 8.6)
    layout = figure.add_gridspec(2, 12, height_ratios=[1.5, 1.0])
    space = space_axes(
        figure, layout[0, :4], list(paths), f"states of {drawn.name}, frame '{description_of(model).frame}'"
    )
    for path, theta in zip(paths, thetas, strict=True):
        space.plot(*path.T, ".-", color=colormaps[COLOURS](norm(theta[wide])), linewidth=0.8, markersize=2.5)
    above, side = figure.add_subplot(layout[0, 4:8]), figure.add_subplot(layout[0, 8:])
    across = int(np.ptp(paths[..., :2].reshape(-1, 2), axis=0).argmax())
    _regions(above, model, drawn, (1, 0), wide, norm)
    above.invert_xaxis()  # y is to the left
    _regions(side, model, drawn, (across, 2), wide, norm)
    name = with_unit(parameter_names(model)[wide])
    figure.colorbar(ScalarMappable(norm, COLOURS), ax=side, label=name, pad=0.01, shrink=0.8)
    _durations(figure.add_subplot(layout[1, :5]), model)
    _visibility(figure.add_subplot(layout[1, 5:]), model, thetas)
    figure.suptitle(title_of(model), fontsize=11)
    return figure


def plot_synthesis(model: ParametricHMM, theta: Floats, time: Floats, frames: Floats) -> Figure:
    """Draws a synthesised movement.

    Args:
        model: that synthesised it.
        theta: (P,).
        time: (T,), s. frames: (T, D), m.

    Left the path of the fingertip, or of the last point where there is none, and the arm at some times, among the
    movements of the training's range; right the point's coordinates, with the band that holds 95 % of demonstrations of
    this theta.
    """
    drawn = drawn_point(model)
    path = frames[:, drawn.columns]
    figure = new_figure(13.0, 6.4)
    layout = figure.add_gridspec(3, 2, width_ratios=[1.1, 1.0])
    arms = frames.reshape(len(frames), -1, 3)
    title = f"path of {drawn.name}, and the arm at {CHAINS} times"
    space = _among_others(figure, layout[:, 0], model, drawn, arms, title)
    samples = np.linspace(0, len(frames) - 1, CHAINS).round().astype(int)
    for number, sample in enumerate(samples.tolist()):
        space.plot(*arms[sample].T, "o-", color=ACTION_COLOURS[0], alpha=0.25 + 0.1 * number, markersize=2.5, lw=1.2)
    space.plot(*path.T, color=INK, linewidth=1.8)
    progress = np.linspace(0.0, 1.0, len(frames))
    deviation = np.stack([
        np.sqrt(np.diagonal(model.progress_covariance(theta, float(tau)))[drawn.columns]) for tau in progress
    ])  # fmt: skip
    for axis, letter in enumerate("xyz"):
        axes = figure.add_subplot(layout[axis, 1])
        band = path[:, axis] - 1.96 * deviation[:, axis], path[:, axis] + 1.96 * deviation[:, axis]
        axes.fill_between(time, *band, color=ACTION_COLOURS[0], alpha=0.18, linewidth=0)
        axes.plot(time, path[:, axis], color=INK, linewidth=1.4)
        axes.set_ylabel(f"{drawn.name} {letter}, m")
        axes.grid(alpha=0.3)
    axes.set_xlabel("time, s")
    values = ", ".join(f"{name} {value:g}" for name, value in zip(parameter_names(model), theta, strict=True))
    figure.suptitle(f"{title_of(model)} · {values}", fontsize=11)
    return figure


def plot_recognition(models: Mapping[str, ParametricHMM], recognitions: Sequence[Recognition]) -> Figure:
    """One movement with the model's synthesis, or all estimates and the confusion matrix of many."""
    if len(recognitions) == 1:
        return _plot_one(models, recognitions[0])
    return _plot_many(models, recognitions)


def title_of(model: ParametricHMM) -> str:
    """A model in one line."""
    action, points = description_of(model).action, len(point_names(model))
    return f"{action} · {kind_of(model)} · {model.n_states} states · {points} points"


def visibility(model: ParametricHMM, thetas: Floats) -> Floats:
    """By how many standard deviations the pose of each state changes over the range of each parameter.

    The range times the square root of the diagonal of J' C^-1 J, where J is the derivative of the state's mean and C
    its covariance; root mean square over theta (M, P). Shape (N, P).
    """
    span = np.ptp(bounds(model), axis=0)
    squares = np.zeros((model.n_states, len(span)))
    for theta in thetas:
        inverse = np.linalg.inv(model.at(theta).covariances_)
        for number, width in enumerate(span):
            step = np.zeros(len(span))
            step[number] = STEP * (width or 1.0)
            slope = (model.state_means(theta + step) - model.state_means(theta - step)) / (2.0 * step[number])
            squares[:, number] += np.einsum("nd,nde,ne->n", slope, inverse, slope) * width**2
    return np.sqrt(squares / len(thetas))


def state_seconds(model: ParametricHMM, theta: Floats) -> tuple[Floats, Floats, str]:
    """Mean and standard deviation of the time in each state (N,), and their unit: s, or % of the movement."""
    durations = model.at(theta).durations_
    frames = expected_durations(durations)
    square = durations @ np.arange(1, durations.shape[1] + 1) ** 2
    deviation = np.sqrt(np.maximum(square - frames**2, 0.0))
    whole = description_of(model).duration
    scale = (whole or 100.0) / frames.sum()
    return frames * scale, deviation * scale, "s" if whole else "% of the movement"


def _among_others(
    figure: Figure, cell: Any, model: ParametricHMM, drawn: DrawnPoint, paths: Iterable[Floats], title: str
) -> Any:
    """Axes in space that hold the paths (T, 3), with the movements of the training's range drawn faintly."""
    around = model.state_means(grid(bounds(model)))[..., drawn.columns]
    space = space_axes(figure, cell, [*around, *paths], title)
    for other in around:
        space.plot(*other.T, color=FAINT, linewidth=0.6, alpha=0.6)
    return space


def _regions(
    axes: Axes, model: ParametricHMM, drawn: DrawnPoint, plane: tuple[int, int], wide: int, norm: Normalize
) -> None:
    """Means and 95 % regions of all states for three values of the widest parameter, the others in the middle."""
    low_high = bounds(model)
    columns = [drawn.columns.start + one for one in plane]
    for value in np.linspace(low_high[0, wide], low_high[1, wide], 3).tolist():
        theta = low_high.mean(axis=0)
        theta[wide] = value
        colour = colormaps[COLOURS](norm(value))
        hmm = model.at(theta)
        axes.plot(*hmm.means_[:, columns].T, ".-", color=colour, linewidth=1.0, markersize=3)
        for mean, covariance in zip(hmm.means_, hmm.covariances_, strict=True):
            add_ellipse(axes, mean[columns], covariance[np.ix_(columns, columns)], colour, alpha=0.18, lw=0)
    axes.set(aspect="equal", xlabel=f"{'xyz'[plane[0]]}, m", ylabel=f"{'xyz'[plane[1]]}, m")
    axes.set_title("from above" if plane == (1, 0) else "from the side", fontsize=10)
    axes.grid(alpha=0.3)


def _durations(axes: Axes, model: ParametricHMM) -> None:
    mean, deviation, unit = state_seconds(model, bounds(model).mean(axis=0))
    states = np.arange(1, model.n_states + 1)
    axes.bar(states, mean, yerr=deviation, color=ACTION_COLOURS[0], alpha=0.75, ecolor=INK, error_kw={"lw": 0.8})
    axes.set(xlabel="state", ylabel=f"time in the state, {unit}", xlim=(0.3, model.n_states + 0.7))
    axes.set_xticks(states[:: max(1, model.n_states // 20)])
    axes.set_title("expected duration of the states", fontsize=10)
    axes.grid(alpha=0.3, axis="y")


def _visibility(axes: Axes, model: ParametricHMM, thetas: Floats) -> None:
    changes = visibility(model, thetas)
    mean, _, _ = state_seconds(model, bounds(model).mean(axis=0))
    middle = 100.0 * (np.cumsum(mean) - 0.5 * mean) / mean.sum()
    for number, name in enumerate(parameter_names(model)):
        axes.plot(middle, changes[:, number], "o-", color=ACTION_COLOURS[number % 8], markersize=3, lw=1.4, label=name)
    axes.axhline(2.0, color=WARN, linewidth=0.8, linestyle=":")
    axes.set(xlabel="progress of the movement, %", ylabel="change over the range,\nstandard deviations", xlim=(0, 100))
    axes.set_yscale("log")
    axes.set_ylim(bottom=0.5)
    axes.set_title("where theta is visible (below the dotted line: hardly)", fontsize=10)
    axes.legend(fontsize=8, frameon=False)
    axes.grid(alpha=0.3)


def _plot_one(models: Mapping[str, ParametricHMM], recognition: Recognition) -> Figure:
    """Left the recorded path and the synthesised one, in the middle theta, right the actions."""
    model = models[recognition.action]
    drawn = drawn_point(model)
    recorded = recognition.movement.frames[:, drawn.columns]
    synthesised = model.synthesize(recognition.estimate.theta, 100)[:, drawn.columns]
    figure = new_figure(13.0, 5.2)
    layout = figure.add_gridspec(1, 3, width_ratios=[1.2, 1.1, 0.7])
    space = _among_others(figure, layout[0], model, drawn, [recorded], f"path of {drawn.name}")
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
