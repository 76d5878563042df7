"""The report on thesis chapter 6: one HTML file that needs no other, and its numbers as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from paramove.documents import Floats, report_page, section
from sim.persons.clips import Clip, clips_code
from studies.chapter4.drawing import drawn
from studies.chapter6 import drawing
from studies.chapter6.experiments import TRACKED_KINDS
from studies.chapter6.findings import Finding, findings_of
from studies.chapter6.goals import Goal, goals_of
from studies.chapter6.measures import LOST_M, LOST_OTHERWISE_M, LOST_S, Track
from studies.chapter6.strips import strip
from studies.chapter6.summary import FAST_KIND, FOUR, SINGLE, SLOW_KINDS, TWO, case_of, chosen, summarised
from studies.chapter6.tables import (
    cameras_table,
    cases_table,
    findings_table,
    goals_table,
    hand_table,
    lost_table,
    models_table,
)
from studies.chapter6.vocabularies import BY_OTHERS

DATA = (
    "Rendered performances of persons who differ from the demonstrator of the models in size, proportions, position, "
    "timing and habits, with clutter, shadows, textured sleeves and noise; recorded persons' movements; cameras and "
    "measures with errors. Everything counts: no performance is left out."
)
LOST = (
    f"Lost: the hand is more than {100 * LOST_OTHERWISE_M:.0f} cm off for {LOST_S:g} s without interruption during a "
    f"performance, {100 * LOST_M[1]:.0f} cm with a single view. A target that was not detected counts as infinitely "
    "far. Targets of pointing far lie on a plane in front of the person, those of recorded persons 2 m away."
)
WHY_DEPTH = (
    "A camera sees the arm's outline. A hand that moves 5 cm across the line of sight moves by many pixels; 5 cm "
    "along it only makes it a little larger or smaller, which is less than the errors of the measured sizes (3 %) and "
    "of the matched contour. What is known of depth comes from the models: which targets and paths are usual. Where "
    "these leave a choice, the path out for the path back, a single view can take the wrong one, and follow it."
)
MODELS = (
    "The target that an action's model infers from all true poses of a performance at once, instead of images: "
    "persons move otherwise than the model has learned, and recorded persons do not point exactly. Larger errors of "
    "the tracker come from the images."
)
ONE_CLIP = (
    "The clip whose hand error with all cameras is the median of its kind. Grey: the hand is at a target; blue: a "
    "performance begins; red: an object is grasped."
)
ACROSS = (1, 0, 0, 1)
"""For each camera one that looks across its line of sight."""
TITLES = {
    "pointing_50fps": "Pointing, 50 fps (6.7.1.1)",
    "pointing": "Pointing with one and several views (6.7.1.2)",
    "pointing_far": "Pointing far (6.7.1.3)",
    "pouring": "Pouring into a teapot (6.7.1.4)",
    "box": "Recognition of actions (6.7.2)",
    "complex": "Complex actions (6.7.3)",
    "recorded": "Recorded persons",
    BY_OTHERS: "Recorded persons, tracked with a model of the two others",
}


def write_results(
    results: Sequence[Mapping[str, Any]], folder: Path, clips: Mapping[str, Clip]
) -> tuple[dict[str, Any], list[Goal]]:
    """Writes `report.html` and `chapter6.json` into the folder. Returns the numbers and the goals.

    Args:
        results: of all pieces of work. clips: by name; tracks of missing ones have no images.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tracks = [Track(result) for result in results]
    held_out = [track for track in tracks if track.split == "held_out"]
    summary = summarised(tracks)
    goals, goals_there = goals_of(tracks), goals_of(held_out)
    findings = findings_of(tracks, summary)
    numbers = plain(summary) | {
        "clips code": clips_code(),
        "held out": plain(summarised(held_out)),
        "goals": [goal._asdict() for goal in goals],
        "goals held out": [goal._asdict() for goal in goals_there],
        "findings": [finding._asdict() for finding in findings],
    }
    text = json.dumps(numbers, indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False) + "\n"
    (folder / "chapter6.json").write_text(text, encoding="utf-8")
    parts = _numbers(summary, goals, goals_there, findings)
    parts += [*_single_views(tracks, summary, clips), *_kinds(tracks, clips)]
    (folder / "report.html").write_text(_page(tracks, goals, parts), encoding="utf-8")
    return numbers, goals


def plain(value: Any) -> Any:
    """As JSON can hold it: NaN and infinity as null."""
    if isinstance(value, dict):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _page(tracks: Sequence[Track], goals: Sequence[Goal], parts: Sequence[str]) -> str:
    judged = [goal for goal in goals if goal.met is not None]
    good = sum(bool(goal.met) for goal in judged)
    acts = sum(len(track.acts) for track in tracks)
    clips = len({track.clip for track in tracks})
    title = "Tracking in action space"
    return report_page(
        title,
        f"{title}: {good} of {len(judged)} goals met",
        f"Chapter 6 of the thesis, repeated: {len(tracks)} tracks of {clips} clips, {acts} tracked performances.",
        parts,
        good=0 < len(judged) == good,
    )


def _numbers(
    summary: Mapping[str, Any], goals: Sequence[Goal], held_out: Sequence[Goal], findings: Sequence[Finding]
) -> list[str]:
    parts = [
        section("Goals", f"{DATA} {LOST}", goals_table(goals, held_out)),
        section(
            "Compared with the thesis", "The thesis reports one to three performances each.", findings_table(findings)
        ),
        section("All cases", LOST, cases_table(summary["cases"])),
        section("Errors of the models", MODELS, models_table(summary["models"])),
        section("Lost performances", "With the matched likelihood, by clip and cameras.", _folded(summary["tracks"])),
    ]
    if summary["table 6.1"] is not None:
        text = (
            "“estimate”: the best hypothesis (6.16); “median”: the same after a median over five frames; “refined”: "
            "the pose drawn to the mean of the hypotheses around (6.18). Axes are ours: the thesis's y stands under x."
        )
        parts.append(section("The hand at 50 fps (table 6.1)", text, hand_table(summary["table 6.1"])))
    return parts


def _folded(tracks: Sequence[Mapping[str, Any]]) -> str:
    return f"<details><summary>all of them</summary>{lost_table(tracks)}</details>"


def _single_views(tracks: Sequence[Track], summary: Mapping[str, Any], clips: Mapping[str, Clip]) -> list[str]:
    single = chosen(tracks, kinds=SLOW_KINDS, case=SINGLE)
    if not single:
        return []
    plot = drawn(partial(drawing.sight, tracks=single), (11.0, 3.4))
    return [
        section("Where single views fail", WHY_DEPTH, plot + cameras_table(summary["cameras"])),
        *_worst(single, clips),
    ]


def _worst(single: Sequence[Track], clips: Mapping[str, Clip]) -> list[str]:
    """The track with the maximum error in depth among those that are not lost, in its own and another camera."""
    tracked = [track for track in single if not any(track.is_lost(act) for act in track.acts) and track.clip in clips]
    if not tracked:
        return []
    worst = max(tracked, key=lambda track: float((track.sight_errors()[0] ** 2).mean()))
    own = worst.views[0]
    why = (
        f"{worst.clip}, tracked by camera {own + 1}: of all tracks with one camera that are not lost, the one with the "
        "maximum error along the line of sight. In its own camera the outline fits; another camera shows the error."
    )
    rows = [(worst, own), (worst, ACROSS[own])]
    return [section("The same error from the side", why, strip(clips[worst.clip], rows, "an arm too near or too far"))]


def _kinds(tracks: Sequence[Track], clips: Mapping[str, Clip]) -> list[str]:
    kinds = [kind for kind in TRACKED_KINDS if any(track.kind == kind for track in tracks)]
    parts = []
    errors = {kind: _errors(chosen(tracks, kinds=[kind]), targets=True) for kind in kinds}
    hands = {kind: _errors(chosen(tracks, kinds=[kind]), targets=False) for kind in kinds}
    size = (max(2.0 * len(kinds), 6.0), 2.8)
    text = "Fraction of detected targets, and of frames, whose error is below a length; undetected ones never are."
    draw = drawing.distributions
    plots = drawn(partial(draw, kinds=errors, title="target, cm", maximum=15.0), size)
    plots += drawn(partial(draw, kinds=hands, title="hand, cm", maximum=15.0), size)
    parts.append(section("All errors", text, plots))
    for kind in kinds:
        own = typical(chosen(tracks, kinds=[kind]))
        why = f"{ONE_CLIP} Here: {own[0].clip}."
        parts.append(section(TITLES[kind], why, _one_clip(kind, own, clips.get(own[0].clip))))
    return parts


def _errors(tracks: Sequence[Track], *, targets: bool) -> dict[str, Floats]:
    """Errors in cm of all tracks of each set of views."""
    errors = {}
    for case in (FOUR, SINGLE, TWO):
        own = [track for track in tracks if case_of(track) == case]
        if own:
            parts = [track.target_errors() if targets else np.linalg.norm(track.hand_errors, axis=1) for track in own]
            errors[case] = 100.0 * np.concatenate([np.asarray(one) for one in parts])
    return errors


def typical(tracks: Sequence[Track]) -> list[Track]:
    """All tracks of the clip whose hand error, with as many views as there are, is the lower median."""
    maximum = max(len(track.views) for track in tracks)
    full = [track for track in tracks if len(track.views) == maximum]
    ordered = sorted(full, key=lambda track: float((track.hand_errors**2).mean()))
    clip = ordered[(len(ordered) - 1) // 2].clip
    return sorted((track for track in tracks if track.clip == clip), key=lambda track: (-len(track.views), track.views))


def _one_clip(kind: str, own: Sequence[Track], clip: Clip | None) -> str:
    images = strip(clip, _rows(own), f"{kind}: images with the estimated arm") if clip is not None else ""
    plots = drawn(partial(drawing.over_time, tracks=own), (11.0, 5.0))
    few = [track for track in own if len(track.views) != 2]
    plots += drawn(partial(drawing.deviations, tracks=few), (11.0, 2.4))
    if kind == FAST_KIND:
        plots += drawn(partial(drawing.hand_and_truth, track=own[0]), (11.0, 4.6))
    if len(own[0].actions) > 1:
        camera_2 = [track for track in own if track.views == (1,)]
        for track in (own[0], *camera_2):
            plots += drawn(partial(drawing.posteriors, track=track), (11.0, 1.6 + 1.1 * len(track.actions)))
    return images + plots


def _rows(own: Sequence[Track]) -> list[tuple[Track, int]]:
    """Which tracks of a clip are shown in which views: all cameras in two, camera 2 alone in its own and another."""
    if len(own[0].views) == 1:
        return [(own[0], own[0].views[0])]
    alone = [track for track in own if len(track.views) == 1]
    second = next((track for track in alone if track.views == (1,)), alone[0] if alone else None)
    rows = [(own[0], 0), (own[0], 1)]
    return rows if second is None else [*rows, (second, second.views[0]), (second, ACROSS[second.views[0]])]
