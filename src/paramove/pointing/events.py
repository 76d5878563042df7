"""From what tracking in action space believes to gestures: pointed at a place, once for each target."""

from __future__ import annotations

from dataclasses import dataclass

from paramove.action_space import certainty
from paramove.msgs.action_estimate_pb2 import ActionEstimate
from paramove.msgs.gesture_pb2 import Gesture

FARTHEST_M = 100.0
"""Nobody points at a place farther away than this; such a number is none."""


@dataclass(frozen=True)
class PointingEventOptions:
    """When a target becomes a gesture.

    Attributes:
        actions: that point.
        settled_s: after the hand has come to rest; the target grows more certain meanwhile.
        min_certainty: of the target, 0 to 1; a less certain one is no gesture.
        latest_s: after the hand has come to rest; what grows certain later, or is seen again, is no gesture any more.
    """

    actions: tuple[str, ...] = ("pointing",)
    settled_s: float = 0.2
    min_certainty: float = 0.3
    latest_s: float = 3.0


class PointingEvents:
    """Says each target once, when the hand has rested at it."""

    def __init__(self, options: PointingEventOptions | None = None) -> None:
        self._options = options or PointingEventOptions()
        self._said = 0

    def update(self, estimate: ActionEstimate) -> Gesture | None:
        """The gesture of this moment, if there is one. A lost arm and one that nobody sees point at nothing."""
        target, options = estimate.target, self._options
        if not estimate.HasField("target") or estimate.lost or estimate.degraded:
            return None
        if target.number < self._said:  # the tracker was started again
            self._said = 0
        rested_s = (estimate.captured.ToNanoseconds() - target.arrived.ToNanoseconds()) * 1e-9
        if target.number == self._said or target.action not in options.actions:
            return None
        if not options.settled_s <= rested_s <= options.latest_s:
            return None
        place = target.location
        if not (abs(place.x) < FARTHEST_M and abs(place.y) < FARTHEST_M):  # NaN is not below either
            return None
        sure = certainty((place.x_deviation, place.y_deviation, place.z_deviation))
        if not sure >= options.min_certainty:
            return None
        self._said = target.number
        gesture = Gesture(
            kind=Gesture.KIND_POINTED_AT, located=True, frame=estimate.frame, x=place.x, y=place.y, confidence=sure
        )
        gesture.captured.CopyFrom(estimate.captured)
        return gesture
