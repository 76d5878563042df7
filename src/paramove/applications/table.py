"""The latest sighting of every object on the table, from gestures alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

from paramove.msgs.gesture_pb2 import Gesture
from paramove.objects import ObjectShape

AT_REST = frozenset({Gesture.KIND_APPEARED, Gesture.KIND_RESTED})


@dataclass(frozen=True)
class Sighting:
    """The latest event of an object.

    Attributes:
        kind: Of `Gesture.Kind`: appeared, moved, rested or vanished.
        time_s: Capture time.
        u_px, v_px: Image point.
        position: x, y in the plane's frame, m; None while there is no calibration.
        shape: Of the object; None: not known.
    """

    kind: int
    time_s: float
    u_px: float
    v_px: float
    position: tuple[float, float] | None
    shape: ObjectShape | None = None

    @property
    def at_rest(self) -> bool:
        """Whether the object is detected at rest."""
        return self.kind in AT_REST


@dataclass(frozen=True)
class Surface:
    """Range of the working surface, m, in the plane's frame: an object that vanishes outside was carried away."""

    x: tuple[float, float]
    y: tuple[float, float]

    def contains(self, position: tuple[float, float] | None, margin: float = 0.0) -> bool:
        """Whether a position lies on the surface, `margin` inside its border."""
        if position is None:
            return False
        inside_x = self.x[0] + margin <= position[0] <= self.x[1] - margin
        return inside_x and self.y[0] + margin <= position[1] <= self.y[1] - margin


class Table:
    """Stores the latest sighting of every object, of which colours there are two, and whether the hand is in view."""

    def __init__(self) -> None:
        self.objects: dict[str, Sighting] = {}
        self.twins: set[str] = set()
        self.hand_in_view = False
        self.hand_changed_s = 0.0

    def on_gesture(self, gesture: Gesture) -> None:
        """Store an event."""
        (self.twins.add if gesture.twin else self.twins.discard)(gesture.object)
        time_s = gesture.captured.ToNanoseconds() * 1e-9
        if gesture.kind in (Gesture.KIND_HAND_APPEARED, Gesture.KIND_HAND_VANISHED):
            self.hand_in_view = gesture.kind == Gesture.KIND_HAND_APPEARED
            self.hand_changed_s = time_s
            return
        shape = ObjectShape.of(gesture)
        if gesture.kind == Gesture.KIND_POINTED_AT and gesture.object in self.objects:
            self.objects[gesture.object] = replace(self.objects[gesture.object], shape=shape)
        elif gesture.object and gesture.kind != Gesture.KIND_POINTED_AT:
            position = (gesture.x, gesture.y) if gesture.located else None
            self.objects[gesture.object] = Sighting(gesture.kind, time_s, gesture.u_px, gesture.v_px, position, shape)

    def hand_away_for(self, now_s: float) -> float:
        """How long the hand has been out of view, s; 0 while it is in view."""
        return 0.0 if self.hand_in_view else now_s - self.hand_changed_s

    def standing(self, but: str = "", settled_s: float = float("inf")) -> dict[str, tuple[float, float]]:
        """Positions, m, of the objects at rest, without `but` and those that came to rest after `settled_s`."""
        return {
            name: sighting.position
            for name, sighting in self.objects.items()
            if sighting.at_rest and sighting.position is not None and name != but and sighting.time_s <= settled_s
        }
