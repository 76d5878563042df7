"""The report on real images: numbers and plots on empty canvases. A face is visible, so no picture is ever shown."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats, report_page, section, table
from studies.chapter4.drawing import drawn
from studies.real_images.experiment import JUDGED, Replay, mean_of
from studies.real_images.scores import FAR_PX, RANGES, Reference, middle_of_hand

SHOWN_FRAMES = (0, 7, 20, 34, 42, 46, 50, 60)
MAX_PX = 250.0
OURS, THEIRS = "#2f6fc4", "#c8372d"
WHAT = (
    "A seated person points to the own right and then slides the arm across the body and up. Pose of the camera, "
    "position of the shoulder and the arm's sizes were set on frame 0 alone. Distances are those of the middle of the "
    "estimated hand from the middle of the skin of the visible one; the rate of the pictures is assumed. Medians of "
    "the frames, means of the seeds; in space of all frames."
)
OUTLINES = (
    "Blue: outline of the estimated arm of the first seed, as published on the bus, and the middle of its hand. Red: "
    "the reference. The pictures themselves are not shown, as a face is visible in them."
)


COLUMNS = {
    **{f"{name}, px": (name, "median_px") for name in RANGES},
    "farther than 50 px": ("all frames", "far_frames"),
    "lost": ("all frames", "lost_frames"),
    "hand, cm": ("all frames", "hand_cm"),
    "from the shoulder, cm": ("all frames", "from_shoulder_cm"),
    "direction, deg": ("all frames", "direction_deg"),
    "frames 32-50: hand, cm": ("frames 32-50", "hand_cm"),
    "from the shoulder there, cm": ("frames 32-50", "from_shoulder_cm"),
    "direction there, deg": ("frames 32-50", "direction_deg"),
}
HEADS = tuple(COLUMNS)


def row_of(runs: Sequence[dict[str, Any]]) -> list[str]:
    """Means of the seeds of a case, one for each of `HEADS`."""
    values = [mean_of(runs, *column) for column in COLUMNS.values()]
    return ["–" if value is None else f"{value:.1f}" for value in values]


def write_report(
    replays: Sequence[Replay], numbers: Mapping[str, Any], reference: Reference, camera: CalibratedCamera, folder: Path
) -> Path:
    """Writes `report.html` and `real_images.json` into the folder; returns the page's path."""
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(numbers, indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False) + "\n"
    (folder / "real_images.json").write_text(text, encoding="utf-8")
    judged = [replay for replay in replays if replay.case == JUDGED]
    cases = numbers["cases"]
    rows = [row_of(runs) for runs in cases.values()]
    parts = [
        section("Distances", WHAT, table(["", *cases], list(zip(HEADS, *rows, strict=True)))),
        section("Goals", "", table(["case", "frames", "number", "goal", "mean of the seeds", "met"], _goals(numbers))),
        section("Frame by frame", "Each line is a seed; grey: the judged frames.",
                drawn(partial(_over_frames, replays=replays), (11.0, 7.2))),
        section("Estimates", OUTLINES,
                drawn(partial(_outlines, replay=judged[0], pixels=reference.pixels, camera=camera), (11.0, 4.6))),
    ]  # fmt: skip
    title = "Tracking on real images"
    verdict = "goals met" if numbers["met"] else "some goals missed"
    page = folder / "report.html"
    page.write_text(report_page(title, f"{title}: {verdict}", "", parts, good=numbers["met"]), encoding="utf-8")
    return page


def _goals(numbers: Mapping[str, Any]) -> list[list[str]]:
    keys = ("case", "frames", "number", "goal", "mean")
    return [[*(str(one[key]) for key in keys), "yes" if one["met"] else "no"] for one in numbers["goals"]]


def _over_frames(figure: Figure, replays: Sequence[Replay]) -> None:
    """Distance of the middle of the hand, one panel for each case."""
    cases = list(dict.fromkeys(replay.case for replay in replays))
    for axes, case in zip(figure.subplots(len(cases), 1, sharex=True, squeeze=False)[:, 0], cases, strict=True):
        for replay in (one for one in replays if one.case == case):
            axes.plot(replay.distances.frames, replay.distances.pixels, color=OURS, lw=0.9, alpha=0.7)
        for first, last in RANGES.values():
            axes.axvspan(first - 0.5, last + 0.5, color="#dfe4ea", lw=0, zorder=0)
        axes.axhline(FAR_PX, color=THEIRS, lw=0.8)
        axes.set(ylim=(0.0, MAX_PX), ylabel="px", title=case.name)
    figure.axes[-1].set_xlabel("frame")


def _outlines(figure: Figure, replay: Replay, pixels: Floats, camera: CalibratedCamera) -> None:
    """The estimated arm and the reference on empty canvases."""
    chosen = [one for one in replay.estimates if one.frame in SHOWN_FRAMES]
    for axes, one in zip(figure.subplots(2, 4, sharex=True, sharey=True).ravel(), chosen, strict=False):
        closed = np.concatenate([one.outline, one.outline[:1]])
        axes.plot(*closed.T, color=OURS, lw=1.0)
        axes.plot(*camera.project(middle_of_hand(one.pose))[0], "o", color=OURS, ms=3)
        axes.plot(*pixels[one.frame], "x", color=THEIRS, ms=6)
        axes.set(xlim=(0, camera.width_px), ylim=(camera.height_px, 0), title=f"frame {one.frame}", aspect="equal")
