"""What the thesis observed in chapter 6, what is observed here, and whether they agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from studies.chapter6.goals import length
from studies.chapter6.measures import Track
from studies.chapter6.summary import (
    FOUR,
    SINGLE,
    accuracy,
    at_targets,
    chosen,
    dual,
    quantile,
    recognition,
)

Verdict = Literal["yes", "in part", "no"]

TABLE_6_1 = {
    "median: mean": (0.91, 0.47, 0.82),
    "median: RMS": (1.79, 0.89, 1.59),
    "median: max": (9.48, 4.67, 6.35),
    "estimate: mean": (3.98, 2.89, 3.64),
    "estimate: RMS": (5.45, 3.44, 4.76),
    "estimate: max": (20.11, 6.82, 9.12),
}
"""Along this project's x, y, z, which are the thesis's y, x, z; cm. Three performances, one view, 50 fps."""
DEPTH_AXES = {"camera 1": 1, "camera 2": 0, "camera 3": 0, "camera 4": 1}
"""Along which axis each camera looks, more or less; this project's x forward, y left."""


class Finding(NamedTuple):
    """Where, what the thesis reports, what is observed here, and whether they agree."""

    where: str
    thesis: str
    seen: str
    verdict: Verdict


def findings_of(tracks: Sequence[Track], summary: Mapping[str, Any]) -> list[Finding]:
    """All findings for which there are tracks."""
    pointing, four = chosen(tracks, kinds=["pointing"], case=SINGLE), chosen(tracks, kinds=["pointing"], case=FOUR)
    findings = [
        _table_6_1(summary["table 6.1"]),
        _depth(summary["cameras"]),
        _detection(pointing, four),
        _pose_at_target(pointing),
        _deviations(four),
        _one_camera(
            "far pointing, 6.7.1.3", tracks, "pointing_far", (1, 2), "cameras 2 and 3: accurate near the plane"
        ),
        _one_camera("pouring, 6.7.1.4", tracks, "pouring", (0,), "camera 1: the place of the glass is accurate"),
        _recognition(tracks),
        _complex(tracks),
    ]
    return [one for one in findings if one is not None]


def _table_6_1(errors: Mapping[str, Any] | None) -> Finding | None:
    if errors is None:
        return None
    rms, maximum = errors["median: RMS"], errors["median: max"]
    theirs = TABLE_6_1["median: RMS"], TABLE_6_1["median: max"]
    thesis = f"median filtered, RMS {_axes(theirs[0])} cm, greatest {max(theirs[1]):.1f} cm, over 3 performances"
    observed = f"RMS {_axes(rms)} cm, greatest {max(maximum):.1f} cm, over all performances and cameras"
    return Finding("table 6.1", thesis, observed, _verdict(max(rms) <= 1.8, max(rms) <= 3.0))


def _depth(cameras: Mapping[str, Any]) -> Finding | None:
    if not cameras:
        return None
    right = [int(np.argmax(one["deviations"][:2])) == DEPTH_AXES[name] for name, one in cameras.items()]
    fractions = ", ".join(f"{name}: {100 * one['depth_share_of_kept']:.0f} %" for name, one in cameras.items())
    thesis = (
        "one camera: hypotheses of the hand scatter most along its line of sight, x for cameras 2 and 3, y for 1 and 4"
    )
    observed = (
        f"so for {sum(right)} of {len(right)} cameras; of the squared error of arms that are not lost, along the line "
        f"of sight lie: {fractions}"
    )
    maximum = all(one["depth_share_of_kept"] > 1.0 / 3.0 for one in cameras.values())
    return Finding("figure 6.16", thesis, observed, _verdict(all(right) and maximum, any(right) or maximum))


def _detection(single: Sequence[Track], four: Sequence[Track]) -> Finding | None:
    if not single or not four:
        return None
    one, all_views = accuracy(single), accuracy(four)
    thesis = "detected targets: less than 5 cm off with each camera and with all (2 performances)"
    observed = (
        f"one camera: median {length(one['target_median'])}, 90 % {length(one['target_p90'])}; "
        f"all: {length(all_views['target_median'])}, {length(all_views['target_p90'])}"
    )
    both = one["target_p90"] <= 5.0 and all_views["target_p90"] <= 5.0
    return Finding("detection, 6.7.1.2", thesis, observed, _verdict(both, all_views["target_p90"] <= 5.0))


def _pose_at_target(single: Sequence[Track]) -> Finding | None:
    if not single:
        return None
    errors = [100.0 * track.pose_errors for track in single]
    still = np.concatenate([one[at_targets(track)] for one, track in zip(errors, single, strict=True)])
    moving = np.concatenate([one[~at_targets(track)] for one, track in zip(errors, single, strict=True)])
    thesis = "one camera, 8 fps: pose error up to 18 cm in motion; at the target always below 6 cm, usually 2 cm"
    observed = (
        f"in motion 90 % below {quantile(moving, 0.9):.1f} cm; at the target median {quantile(still, 0.5):.1f} cm, "
        f"90 % below {quantile(still, 0.9):.1f} cm"
    )
    usual = quantile(still, 0.5) <= 3.0
    return Finding("figures 6.15, 6.19", thesis, observed, _verdict(usual and quantile(still, 0.9) <= 6.0, usual))


def _deviations(four: Sequence[Track]) -> Finding | None:
    if not four:
        return None
    still = np.concatenate([track.theta_deviation[at_targets(track)] for track in four])
    rest = np.concatenate([track.theta_deviation[track.times_s < track.acts[0].start_s] for track in four])
    thesis = "the deviation of θ is large in the base pose and smallest when the hand is at the target"
    observed = f"median {np.median(rest):.2f} in the base pose, {np.median(still):.2f} at the target"
    return Finding("figure 6.17", thesis, observed, "yes" if np.median(still) < 0.5 * np.median(rest) else "no")


def _one_camera(
    where: str, tracks: Sequence[Track], kind: str, cameras: tuple[int, ...], thesis: str
) -> Finding | None:
    own = [track for track in chosen(tracks, kinds=[kind], case=SINGLE) if track.views[0] in cameras]
    if not own:
        return None
    measured = accuracy(own)
    observed = (
        f"target: median {length(measured['target_median'])}, 90 % {length(measured['target_p90'])}; "
        f"lost {measured['lost']} of {measured['performances']}"
    )
    near = 5.0 if kind != "pointing_far" else 10.0
    return Finding(where, thesis, observed, _verdict(measured["target_p90"] <= near, measured["target_median"] <= near))


def _recognition(tracks: Sequence[Track]) -> Finding | None:
    own = [track for track in chosen(tracks, kinds=["box"], case=SINGLE) if track.views == (1,)]
    measured = recognition(own)
    if measured is None:
        return None
    thesis = "camera 2: three of three performances are recognised when the object is grasped"
    observed = f"camera 2: {measured['right']} of {measured['of']}"
    return Finding("figure 6.24", thesis, observed, _verdict(measured["share"] >= 0.95, measured["share"] >= 0.75))


def _complex(tracks: Sequence[Track]) -> Finding | None:
    own = [track for track in chosen(tracks, kinds=["complex"], case=SINGLE) if track.views == (1,)]
    measured = dual(own)
    if measured is None:
        return None
    thesis = "camera 2: a simple and a dual pointing are distinguished by a high p(B, τ > ½)"
    observed = (
        f"camera 2: {measured['right']} of {measured['of']} by the target that is reported, "
        f"{100 * measured['share by the posterior']:.0f} % by the posterior alone"
    )
    return Finding("figure 6.27", thesis, observed, _verdict(measured["share"] >= 0.95, measured["share"] >= 0.75))


def _verdict(yes: bool, part: bool) -> Verdict:
    return "yes" if yes else "in part" if part else "no"


def _axes(values: Sequence[float]) -> str:
    return " / ".join(f"{value:.2f}" for value in values)
