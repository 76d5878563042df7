"""The report on a run of relocation by pointing: one HTML file that needs no other."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from paramove.action_space import ball_colour
from paramove.bus import topics
from paramove.cameras import Frame, decode, encode
from paramove.documents import film, image, report_page, section, table
from paramove.runs import plots
from paramove.runs.after_a_run import write_report
from paramove.runs.pointing.video import drawn
from paramove.runs.recorded_run import RecordedRun
from paramove.runs.relocate_by_pointing.run import GOAL, SCALE, PointedRelocation

TRUE, ENDED = "#1d2530", "#d9a400"
RADIUS_CM = 1.0
PICTURE_PX = (480, 360)
CAMERA = topics.CAMERA_IMAGES[0].name


def write_relocation_report(
    run: RecordedRun, relocations: list[PointedRelocation], summary: dict[str, Any], video: Path | None
) -> Path:
    """Write `report.html` into the run's folder; the video is put into it."""
    good = summary["success"]
    title = run.title("Relocation by pointing")
    subtitle = summary["reason"] or f"{summary['good']} of {len(relocations)} times the object ended where it should"
    legend = (
        "Ring: where the person pointed; dashed, what counts as there "
        f"({1e3 * GOAL:.1f} mm, 3 cm at human scale). Dot: recognised, its colour how certain. Disc: the object."
    )
    pictures = _pictures(run, relocations)
    parts = [
        film(video),
        section("Numbers", f"Lengths at the robot's scale; the person is {SCALE} times a grown one.", _table(summary)),
        section("The working area from above", legend, plots.svg_of(plan, relocations, (7, 4.2))),
        *(
            section(f"Place {one.number}", _words(one), _two(pictures.get(one.number), one))
            for one in relocations
        ),
    ]  # fmt: skip
    return write_report(run.folder, report_page(title, title, subtitle, parts, good=good, style="img{width:100%}"))


def plan(relocations: list[PointedRelocation], figure: Figure) -> None:
    """All targets in one picture."""
    axes = figure.subplots()
    for one in relocations:
        _mark(axes, one)
        axes.annotate(
            str(one.number), (100 * one.final[1], 100 * one.final[0]), xytext=(9, 8), textcoords="offset points"
        )
    axes.add_patch(Rectangle((-17, 10), 30, 14, fill=False, ec="#c7cdd4", lw=1, ls="--"))
    axes.set(xlim=(14, -18), ylim=(9, 25), aspect="equal", xlabel="y, cm (left ↔ right)", ylabel="x, cm (forward)")


def close_up(one: PointedRelocation, figure: Figure) -> None:
    """One target, 5 cm around it."""
    axes = figure.subplots()
    _mark(axes, one)
    x, y = 100 * (one.final if one.pointed is None else one.pointed)
    axes.set(xlim=(y + 3, y - 3), ylim=(x - 2.5, x + 2.5), aspect="equal", xlabel="y, cm", ylabel="x, cm")


def _mark(axes: Any, one: PointedRelocation) -> None:
    final, recognised = 100 * one.final, 100 * one.recognised
    axes.add_patch(Circle((final[1], final[0]), RADIUS_CM, color=ENDED, alpha=0.45, lw=0))
    if one.pointed is not None:
        x, y = 100 * one.pointed
        axes.plot(y, x, "o", mfc="none", mec=TRUE, ms=9)
        axes.add_patch(Circle((y, x), 100 * GOAL, fill=False, ec=TRUE, lw=0.8, ls="--"))
    axes.plot(recognised[1], recognised[0], "o", color=ball_colour(one.certainty), mec=TRUE, mew=0.5, ms=6)


def _words(one: PointedRelocation) -> str:
    if one.pointed is None:
        return "No pointing before."
    sure = f"recognised {1e3 * one.recognition_error:.1f} mm from it, certain to {100 * one.certainty:.0f} %"
    end = f"the object ended {1e3 * one.error:.1f} mm from it, {1e2 * one.error / SCALE:.1f} cm at human scale"
    return f"{sure}; {end}; {'good' if one.good else 'not good'}."


def _two(picture: bytes | None, one: PointedRelocation) -> str:
    view = "" if picture is None else image(picture, "", "jpeg")
    return f"<div class=two><div>{view}</div><div>{plots.svg_of(close_up, one, (4.4, 3.6))}</div></div>"


def _table(summary: dict[str, Any]) -> str:
    heads = ("place", "certain", "recognition error, mm", "placing error, mm", "error, mm", "at human scale, cm", "")
    errors = ("recognition_error_mm", "placing_error_mm", "error_mm", "error_cm_at_human_scale")
    rows = [
        [
            str(number),
            f"{100 * one['certainty']:.0f} %",
            *("–" if one[name] is None else f"{one[name]:.1f}" for name in errors),
            "<span class=yes>good</span>" if one["good"] else f"<span class=no>{escape(one['reason'] or 'no')}</span>",
        ]
        for number, one in enumerate(summary["relocations"], start=1)
    ]
    return table(heads, rows, numbers=range(1, 6))


def _pictures(run: RecordedRun, relocations: list[PointedRelocation]) -> dict[int, bytes]:
    """Number of a relocation -> the first camera's image when the target was recognised, with the ball, JPEG."""
    outlines = {
        recorded.log_ns: recorded.message for recorded in run.recording("recording").read({topics.ACTION_OUTLINE.name})
    }
    times = np.array(sorted(outlines)) if outlines else np.empty(0)
    needed = {
        int(times[np.abs(times - 1e9 * one.recognised_s).argmin()]): one.number for one in relocations if len(times)
    }
    pictures = {}
    for recorded in run.recording("recording").read({CAMERA}):
        if recorded.log_ns in needed:
            picture = drawn(decode(recorded.message), outlines[recorded.log_ns], "", PICTURE_PX)
            pixels = np.ascontiguousarray(picture[:, :, ::-1])
            pictures[needed[recorded.log_ns]] = encode(Frame(pixels, 0, 0), 85).data
    return pictures
