"""The plots of a run's report, as SVG."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from typing import Any, TypeVar, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from paramove.bus import topics
from paramove.msgs.gesture_pb2 import Gesture
from paramove.runs.relocations import stages_of
from paramove.runs.rule_learning.accuracy import GOAL_MM, GRID_STEPS, GRID_X, GRID_Y
from paramove.runs.rule_learning.summary import RunEvaluation

COLOURS = {"yellow": "#d9a400", "green": "#2f9e57", "blue": "#3367d6"}
STAGE_COLOURS = {"calibrate": "#b9c6d6", "learn": "#f2c894", "apply": "#a9d6bd", "failed": "#e6a4a0"}
OTHER = "#5b6470"
STYLE: dict[str, Any] = {
    "font.size": 9,
    "font.family": "DejaVu Sans",
    "axes.edgecolor": "#9aa3ad",
    "axes.labelcolor": "#39424e",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e7eaee",
    "xtick.color": OTHER,
    "ytick.color": OTHER,
    "legend.frameon": False,
    "svg.hashsalt": "paramove",  # the same run gives the same file
}
THINNING = 3

Subject = TypeVar("Subject")


def svg_of(draw: Callable[[Subject, Figure], None], subject: Subject, size: tuple[float, float]) -> str:
    """A plot of the subject as an SVG element; `size` in inches."""
    with mpl.rc_context(cast(Any, STYLE)):
        figure = Figure(figsize=size, layout="constrained")
        draw(subject, figure)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None}, transparent=True)
    svg = text.getvalue()
    return re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)


def timeline(evaluation: RunEvaluation, figure: Figure) -> None:
    """Stages, goals of the arm, and the robot's observations, over time."""
    axes: Axes = figure.subplots()
    for stage in stages_of(evaluation.run):
        begin, length = stage["begin_s"], stage["end_s"] - stage["begin_s"]
        axes.broken_barh([(begin, length)], (2.1, 0.8), facecolors=STAGE_COLOURS.get(stage["stage"], "#dddddd"))
        axes.text(begin + length / 2, 2.5, stage["stage"], ha="center", va="center", fontsize=9.5, weight="bold")
    for goal in evaluation.relocations:
        colour = COLOURS.get(goal.goal.object, OTHER)
        length = max(goal.ended_s - goal.begun_s, 0.3)
        failed = goal.result not in ("succeeded", "unfinished")
        axes.broken_barh(
            [(goal.begun_s, length)], (1.1, 0.8), facecolors=colour, alpha=0.85, hatch="///" if failed else None
        )
        if length > 0.03 * evaluation.run.end_s:
            axes.text(
                goal.begun_s + length / 2,
                1.5,
                goal.kind.replace("_", "\n"),
                ha="center",
                va="center",
                fontsize=6.5,
                color="white",
            )
    _gestures(evaluation, axes)
    axes.set_yticks([0.5, 1.5, 2.5], ["detects", "does", "stage"])
    axes.set(xlim=(0, max(evaluation.run.end_s, 1.0)), ylim=(0, 3), xlabel="simulated time, s")
    axes.grid(visible=False, axis="y")


def _gestures(evaluation: RunEvaluation, axes: Axes) -> None:
    marks = {
        Gesture.KIND_MOVED: (">", "moves"),
        Gesture.KIND_RESTED: ("s", "rests"),
        Gesture.KIND_VANISHED: ("x", "vanishes"),
        Gesture.KIND_POINTED_AT: ("*", "is pointed at"),
    }
    heights = {name: 0.25 + 0.25 * row for row, name in enumerate(sorted(evaluation.run.truth.objects))}
    for kind, (mark, text) in marks.items():
        messages = [r.message for r in evaluation.run.received(topics.GESTURES) if r.message.kind == kind]
        known = [m for m in messages if m.object in heights]
        axes.scatter(
            [m.captured.ToNanoseconds() * 1e-9 for m in known],
            [heights[m.object] for m in known],
            c=[COLOURS.get(m.object, OTHER) for m in known],
            marker=mark,
            s=70 if mark == "*" else 18,
            linewidths=1,
            zorder=3,
        )
        axes.scatter([], [], c=OTHER, marker=mark, s=70 if mark == "*" else 18, label=text)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4)


def plan(evaluation: RunEvaluation, figure: Figure) -> None:
    """The working surface from above in cm: openings, corners, true and estimated positions."""
    axes: Axes = figure.subplots()
    truth, run = evaluation.run.truth, evaluation.run
    radius = 100 * truth.layout.openings[0].radius if truth.layout.openings else 0.0
    for opening in truth.openings.values():
        axes.add_patch(Circle((100 * opening[1], 100 * opening[0]), radius, fill=False, ec=OTHER, lw=1.2))
    calibrations = run.received(topics.CALIBRATION_PLANE)
    corners = calibrations[-1].message.correspondences if calibrations else ()
    axes.plot([100 * c.y for c in corners], [100 * c.x for c in corners], "+", c="black", ms=9, label="corners placed")
    for rule in evaluation.rules:
        colour = COLOURS.get(rule["object"], OTHER)
        x, y = rule["true"]
        axes.add_patch(Circle((100 * y, 100 * x), radius, color=colour, alpha=0.25, lw=0))
        if rule["believed"] is not None:
            bx, by = rule["believed"]
            axes.plot(100 * by, 100 * bx, "x", c=colour, ms=9, mew=2.2)
    for item in evaluation.detections:
        colour = COLOURS.get(item.object, OTHER)
        axes.add_patch(Circle((100 * item.true[1], 100 * item.true[0]), 1.0, fill=False, ec=colour, lw=0.8, alpha=0.7))
        axes.plot(100 * item.estimated[1], 100 * item.estimated[0], ".", c=colour, ms=5)
    for grasp in evaluation.grasps:
        if grasp.stage == "apply":
            start, end = 100 * grasp.source, 100 * grasp.target
            axes.annotate(
                "",
                (end[1], end[0]),
                (start[1], start[0]),
                arrowprops={"arrowstyle": "->", "color": COLOURS.get(grasp.goal.object, OTHER), "lw": 1.2, "ls": ":"},
            )
    axes.plot([], [], "x", c=OTHER, ms=8, mew=2, label="estimated opening")
    axes.plot([], [], ".", c=OTHER, label="object detected at rest (ring: truth)")
    axes.add_patch(Rectangle((-17, 10), 30, 14, fill=False, ec="#c7cdd4", lw=1, ls="--"))
    axes.set(xlim=(14, -18), ylim=(8.5, 25), aspect="equal", xlabel="y, cm (left ↔ right)", ylabel="x, cm (forward)")
    axes.legend(loc="upper center", ncols=3, fontsize=7.5, bbox_to_anchor=(0.5, 1.14))


def homography(evaluation: RunEvaluation, figure: Figure) -> None:
    """Error of the robot's calibration over its working area."""
    axes: Axes = figure.subplots()
    grid = evaluation.grid
    if grid is None:
        axes.text(0.5, 0.5, "the robot never calibrated its camera", ha="center", transform=axes.transAxes)
        axes.set_axis_off()
        return
    errors = grid.errors_mm.reshape(GRID_STEPS)
    x, y = (100 * np.linspace(*side, steps) for side, steps in zip((GRID_X, GRID_Y), GRID_STEPS, strict=True))
    levels = np.linspace(0.0, max(GOAL_MM, float(errors.max())), 13)
    filled = axes.contourf(y, x, errors, levels=levels, cmap="viridis_r")
    figure.colorbar(filled, ax=axes, label="error, mm", orientation="horizontal", aspect=40, format="%.1f")
    arrows = slice(None, None, 7)
    off = 100 * (grid.estimated - grid.true)
    axes.quiver(
        100 * grid.true[arrows, 1],
        100 * grid.true[arrows, 0],
        off[arrows, 1],
        off[arrows, 0],
        angles="xy",
        scale_units="xy",
        scale=0.2,
        color="white",
        width=0.004,
    )
    axes.set(aspect="equal", xlabel="y, cm (arrows: five times the error)", ylabel="x, cm")
    axes.invert_xaxis()


def motion(evaluation: RunEvaluation, figure: Figure) -> None:
    """Joint angles, height of the gripper, and its error, over time."""
    above, middle, below = figure.subplots(3, 1, sharex=True, height_ratios=[2, 1.3, 1])
    _joints(evaluation, above)
    truth = evaluation.run.truth
    time_s = truth.time_s[::THINNING]
    middle.plot(time_s, 1e3 * (truth.gripper[::THINNING, 2] - truth.surface_z), c="#3a4a5e", lw=1)
    middle.set_ylabel("gripper above\nsurface, mm")
    middle.axhline(0, c="#b04a3a", lw=0.8)
    error = 1e3 * np.linalg.norm(truth.gripper - truth.commanded, axis=1)
    below.plot(time_s, error[::THINNING], c="#3a4a5e", lw=0.8, label="in the world to commanded")
    for kind, mark in (("grasp", "v"), ("place", "^")):
        samples = [sample for sample in evaluation.samples if sample.kind == kind]
        below.plot(
            [s.time_s for s in samples], [s.commanded_error_mm for s in samples], mark, ms=5, label=f"{kind}: to target"
        )
    below.set_ylabel("gripper\nerror, mm")
    below.set_xlabel("simulated time, s")
    below.legend(ncols=3, fontsize=7.5, loc="upper right")
    for axes in (above, middle, below):
        for stage in stages_of(evaluation.run)[1:]:
            axes.axvline(stage["begin_s"], c="#9aa3ad", lw=0.8, ls=":")
    below.set_xlim(0, max(evaluation.run.end_s, 1.0))


def _joints(evaluation: RunEvaluation, axes: Axes) -> None:
    arm = evaluation.robot.arms["right"]
    states = evaluation.run.received(topics.ARM_JOINT_STATES)[::THINNING]
    names = (*arm.joints, arm.fingers)
    angles = np.full((len(states), len(names)), np.nan)
    for row, recorded in enumerate(states):
        measured = {joint.name: joint.position for joint in recorded.message.joints}
        angles[row] = [measured.get(name, np.nan) for name in names]
    time_s = [recorded.log_ns * 1e-9 for recorded in states]
    for name, column in zip(names, np.rad2deg(angles).T, strict=True):
        axes.plot(time_s, column, lw=1, label=name.removeprefix("right_").replace("_", " "))
    axes.set_ylabel("joint angle, °")
    axes.legend(ncols=6, fontsize=7.5, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def contacts(evaluation: RunEvaluation, figure: Figure) -> None:
    """Deepest penetration so far and unwanted contacts so far, over time."""
    axes: Axes = figure.subplots()
    truth = evaluation.run.truth
    axes.step(truth.time_s, truth.penetration_mm, where="post", c="#3a4a5e", lw=1.2, label="deepest penetration so far")
    axes.axhline(0.7, c="#b04a3a", lw=0.9, ls="--", label="limit")
    axes.set(xlim=(0, max(evaluation.run.end_s, 1.0)), ylabel="mm", xlabel="simulated time, s")
    axes.set_ylim(0, max(0.8, 1.1 * float(truth.penetration_mm.max())))
    other = axes.twinx()
    other.step(truth.time_s, truth.unwanted_contacts, where="post", c="#b04a3a", lw=1.2, label="unwanted contacts")
    other.set_ylim(0, max(4.0, 1.2 * float(truth.unwanted_contacts.max())))
    other.set_ylabel("unwanted contacts")
    other.grid(visible=False)
    lines, labels = axes.get_legend_handles_labels()
    more, names = other.get_legend_handles_labels()
    axes.legend(lines + more, labels + names, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
