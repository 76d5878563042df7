"""The report of the imitation experiment: a folder with one HTML file that needs no other, its plots, its numbers."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path
from typing import Any

from paramove.documents import image, report_page
from studies.imitation.experiment import Experiment, numbers_of
from studies.imitation.plots import PLOTS, png_of
from studies.imitation.reasons import LimitUse, limit_uses, why
from studies.imitation.thesis import Compared, compared, verdicts

TEXTS = {
    "gripper": (
        "The gripper (figures 5.15 and 5.16)",
        "Distance between the gripper of the synthesised movement and that of a local model trained for this very "
        "target. Line: median over the demonstrators; band: minimum to maximum. Grey: the significant states; the thin "
        "line is where the target is reached. Outside the grey the resting hands differ.",
    ),
    "elbow": (
        "The elbow (figures 5.17 and 5.18)",
        "q: elbow of the movement, q′: elbow that the robot sets; with a hat: of the reference. Blue is what "
        "interpolation costs, red what of it reaches the robot, black the best that this robot can do, magenta what it "
        "does. Light blue: with the elbow interpolated as a point, as in the thesis.",
    ),
    "limits": (
        "Joint limits",
        "Full lines: the closed form of 5.2.4, which knows no limits, as in the thesis. Dashed: what the arm does, "
        "with the gripper kept outside its minimum reach and the elbow turned where a limit requires it. Below: by how "
        "many degrees the closed form exceeds limits (largest over the demonstrators).",
    ),
    "arms": (
        "The arms at the centre",
        "Shoulder in the origin. Left: where the hand passes nearest to the shoulder; right: at the target. The "
        "distance between the black elbows is the imitation error of the reference: the arms differ in proportions.",
    ),
    "table": (
        "All over the table",
        "Held-out targets on the lower face of the demonstrated cuboid (triangles: demonstrated corners), from the "
        "person's side. Medians over the demonstrators of the largest error in states 20-60 or at the target. What "
        "time warping removes is a difference of progress: the same path, run through earlier or later.",
    ),
}


def write_results(experiment: Experiment, folder: Path) -> dict[str, Any]:
    """Write `report.html`, `imitation.json` and one PNG per plot into the folder; the numbers are also returned."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers = numbers_of(experiment)
    rows = compared(numbers)
    numbers["goals"] = verdicts(rows)
    numbers["why"] = why(experiment)
    names = [name for name, _, _ in PLOTS if name != "table" or experiment.setup.with_grid]
    pictures = {name: png_of(draw, experiment, size) for name, draw, size in PLOTS if name in names}
    for name, picture in pictures.items():
        (folder / f"{name}.png").write_bytes(picture)
    text = json.dumps(numbers, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    (folder / "imitation.json").write_text(text, encoding="utf-8")
    page = _page(experiment, numbers, rows, pictures)
    (folder / "report.html").write_text(page, encoding="utf-8")
    return numbers


def _page(experiment: Experiment, numbers: dict[str, Any], rows: list[Compared], pictures: dict[str, bytes]) -> str:
    missed = [one for one in rows if one.met is False]
    goals = sum(one.met is not None for one in rows)
    title = f"{goals - len(missed)} of {goals} goals met"
    parts = [
        _comparison(rows),
        _why(numbers["why"]),
        _limits(limit_uses(experiment)),
        *(_picture(name, picture) for name, picture in pictures.items()),
        _alignment(numbers),
    ]
    about = (
        f"Thesis 5.2.7 with {len(numbers['seeds'])} synthetic demonstrators; each reference averages "
        f"{numbers['repetitions']} demonstrations of its target."
    )
    headline = f"Imitation of reaching: {title}"
    return report_page("Imitation of reaching", headline, about, parts, good=not missed, style="img{width:100%}")


def _comparison(rows: list[Compared]) -> str:
    lines = []
    for one in rows:
        mark = {True: "<span class=yes>met</span>", False: "<span class=no>not met</span>", None: ""}[one.met]
        goal = "" if one.row.goal is None else f"≤ {one.row.goal:g}"
        indent = " style='padding-left:18px'" if one.row.text.startswith(" ") else ""
        lines.append(
            f"<tr><td{indent}>{escape(one.row.text.strip())}</td><td>{escape(one.row.target.name)}</td>"
            f"<td class=n>{escape(one.row.thesis or '')}</td><td class=n>{_mm(one.median)}</td>"
            f"<td class=n>{_mm(one.largest)}</td><td class=n>{goal}</td><td>{mark}</td></tr>"
        )
    return (
        "<section><h2>Compared with the thesis</h2><p class=why>Largest error in states 20-60, mm, in the "
        "scale of the robot; median and largest over the demonstrators. Goals are held against the median.</p>"
        "<table><tr><th>error</th><th>target</th><th class=n>thesis</th><th class=n>median</th><th class=n>largest</th>"
        f"<th class=n>goal</th><th></th></tr>{''.join(lines)}</table></section>"
    )


def _why(messages: list[str]) -> str:
    if not messages:
        return ""
    items = "".join(f"<li>{escape(message)}</li>" for message in messages)
    return f"<section><h2>What is missed, where, and why</h2><ul>{items}</ul></section>"


def _limits(uses: list[LimitUse]) -> str:
    lines = "".join(
        f"<tr><td>{escape(use.target.name)}</td><td>{escape(use.joint)}</td><td>{escape(use.states)}</td>"
        f"<td class=n>{use.outside_deg:.1f}</td><td class=n>{use.elbow_turn_deg:.1f}</td>"
        f"<td class=n>{use.gripper_moved_mm:.1f}</td></tr>"
        for use in uses
    )
    return (
        "<section><h2>States that a joint limit changes</h2><p class=why>Of the synthesised movement, largest over the "
        "demonstrators. Limits are 1.3° inside those of the hardware.</p><table><tr><th>target</th><th>joint</th>"
        "<th>states</th><th class=n>beyond its limit, °</th><th class=n>elbow turned, °</th>"
        f"<th class=n>gripper moved, mm</th></tr>{lines}</table></section>"
    )


def _picture(name: str, picture: bytes) -> str:
    heading, text = TEXTS[name]
    picture_html = image(picture, heading)
    return f"<section><h2>{escape(heading)}</h2><p class=why>{escape(text)}</p>{picture_html}</section>"


def _alignment(numbers: dict[str, Any]) -> str:
    lines = "".join(
        f"<tr><td>{escape(one['place'])}</td><td class=n>{_mm(one['mm']['gripper']['median'])}</td>"
        f"<td class=n>{_mm(one['mm']['gripper_aligned']['median'])}</td>"
        f"<td class=n>{_mm(one['mm']['effective']['median'])}</td>"
        f"<td class=n>{_mm(one['mm']['effective_aligned']['median'])}</td></tr>"
        for one in numbers["places"]
        if one["reference"] == "global"
    )
    return (
        "<section><h2>References aligned by the global model</h2><p class=why>Above, a reference is an HMM of its own "
        "with the same time restrictions, as the thesis makes references in 4.2.4. Here its states are aligned by the "
        "global model of the training (3.4.1), as those of the corners are. At the centre such a reference runs ahead "
        "of the synthesised movement on the way out and behind on the way back. Time warping removes most of that. It "
        "minimises the summed distance of the whole movement, resting hands included; the largest one in states "
        "20-60 can grow.</p><table><tr><th>target</th><th class=n>gripper</th>"
        "<th class=n>after warping</th><th class=n>effective elbow</th><th class=n>after warping</th></tr>"
        f"{lines}</table></section>"
    )


def _mm(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"
