"""The plots of the imitation experiment: figures 5.15 to 5.18 of the thesis, joint limits, and the whole table."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paramove.runs import STYLE
from studies.imitation.errors import SIGNIFICANT, Errors
from studies.imitation.experiment import (
    CENTRE,
    THESIS_TARGETS,
    Comparison,
    Experiment,
    Target,
    maxima,
    table_grid,
)

BLUE, RED, BLACK, MAGENTA, GREEN = "#2f6fc4", "#c8372d", "#1d2530", "#b0309a", "#1f7a45"
ELBOW_LINES = (
    ("elbow", BLUE, "interpolation ‖q − q̂‖"),
    ("effective", RED, "effective ‖q′ − q̂′‖"),
    ("min_imitation", BLACK, "imitation, reference ‖q̂′ − q̂‖"),
    ("imitation", MAGENTA, "imitation ‖q′ − q̂‖"),
)


def png_of(draw: Callable[[Experiment, Figure], None], experiment: Experiment, size: tuple[float, float]) -> bytes:
    """A plot as PNG; `size` in inches."""
    with mpl.rc_context(cast(Any, STYLE)):
        figure = Figure(figsize=size, layout="constrained")
        draw(experiment, figure)
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=110, metadata={"Software": None})
    return file.getvalue()


def gripper(experiment: Experiment, figure: Figure) -> None:
    """Figures 5.15 and 5.16: synthesis error of the gripper over the states."""
    for axes, target, name in zip(_row(figure), THESIS_TARGETS, ("5.15", "5.16"), strict=True):
        _states(axes, experiment, target, f"{target.name} (figure {name})")
        _line(axes, experiment, target, "gripper", GREEN, "‖r − r̂‖")
        _line(axes, experiment, target, "gripper", GREEN, "the same after time warping", aligned=True)
        axes.hlines(8.0, *SIGNIFICANT, colors="#777777", linestyles=":", lw=1.2, label="thesis: below 8 mm")
        axes.set_ylim(0, None)
        axes.legend(loc="upper center")


def elbow(experiment: Experiment, figure: Figure) -> None:
    """Figures 5.17 and 5.18: errors of the elbow over the states; below, after time warping."""
    rows = figure.subplots(2, 2, sharex=True, sharey=True)
    for column, (target, name) in enumerate(zip(THESIS_TARGETS, ("5.17", "5.18"), strict=True)):
        for axes, aligned in ((rows[0, column], False), (rows[1, column], True)):
            alignment = ", after time warping" if aligned else ""
            _states(axes, experiment, target, f"{target.name}{alignment} (figure {name})")
            for attribute, colour, label in ELBOW_LINES:
                _line(axes, experiment, target, attribute, colour, label, aligned=aligned)
            if not aligned:
                _line(axes, experiment, target, "elbow", "#8db4e8", "interpolated as a point", linear=True)
    rows[0, 0].set_xlabel("")
    rows[0, 1].set_xlabel("")
    handles, labels = rows[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    rows[0, 0].set_ylim(0, None)


def limits(experiment: Experiment, figure: Figure) -> None:
    """What joint limits change: how far they are exceeded, and the errors with and without those states."""
    rows = figure.subplots(2, 2, sharex=True, height_ratios=(2, 1.3))
    for column, target in enumerate(THESIS_TARGETS):
        upper, lower = rows[0, column], rows[1, column]
        _states(upper, experiment, target, target.name)
        upper.set_xlabel("")
        for attribute, colour, label in (ELBOW_LINES[1], ELBOW_LINES[3]):
            _line(upper, experiment, target, attribute, colour, f"{label}, closed form")
            _line(upper, experiment, target, attribute, colour, f"{label}, within limits", executed=True)
        limited = np.any([c.errors().limited for c in experiment.of(target)], axis=0)
        for axes in (upper, lower):
            axes.fill_between(
                np.arange(1, len(limited) + 1),
                0,
                1,
                where=list(limited),
                step="mid",
                color="#f2c894",
                alpha=0.5,
                lw=0,
                transform=axes.get_xaxis_transform(),
                label="a joint limit moves the elbow",
            )
        _excess(lower, experiment, target)
        upper.set_ylim(0, None)
    handles, labels = rows[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)


def _excess(axes: Axes, experiment: Experiment, target: Target) -> None:
    comparisons = experiment.of(target)
    outside = np.rad2deg(np.max([c.synthesised.outside for c in comparisons], axis=0))
    turn = np.rad2deg(np.max([np.abs(c.synthesised.within_limits.elbow_turn) for c in comparisons], axis=0))
    states = np.arange(1, len(outside) + 1)
    for column, joint in enumerate(experiment.joints):
        if outside[:, column].any():
            axes.plot(states, outside[:, column], lw=1.3, label=f"{joint.replace('_', ' ')} beyond its limit")
    axes.plot(states, turn, lw=1.3, ls="--", c=BLACK, label="elbow turned")
    axes.set(xlabel="state", ylabel="deg", ylim=(0, None))
    axes.legend(fontsize=7.5)


def over_the_table(experiment: Experiment, figure: Figure) -> None:
    """Held-out targets on the lower face of the cuboid: largest errors, median over the demonstrators."""
    quantities = (
        ("gripper_at_target", "gripper at the target"),
        ("gripper", "gripper"),
        ("gripper_aligned", "gripper, after time warping"),
        ("imitation_excess", "imitation error above the reference's"),
        ("effective", "effective elbow error"),
        ("effective_aligned", "effective, after time warping"),
    )
    all_axes = figure.subplots(2, 3, sharex=True, sharey=True)
    for axes, (name, title) in zip(all_axes.flat, quantities, strict=True):
        _map(axes, experiment, name, title)


def _map(axes: Axes, experiment: Experiment, name: str, title: str) -> None:
    errors: list[tuple[float, float, float]] = []
    for target in table_grid():
        comparisons = experiment.of(_known(target))
        if comparisons:
            value = float(np.median([maxima(comparison)[name] for comparison in comparisons]))
            errors.append((target.coordinates[1], target.coordinates[0], value))
    across, forward, values = np.array(errors).T
    axes.scatter(across, forward, c=values, cmap="YlOrRd", vmin=0, vmax=18, s=900, marker="s")
    for v, u, value in errors:
        axes.text(v, u, f"{value:.1f}", ha="center", va="center", fontsize=9, c="white" if value > 12 else BLACK)
    axes.plot([0, 0, 1, 1], [0, 1, 0, 1], "k^", ms=7)
    axes.set(title=f"{title}, mm", xlim=(1.15, -0.15), ylim=(-0.25, 1.25), yticks=[0, 0.5, 1], xticks=[0, 0.5, 1])
    axes.set_xticklabels(["right", "", "left"])
    axes.set_yticklabels(["near", "", "far"])
    axes.grid(visible=False)


def _known(target: Target) -> Target:
    same = [known for known in THESIS_TARGETS if known.coordinates == target.coordinates]
    return same[0] if same else target


def arms(experiment: Experiment, figure: Figure) -> None:
    """Person's scaled arm and robot's arm, from the side and from above, when the hand is nearest and at the target."""
    comparison = experiment.of(CENTRE)[0]
    lengths = np.linalg.norm(comparison.against.proposed.gripper[SIGNIFICANT[0] - 1 : 40], axis=1)
    states = (SIGNIFICANT[0] - 1 + int(lengths.argmin()), comparison.reach_state - 1)
    rows = figure.subplots(2, 2)
    for column, state in enumerate(states):
        for axes, (first, second), (x, y) in (
            (rows[0, column], (0, 2), ("forward", "up")),
            (rows[1, column], (0, 1), ("forward", "left")),
        ):
            _arm(axes, comparison, state, (first, second))
            axes.set(xlabel=f"{x}, mm", ylabel=f"{y}, mm", aspect="equal", title=f"state {state + 1}")
            axes.set(xlim=(-90, 160), ylim=(-115, 15))
    handles, labels = rows[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)


def _arm(axes: Axes, comparison: Comparison, state: int, parts: tuple[int, int]) -> None:
    person, synthesised = comparison.against, comparison.synthesised
    for elbow_at, gripper_at, colour, style, label in (
        (person.proposed.elbow, person.proposed.gripper, BLACK, "-", "person, scaled (q̂, r̂)"),
        (person.closed_form.elbow, person.proposed.gripper, BLACK, "--", "the same on the robot (q̂′)"),
        (synthesised.proposed.elbow, synthesised.proposed.gripper, BLUE, "-", "synthesised (q, r)"),
        (synthesised.closed_form.elbow, synthesised.proposed.gripper, RED, "--", "synthesised on the robot (q′)"),
    ):
        line = 1000.0 * np.stack([np.zeros(3), elbow_at[state], gripper_at[state]])[:, list(parts)]
        axes.plot(line[:, 0], line[:, 1], c=colour, ls=style, marker="o", ms=4, lw=1.8, label=label)


def _row(figure: Figure) -> list[Axes]:
    return list(figure.subplots(1, 2, sharey=True))


def _states(axes: Axes, experiment: Experiment, target: Target, title: str) -> None:
    axes.axvspan(*SIGNIFICANT, color="#eef2f6", lw=0, zorder=0)
    reach = experiment.of(target)[0].reach_state
    axes.axvline(reach, c="#999999", lw=0.8)
    axes.set(xlabel="state", ylabel="mm", title=title, xlim=(1, 80))


def _line(
    axes: Axes, experiment: Experiment, target: Target, attribute: str, colour: str, label: str, **how: bool
) -> None:
    """Median over the demonstrators, with minimum and maximum as a band."""
    states = np.arange(1, len(experiment.of(target)[0].synthesised.outside) + 1)
    errors: list[Errors] = [comparison.errors(**how) for comparison in experiment.of(target)]
    courses = np.array([np.interp(states, one.state, getattr(one, attribute)) for one in errors])
    dashed = how.get("executed", False) or (how.get("aligned", False) and attribute == "gripper")
    axes.plot(states, np.median(courses, axis=0), c=colour, lw=1.6, ls="--" if dashed else "-", label=label)
    if not dashed:
        axes.fill_between(states, courses.min(axis=0), courses.max(axis=0), color=colour, alpha=0.13, lw=0)


PLOTS: tuple[tuple[str, Callable[[Experiment, Figure], None], tuple[float, float]], ...] = (
    ("gripper", gripper, (10.5, 3.6)),
    ("elbow", elbow, (10.5, 7.2)),
    ("limits", limits, (10.5, 6.0)),
    ("arms", arms, (8.5, 6.6)),
    ("table", over_the_table, (11.5, 5.6)),
)
