"""Turns the estimates of tracking in action space into gestures: one for each target that is pointed at."""

from __future__ import annotations

from dataclasses import dataclass

from paramove.action_space import certainty
from paramove.msgs.action_estimate_pb2 import ActionEstimate
from paramove.msgs.gesture_pb2 import Gesture

FARTHEST_M = 100.0
"""Positions farther away than this are not valid targets."""


@dataclass(frozen=True)
class PointingEventOptions:
    """When a target becomes a gesture.

    Attributes:
        actions: names of the actions that count as pointing.
        settled_s: time after the hand has come to rest; the target grows more certain meanwhile.
        min_certainty: of the target, 0 to 1; less certain targets are no gestures.
        latest_s: time after the hand has come to rest; a target that becomes certain later is no gesture.
    """

    actions: tuple[str, ...] = ("pointing",)
    settled_s: float = 0.2
    min_certainty: float = 0.3
    latest_s: float = 3.0


class PointingEvents:
    """Reports each target once, after the hand has rested at it."""

    def __init__(self, options: PointingEventOptions | None = None) -> None:
        self._options = options or PointingEventOptions()
        self._last_reported = 0

    def update(self, estimate: ActionEstimate) -> Gesture | None:
        """The gesture that this estimate completes, if any. A lost or undetected arm makes none."""
        target, options = estimate.target, self._options
        if not estimate.HasField("target") or estimate.lost or estimate.degraded:
            return None
        if target.number < self._last_reported:  # the tracker was restarted
            self._last_reported = 0
        rested_s = (estimate.captured.ToNanoseconds() - target.arrived.ToNanoseconds()) * 1e-9
        if target.number == self._last_reported or target.action not in options.actions:
            return None
        if not options.settled_s <= rested_s <= options.latest_s:
            return None
        position = target.location
        if not (abs(position.x) < FARTHEST_M and abs(position.y) < FARTHEST_M):  # NaN is not below either
            return None
        confidence = certainty((position.x_deviation, position.y_deviation, position.z_deviation))
        if not confidence >= options.min_certainty:
            return None
        self._last_reported = target.number
        gesture = Gesture(
            kind=Gesture.KIND_POINTED_AT,
            located=True,
            frame=estimate.frame,
            x=position.x,
            y=position.y,
            confidence=confidence,
        )
        gesture.captured.CopyFrom(estimate.captured)
        return gesture
