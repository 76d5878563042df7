"""True and estimated targets of pointing, in a run with tracking in action space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import groupby
from typing import Any

from paramove.bus import topics
from paramove.msgs.gesture_pb2 import Gesture
from paramove.runs.recorded_run import RecordedRun, Truth
from paramove.runs.relocations import Relocation, stages_of
from paramove.runs.rule_learning.accuracy import Place, apart_mm, summary_statistics

POINTS_AT = "points at "
"""The instructor's action in the recorded truth, followed by the object's name."""


@dataclass(frozen=True)
class PointedPlace:
    """One pointing, or a gesture while the arm did something else: where it puts an object down, it rests too.

    Attributes:
        time_s: When the estimate was published; when the person began, if none was.
        meant: Object that the person pointed at; "" if nobody pointed.
        true: Its middle (x, y), m, right shoulder's frame; None if nobody pointed.
        believed: The estimated target; None if none was published.
        nearest: Object on the surface that is truly nearest to the estimated target; "" if there is none.
        spacing_mm: Distance from the object that is meant to the next one on the surface; None if it stands alone.
        confidence: Of the estimate, 0 to 1; None if none was published.
    """

    time_s: float
    meant: str
    true: Place | None
    believed: Place | None
    nearest: str
    spacing_mm: float | None
    confidence: float | None

    @property
    def error_mm(self) -> float | None:
        """Horizontal distance of the estimated target from the middle of the object."""
        if self.true is None or self.believed is None:
            return None
        return apart_mm(self.true, self.believed)

    @property
    def error_of_spacing(self) -> float | None:
        """The error as a fraction of the spacing; from 0.5 on, another object can be nearer."""
        if self.error_mm is None or not self.spacing_mm:
            return None
        return self.error_mm / self.spacing_mm

    @property
    def right(self) -> bool:
        """Whether the object that is meant is the nearest."""
        return bool(self.meant) and self.nearest == self.meant


def pointed_places(run: RecordedRun) -> list[PointedPlace]:
    """Every pointing in order, with its last estimate; then the other estimates in the stage apply.

    Without tracking in action space there is nothing.
    """
    if not run.received(topics.ACTION_ESTIMATE):
        return []
    gestures = [
        recorded.message
        for recorded in run.received(topics.GESTURES)
        if recorded.message.kind == Gesture.KIND_POINTED_AT and recorded.message.located and not recorded.message.object
    ]
    found = []
    for begin_s, end_s, name in _performances(run.truth):
        within = [gesture for gesture in gestures if begin_s <= run.captured_s(gesture) <= end_s]
        found.append(_place(run, name, begin_s, within[-1] if within else None))
        gestures = [gesture for gesture in gestures if gesture not in within[-1:]]
    applied = [gesture for gesture in gestures if _in_apply(run, run.captured_s(gesture))]
    return found + [_place(run, "", 0.0, gesture) for gesture in applied]


def unrequested_fetches(run: RecordedRun, relocations: Sequence[Relocation]) -> list[Relocation]:
    """Fetches in the stage apply of an object that was not what the person had pointed at last."""
    performances = _performances(run.truth)
    found = []
    for goal in relocations:
        if goal.fetches and goal.stage == "apply" and goal.goal.attempt <= 1:
            last = [name for begin_s, _, name in performances if begin_s < goal.begun_s]
            if not last or last[-1] != goal.goal.object:
                found.append(goal)
    return found


def pointing_summary(places: list[PointedPlace], unrequested: Sequence[Relocation]) -> dict[str, Any]:
    """Counts, errors and each pointing, ready for JSON."""
    pointings = [place for place in places if place.meant]
    return {
        "pointings": len(pointings),
        "pointings_told": sum(place.believed is not None for place in pointings),
        "pointings_right": sum(place.right for place in pointings),
        "pointings_by_nobody": len(places) - len(pointings),
        "unasked_fetches": [{"time_s": goal.begun_s, "object": goal.goal.object} for goal in unrequested],
        "pointing_error_mm": summary_statistics(place.error_mm for place in pointings if place.error_mm is not None),
        "pointing_error_of_spacing": summary_statistics(
            place.error_of_spacing for place in pointings if place.error_of_spacing is not None
        ),
        "pointing_list": [
            asdict(place)
            | {"right": place.right, "error_mm": place.error_mm, "error_of_spacing": place.error_of_spacing}
            for place in places
        ],
    }


def _performances(truth: Truth) -> list[tuple[float, float, str]]:
    """When the person began and ended to point, and at what."""
    found = []
    numbered = enumerate(truth.instructor)
    for doing, states in groupby(numbered, key=lambda item: item[1]):
        numbers = [number for number, _ in states]
        if doing.startswith(POINTS_AT):
            begin_s, end_s = float(truth.time_s[numbers[0]]), float(truth.time_s[numbers[-1]])
            found.append((begin_s, end_s, doing.removeprefix(POINTS_AT)))
    return found


def _place(run: RecordedRun, meant: str, begin_s: float, gesture: Any | None) -> PointedPlace:
    time_s = begin_s if gesture is None else run.captured_s(gesture)
    standing = _standing(run.truth, time_s)
    true = standing.get(meant)
    believed = None if gesture is None else (float(gesture.x), float(gesture.y))
    from_estimate = {} if believed is None else {name: apart_mm(place, believed) for name, place in standing.items()}
    nearest = min(from_estimate, key=from_estimate.__getitem__, default="")
    others = [] if true is None else [apart_mm(true, place) for name, place in standing.items() if name != meant]
    confidence = None if gesture is None else float(gesture.confidence)
    return PointedPlace(time_s, meant, true, believed, nearest, min(others, default=None), confidence)


def _standing(truth: Truth, time_s: float) -> dict[str, Place]:
    """The objects whose middle is above the working plane, with their positions."""
    state = truth.at(time_s)
    found = {}
    for name, centres in truth.objects.items():
        x, y, z = centres[state]
        if z > truth.surface_z:
            found[name] = (float(x), float(y))
    return found


def _in_apply(run: RecordedRun, time_s: float) -> bool:
    return any(one["stage"] == "apply" and one["begin_s"] <= time_s <= one["end_s"] for one in stages_of(run))
