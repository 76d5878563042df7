"""The goals for tracking in action space, and whether they are met."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from studies.chapter6.measures import Track
from studies.chapter6.summary import (
    FAST_KIND,
    FOUR,
    SINGLE,
    SLOW_KINDS,
    TABLE_KINDS,
    accuracy,
    chosen,
    dual,
    recognition,
)
from studies.chapter6.vocabularies import BY_OTHERS

MIN_EXECUTIONS = 100
"""A fraction of 2 % can be judged from as many executions on."""
FAR = "pointing_far"
RECORDED = "recorded"


class Goal(NamedTuple):
    """A goal: what, how much, what was measured, of what, and whether it is met; None if it could not be judged."""

    what: str
    wanted: str
    measured: str
    of: str
    met: bool | None


def goals_of(tracks: Sequence[Track]) -> list[Goal]:
    """All goals, judged over all given tracks together, but for those with the model of other persons."""
    tracks = [track for track in tracks if track.kind != BY_OTHERS]
    four, single = chosen(tracks, case=FOUR), chosen(tracks, case=SINGLE)
    slow = [track for track in single if track.kind in SLOW_KINDS]
    fast = [track for track in single if track.kind == FAST_KIND]
    return [
        _hand("four views: hand RMS, worst axis", four, 1.8),
        *_targets("four views", four, 2.5, 5.0),
        _hand("one view, 8 fps: hand RMS, worst axis", slow, 3.0),
        *_targets("one view, 8 fps", slow, 4.0, 8.0),
        _hand("one view, 50 fps: hand RMS, worst axis", fast, 3.0),
        *_two_quantiles("one view, 50 fps: target on the table", fast, 4.0, 8.0),
        _lost("lost, four views", four),
        _lost("lost, one view", single),
        _recognised("carrying actions A and B distinguished at the grasp, four views", four),
        _recognised("carrying actions A and B distinguished at the grasp, one view", single),
        *_complex(four),
        _simple(tracks),
    ]


def _hand(what: str, tracks: Sequence[Track], limit: float) -> Goal:
    if not tracks:
        return _unjudged(what, f"≤ {limit:g} cm")
    worst = max(accuracy(tracks)["hand_rms"])
    return Goal(what, f"≤ {limit:g} cm", f"{worst:.2f} cm", _number(tracks), worst <= limit)


def _targets(what: str, tracks: Sequence[Track], median: float, p90: float) -> list[Goal]:
    """Median and 90 % quantile: of targets on the table, of far ones, and of those of recorded persons."""
    parts = (("target on the table", TABLE_KINDS), ("far target", (FAR,)), ("recorded persons' target", (RECORDED,)))
    return [
        goal
        for name, kinds in parts
        for goal in _two_quantiles(f"{what}: {name}", [one for one in tracks if one.kind in kinds], median, p90)
    ]


def _two_quantiles(what: str, tracks: Sequence[Track], median: float, p90: float) -> list[Goal]:
    measured = accuracy(tracks) if tracks else None
    goals = []
    for name, key, limit in (("median", "target_median", median), ("90 %", "target_p90", p90)):
        if measured is None:
            goals.append(_unjudged(f"{what}, {name}", f"≤ {limit:g} cm"))
            continue
        of = f"{counted(measured['targets'], 'target')}, {measured['undetected']} not detected"
        value = measured[key]
        goals.append(Goal(f"{what}, {name}", f"≤ {limit:g} cm", length(value), of, value <= limit))
    return goals


def length(value: float) -> str:
    """A length in cm, or that there is none."""
    return f"{value:.2f} cm" if value < float("inf") else "not detected"


def counted(number: int, what: str) -> str:
    """A number of things, as text."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def _lost(what: str, tracks: Sequence[Track]) -> Goal:
    measured = accuracy(tracks) if tracks else {"performances": 0}
    if measured["performances"] < MIN_EXECUTIONS:
        return _unjudged(
            what, "≤ 2 %", f"only {counted(measured['performances'], 'performance')}, {MIN_EXECUTIONS} expected"
        )
    fraction = measured["lost"] / measured["performances"]
    return Goal(
        what, "≤ 2 %", f"{100 * fraction:.1f} %", counted(measured["performances"], "performance"), fraction <= 0.02
    )


def _recognised(what: str, tracks: Sequence[Track]) -> Goal:
    return _fraction(what, recognition([track for track in tracks if track.kind == "box"]))


def _complex(four: Sequence[Track]) -> list[Goal]:
    measured = dual([track for track in four if track.kind == "complex"])
    what = "targets of dual pointing, four views"
    goals = [_fraction("simple and dual pointing distinguished, four views", measured)]
    for name in ("first", "second"):
        if measured is None or not measured["dual"]:
            goals.append(_unjudged(f"{what}, {name}, median", "≤ 5 cm"))
            continue
        value = measured[f"{name}_median"]
        goals.append(
            Goal(
                f"{what}, {name}, median",
                "≤ 5 cm",
                length(value),
                counted(measured["dual"], "performance"),
                value <= 5.0,
            )
        )
    return goals


def _fraction(what: str, measured: dict[str, Any] | None) -> Goal:
    if measured is None:
        return _unjudged(what, "≥ 95 %")
    return Goal(
        what,
        "≥ 95 %",
        f"{100 * measured['share']:.1f} %",
        f"{measured['right']} of {measured['of']}",
        measured["share"] >= 0.95,
    )


def _simple(tracks: Sequence[Track]) -> Goal:
    what = "the clips are hard: the simple likelihood loses"
    own = chosen(tracks, likelihood="simple")
    if not own:
        return _unjudged(what, "≥ 10 %")
    measured = accuracy(own)
    fraction = measured["lost"] / measured["performances"]
    return Goal(
        what, "≥ 10 %", f"{100 * fraction:.1f} %", counted(measured["performances"], "performance"), fraction >= 0.10
    )


def _unjudged(what: str, required: str, of: str = "no such track") -> Goal:
    return Goal(what, required, "–", of, None)


def _number(tracks: Sequence[Track]) -> str:
    kinds = len({track.kind for track in tracks})
    acts = sum(len(track.acts) for track in tracks)
    return f"{counted(acts, 'performance')} of {counted(kinds, 'kind')}"
