"""The report on real images: numbers and plots on empty canvases. A face is visible, so no picture is ever shown."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats, report_page, section
from studies.chapter4.drawing import drawn
from studies.real_images.experiment import JUDGED, Replay
from studies.real_images.scores import GOAL_PX, RANGES, middle_of_hand

SHOWN_FRAMES = (0, 7, 20, 34, 42, 46, 50, 60)
MAX_PX = 250.0
OURS, THEIRS = "#2f6fc4", "#c8372d"
WHAT = (
    "A seated person points to the own right and then slides the stretched arm across the body and up. Pose of the "
    "camera, position of the shoulder and the arm's sizes were set on frame 0 alone. The distance is that of the "
    "middle of the estimated hand from the middle of the skin of the visible one; the rate of the pictures is assumed."
)
OUTLINES = (
    "Blue: outline of the estimated arm of the first seed, as published on the bus, and the middle of its hand. Red: "
    "the reference. The pictures themselves are not shown, as a face is visible in them."
)


def write_report(
    replays: Sequence[Replay], numbers: Mapping[str, Any], reference: Floats, camera: CalibratedCamera, folder: Path
) -> Path:
    """Writes `report.html` and `real_images.json` into the folder; returns the page's path."""
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(numbers, indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False) + "\n"
    (folder / "real_images.json").write_text(text, encoding="utf-8")
    judged = [replay for replay in replays if replay.case == JUDGED]
    verdict = "goal met" if numbers["met"] else "goal missed"
    parts = [
        section("Distances, px", WHAT, _table(numbers["cases"])),
        section("Frame by frame", "Each line is a seed; grey: the judged frames.",
                drawn(partial(_over_frames, replays=replays), (11.0, 7.2))),
        section("Estimates", OUTLINES,
                drawn(partial(_outlines, replay=judged[0], reference=reference, camera=camera), (11.0, 4.6))),
    ]  # fmt: skip
    title = "Tracking on real images"
    goal = f"Goal: the median at most {GOAL_PX:g} px in both ranges of frames, with every seed."
    page = folder / "report.html"
    text = report_page(title, f"{title}: {verdict}", goal, parts, good=numbers["met"])
    page.write_text(text, encoding="utf-8")
    return page


def _table(cases: Mapping[str, Any]) -> str:
    heads = ["", "seed"]
    heads += [f"{name}: {what}" for name in RANGES for what in ("median", "of the fingertip", "farther than 50")]
    rows = ["".join(f"<th>{escape(head)}</th>" for head in heads)]
    for name, case in cases.items():
        for run in case["runs"]:
            cells = [f"<td>{escape(name)}</td><td class=n>{run['seed']}</td>"]
            for part in (run[one] for one in RANGES):
                kind = "yes" if part["median_px"] is not None and part["median_px"] <= GOAL_PX else "no"
                cells.append(f"<td class='n {kind}'>{_formatted(part['median_px'])}</td>")
                cells.append(f"<td class=n>{_formatted(part['median_of_tip_px'])}</td>")
                cells.append(f"<td class=n>{part['far_frames']} of {part['frames']}</td>")
            rows.append("".join(cells))
    return "<table>" + "".join(f"<tr>{row}</tr>" for row in rows) + "</table>"


def _formatted(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"


def _over_frames(figure: Figure, replays: Sequence[Replay]) -> None:
    """Distance of the middle of the hand, one panel for each case."""
    cases = list(dict.fromkeys(replay.case for replay in replays))
    for axes, case in zip(figure.subplots(len(cases), 1, sharex=True, squeeze=False)[:, 0], cases, strict=True):
        for replay in (one for one in replays if one.case == case):
            axes.plot(replay.distances.frames, replay.distances.middle, color=OURS, lw=0.9, alpha=0.7)
        for first, last in RANGES.values():
            axes.axvspan(first - 0.5, last + 0.5, color="#dfe4ea", lw=0, zorder=0)
        axes.axhline(GOAL_PX, color=THEIRS, lw=0.8)
        axes.set(ylim=(0.0, MAX_PX), ylabel="px", title=case.name)
    figure.axes[-1].set_xlabel("frame")


def _outlines(figure: Figure, replay: Replay, reference: Floats, camera: CalibratedCamera) -> None:
    """The estimated arm and the reference on empty canvases."""
    chosen = [one for one in replay.estimates if one.frame in SHOWN_FRAMES]
    for axes, one in zip(figure.subplots(2, 4, sharex=True, sharey=True).ravel(), chosen, strict=False):
        closed = np.concatenate([one.outline, one.outline[:1]])
        axes.plot(*closed.T, color=OURS, lw=1.0)
        axes.plot(*camera.project(middle_of_hand(one.pose))[0], "o", color=OURS, ms=3)
        axes.plot(*reference[one.frame], "x", color=THEIRS, ms=6)
        axes.set(xlim=(0, camera.width_px), ylim=(camera.height_px, 0), title=f"frame {one.frame}", aspect="equal")
