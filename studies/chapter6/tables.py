"""The tables of the report on chapter 6, as HTML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from paramove.documents import table
from studies.chapter6.findings import TABLE_6_1, Finding
from studies.chapter6.goals import Goal
from studies.chapter6.vocabularies import BY_OTHERS

MARKS = {
    "yes": "<span class=yes>yes</span>",
    "in part": "<span class=soft>in part</span>",
    "no": "<span class=no>no</span>",
    "–": "<span class=soft>–</span>",
}


def met(goal: Goal) -> str:
    """Whether a goal is met, in a word."""
    return "–" if goal.met is None else "yes" if goal.met else "no"


def goals_table(goals: Sequence[Goal], held_out: Sequence[Goal]) -> str:
    """Goals: required, measured over all clips, and over those that were never used for tuning."""
    apart = {goal.what: goal for goal in held_out}
    rows = []
    for goal in goals:
        other = apart.get(goal.what)
        cells = [escape(cell) for cell in goal[:4]]
        of_third = ["–", MARKS["–"]] if other is None else [escape(other.measured), MARKS[met(other)]]
        rows.append((*cells, MARKS[met(goal)], *of_third))
    return table(("goal", "required", "measured", "of", "met", "held-out third", "met there"), rows)


def findings_table(findings: Sequence[Finding]) -> str:
    """What the thesis observed, and what is observed here."""
    rows = [(*map(escape, finding[:3]), MARKS[finding.verdict]) for finding in findings]
    return table(("where", "the thesis", "here", "the same"), rows)


def hand_table(errors: Mapping[str, Sequence[float]]) -> str:
    """Table 6.1 and ours."""
    rows = [
        (escape(name), *(f"{value:.2f}" for value in values), *_thesis(TABLE_6_1.get(name)))
        for name, values in errors.items()
    ]
    heads = ("50 fps, one view", "x, cm", "y, cm", "z, cm", "thesis x", "thesis y", "thesis z")
    return table(heads, rows, numbers=range(1, 7))


def _thesis(values: Sequence[float] | None) -> tuple[str, str, str]:
    return ("–", "–", "–") if values is None else (f"{values[0]:.2f}", f"{values[1]:.2f}", f"{values[2]:.2f}")


def cases_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Errors of the hand and of targets, for each kind of clip, views and likelihood."""
    cells = [
        (
            escape(row["kind"]),
            escape(row["views"]),
            escape(row["likelihood"]),
            str(row["performances"]),
            *(f"{value:.2f}" for value in row["hand_rms"]),
            number(row["hand_p90"]),
            number(row["pose_rms"]),
            number(row["target_median"]),
            number(row["target_p90"]),
            number(row["target_median_deg"]),
            f"{row['undetected']} of {row['targets']}",
            str(row["lost"]),
            f"{row['said_lost']} ({row['lost_and_said']})",
            f"{row['effective_median']:.0f}",
            f"{row['ms']:.0f}",
        )
        for row in rows
    ]
    heads = (
        *("clips", "views", "likelihood", "performances", "hand RMS x, cm", "y", "z", "hand, 90 %", "pose RMS"),
        *(
            "target, median",
            "target, 90 %",
            "median, ° from the shoulder",
            "not detected",
            "lost",
            "reported as lost (and was)",
        ),
        *("effective particles", "ms a frame, one core"),
    )
    return table(heads, cells, numbers=range(3, 17))


def cameras_table(cameras: Mapping[str, Any]) -> str:
    """Where the errors of single views lie."""
    rows = [
        (
            escape(name),
            f"{one['depth_rms']:.1f}",
            f"{one['across_rms']:.1f}",
            f"{100 * one['depth_share']:.0f} %",
            f"{one['depth_rms_of_kept']:.1f}",
            f"{one['across_rms_of_kept']:.1f}",
            f"{100 * one['depth_share_of_kept']:.0f} %",
            number(one.get("depth_rms at the target", float("nan"))),
            number(one.get("depth_rms elsewhere", float("nan"))),
            *(f"{value:.1f}" for value in one["hand_rms"]),
            f"{one['distance_m']:.2f}",
            f"{one['px_per_5cm_across']:.1f}",
            f"{100 * one['share_larger_per_5cm_depth']:.1f} %",
            f"{one['lost']} of {one['performances']}",
        )
        for name, one in cameras.items()
    ]
    heads = (
        *("alone", "depth, RMS cm", "across", "fraction of depth", "depth, frames within 25 cm", "across, same frames"),
        *(
            "fraction of depth, same frames",
            "depth at the target",
            "depth elsewhere",
            "x",
            "y",
            "z",
            "distance, m",
            "5 cm across, px",
        ),
        *("5 cm nearer: larger by", "lost"),
    )
    return table(heads, rows, numbers=range(1, 16))


def models_table(models: Mapping[str, Any]) -> str:
    """What the models infer from true poses."""
    rows = [(escape(kind), str(one["of"]), number(one["median"]), number(one["p90"])) for kind, one in models.items()]
    return table(("clips", "performances", "target, median cm", "90 %"), rows, numbers=(1, 2, 3))


def lost_table(tracks: Sequence[Mapping[str, Any]]) -> str:
    """All performances that were lost with the matched likelihood."""
    rows = [
        (
            escape(track["clip"] + (", model of others" if track["kind"] == BY_OTHERS else "")),
            ", ".join(map(str, track["views"])),
            str(act + 1),
            f"{track['off_s'][act]:.1f}",
            "yes" if track["said_lost"][act] else "no",
            ", ".join(number(error) for error in track["targets"]),
            "yes" if track["held_out"] else "no",
        )
        for track in tracks
        for act, lost in enumerate(track["lost"])
        if lost and track["likelihood"] == "matched"
    ]
    heads = ("clip", "cameras", "performance", "off for, s", "reported", "targets of the clip, cm", "held out")
    return table(heads, rows, numbers=(2, 3)) if rows else "<p>None.</p>"


def number(value: float) -> str:
    """A length, a dash if unknown, ∞ if infinite."""
    return "–" if value != value else "∞" if value == float("inf") else f"{value:.2f}"
