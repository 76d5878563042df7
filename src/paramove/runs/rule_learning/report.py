"""The report of a run: one HTML file that needs no other, to be read from top to bottom."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from paramove.documents import folded, report_page, section, table
from paramove.runs import plots
from paramove.runs.plots import svg_of
from paramove.runs.rule_learning.summary import RunEvaluation
from paramove.runs.verdict_table import percent, rows_of


def page(evaluation: RunEvaluation, video: Path | None) -> str:
    """The report as text."""
    summary = evaluation.summary
    parts = [
        _tiles(summary),
        _video(video),
        section(
            "What happened when",
            "Stages of the application, goals of the arm in the colour of the object, and the robot's observations.",
            svg_of(plots.timeline, evaluation, (11, 2.5)),
        ),
        _rules(summary),
        "<div class=two>",
        section(
            "The working surface from above",
            "Rings are true, crosses and dots are the robot's estimates. The robot stands below, looking up.",
            svg_of(plots.plan, evaluation, (5.6, 3.7)),
        ),
        section(
            "How well the robot knows its camera",
            "Error of its own calibration over the working area; the camera's true pose and lens are known only here.",
            svg_of(plots.homography, evaluation, (5.6, 3.7)),
        ),
        "</div><p></p>",
        _pointings(summary),
        _grasps(summary),
        section(
            "The arm",
            "Measured joint angles; the gripper's height; its distance from its command and from its targets.",
            svg_of(plots.motion, evaluation, (11, 5.6)),
        ),
        _contacts(evaluation),
        _topics(summary),
        _speech(summary),
        _origin(summary),
    ]
    placed = f"{summary['objects_placed']} of {len(summary['rules'])} objects rest in their own opening"
    title = evaluation.run.title("Rule learning")
    world = f"{title}, {summary['simulated_s']:.0f} s simulated"
    return report_page(
        title,
        f"{'Success' if summary['success'] else 'Failure'}: {placed}",
        f"{world}: {summary['reason']}. Judged by the recorded truth.",
        parts,
        good=summary["success"],
    )


def _tiles(summary: dict[str, Any]) -> str:
    tiles = (
        f"<div class='tile{'' if good else ' off'}'><b>{escape(result)}</b><span>{escape(name)}"
        f"{f' (goal {escape(goal)})' if goal else ''}</span></div>"
        for name, result, goal, good in rows_of(summary)
    )
    return f"<div class=tiles>{''.join(tiles)}</div>"


def _video(video: Path | None) -> str:
    if video is None:
        return ""
    data = base64.b64encode(video.read_bytes()).decode("ascii")
    return section(
        "The run",
        "Left, the camera with the robot's estimates; right, the world, which the robot does not see. Boxes: tracked "
        "objects. Circles: estimated openings, at the height of an object's middle. Arrow: its goal.",
        f"<video controls preload=metadata src='data:video/mp4;base64,{data}'></video>",
    )


def _rules(summary: dict[str, Any]) -> str:
    rows = [
        (
            _dot(rule["object"]),
            f"“{escape(rule['sentence'])}”" if rule["sentence"] else "<span class=soft>nothing learnt</span>",
            _place(rule["believed"]),
            _place(rule["true"]),
            _number(rule["error_mm"], 1),
            _yes(rule["right"]),
        )
        for rule in summary["rules"]
    ]
    heads = ("object", "the robot's statement", "estimated, cm", "true, cm", "error, mm", "right")
    return section(
        "The robot's estimates compared with the truth",
        "The robot saw the instructor carry each object into an opening; the positions of the openings were not given.",
        table(heads, rows, numbers=(2, 3, 4)),
    )


def _pointings(summary: dict[str, Any]) -> str:
    """With tracking in action space, each true or estimated target."""
    rows = [
        (
            f"{one['time_s']:.1f}",
            _dot(one["meant"]) if one["meant"] else "<span class=soft>nobody pointed</span>",
            _place(one["true"]),
            _place(one["believed"]),
            _dot(one["nearest"]) if one["nearest"] else "–",
            _number(one["error_mm"], 1),
            _number(one["spacing_mm"], 0),
            percent(one["error_of_spacing"]),
            percent(one["confidence"]),
        )
        for one in summary.get("pointing_list", ())
    ]
    if not rows:
        return ""
    heads = (
        *("s", "meant", "true, cm", "estimated, cm", "nearest", "error, mm", "next object, mm", "error of that"),
        "certain",
    )
    return section(
        "Where the person pointed",
        "Estimated: the target of the arm tracked in action space, in the robot's frame. True: the object's middle. "
        "The error is small enough while it is less than half of the distance to the next object.",
        table(heads, rows, numbers=(0, 2, 3, 5, 6, 7, 8)),
    )


def _grasps(summary: dict[str, Any]) -> str:
    rows = [
        (
            f"{grasp['begun_s']:.1f}–{grasp['ended_s']:.1f}",
            escape(grasp["stage"]),
            _dot(grasp["object"]),
            str(grasp["attempt"]),
            _place(grasp["from"]),
            _number(grasp["from_error_mm"], 1),
            _place(grasp["to"]),
            f"<span class={'yes' if grasp['result'] == 'succeeded' else 'no'}>{escape(grasp['result'])}</span>"
            + (f"<br><span class=soft>{escape(grasp['reason'])}</span>" if grasp["reason"] else ""),
            _number(grasp["elbow_turn_deg"], 1),
            _number(grasp.get("grasp_commanded_mm"), 2),
            _number(grasp.get("grasp_physical_mm"), 2),
            _number(grasp.get("place_commanded_mm"), 2),
            _number(grasp.get("place_physical_mm"), 2),
        )
        for grasp in summary["grasp_list"]
    ]
    heads = (
        *("s", "stage", "object", "try", "from, cm", "off, mm", "to, cm", "result", "elbow, °"),
        *("grasp: target, mm", "world, mm", "place: target, mm", "world, mm"),
    )
    return section(
        "Every grasp",
        "Off: how far the object truly stood from the robot's estimate. Elbow: turned because of a joint limit. "
        "Target: commanded gripper from its target. World: gripper from the commanded one.",
        (table(heads, rows, numbers=(0, 3, 4, 5, 6, 8, 9, 10, 11, 12)) if rows else "There was none.")
        + _rejected(summary["refused_goals"]),
    )


def _rejected(goals: Sequence[dict[str, Any]]) -> str:
    rows = [
        (f"{goal['time_s']:.1f}", escape(goal["kind"].replace("_", " ")), _dot(goal["object"]), escape(goal["reason"]))
        for goal in goals
    ]
    if not rows:
        return ""
    rejected = table(("s", "goal", "object", "why"), rows, numbers=(0,))
    return f"<details><summary>{len(rows)} goals were rejected before the arm moved</summary>{rejected}</details>"


def _contacts(evaluation: RunEvaluation) -> str:
    found = evaluation.summary["contact_list"]
    rows = [
        (f"{item['time_s']:.2f}", str(item["count"]), escape(", ".join(item["in_contact"]) or "over already"))
        for item in found
    ]
    shown = table(("s", "new", "in contact then"), rows, numbers=(0, 1)) if rows else ""
    return section(
        "What the robot touched",
        "It may touch the object that it handles, and nothing else. Deeper than 0.7 mm would be no physical grasp.",
        svg_of(plots.contacts, evaluation, (11, 2.2)) + shown,
    )


def _topics(summary: dict[str, Any]) -> str:
    lost = summary["loss"]["topics"]
    rows = [
        (
            escape(rate["node"] or "–"),
            escape(topic),
            _number(rate["declared_hz"], 0) if rate["declared_hz"] is not None else "<span class=soft>events</span>",
            _number(rate["measured_hz"], 2),
            str(rate["messages"]),
            _number(rate["longest_gap_s"], 2),
            str(lost.get(topic, 0)),
        )
        for topic, rate in sorted(summary["topic_rates"].items(), key=lambda item: (item[1]["node"], item[0]))
    ]
    heads = ("node", "topic", "declared, Hz", "measured, Hz", "messages", "longest gap, s", "lost")
    return section(
        "Messages on the bus",
        "Rates in simulated time. Lost: gaps in the sequence numbers of the recording." + _gaps(summary),
        table(heads, rows, numbers=(2, 3, 4, 5, 6)),
    )


def _gaps(summary: dict[str, Any]) -> str:
    gaps = summary["gaps"]
    found = [f"of the {gap['recording']} from {gap['begin_s']:.2f} to {gap['end_s']:.2f} s" for gap in gaps]
    return f" Nothing was recorded {' and '.join(found)}: its process was started again." if found else ""


def _speech(summary: dict[str, Any]) -> str:
    rows = [(f"{speech['time_s']:.1f}", f"“{escape(speech['sentence'])}”") for speech in summary["speech"]]
    return folded("All speech of the robot", table(("s", ""), rows, numbers=(0,)))


def _origin(summary: dict[str, Any]) -> str:
    wall = summary["wall"]
    rows = [(escape(name), escape(version or "–")) for name, version in sorted(summary["versions"].items())]
    rows += [(escape(name), escape(str(wall[name]))) for name in ("begun", "run_folder", "realtime_factor")]
    return folded("Versions and origin", table(("", ""), rows))


def _dot(name: str) -> str:
    return f"<span class=dot style='background:{plots.COLOURS.get(name, plots.OTHER)}'></span>{escape(name)}"


def _place(place: Sequence[float] | None) -> str:
    return "–" if place is None else f"({place[0] * 100:.1f}, {place[1] * 100:.1f})".replace("-", "−")


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def _yes(value: bool) -> str:
    return "<span class=yes>yes</span>" if value else "<span class=no>no</span>"
