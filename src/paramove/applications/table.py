"""What the robot has seen of the objects on the table, from gestures alone."""

from __future__ import annotations

from dataclasses import dataclass

from paramove.msgs.gesture_pb2 import Gesture

AT_REST = frozenset({Gesture.KIND_APPEARED, Gesture.KIND_RESTED})


@dataclass(frozen=True)
class Sighting:
    """The latest thing seen of an object.

    Attributes:
        kind: Of `Gesture.Kind`: appeared, moved, rested or vanished.
        time_s: Capture time.
        u_px, v_px: Image point.
        place: x, y in the plane's frame, m; None while there is no calibration.
    """

    kind: int
    time_s: float
    u_px: float
    v_px: float
    place: tuple[float, float] | None

    @property
    def at_rest(self) -> bool:
        """Whether the object is seen standing still."""
        return self.kind in AT_REST


@dataclass(frozen=True)
class Surface:
    """Range of the working surface, m, in the plane's frame: what vanishes elsewhere was carried away."""

    x: tuple[float, float]
    y: tuple[float, float]

    def contains(self, place: tuple[float, float] | None, margin: float = 0.0) -> bool:
        """Whether a place lies on the surface, `margin` inside its border."""
        if place is None:
            return False
        inside_x = self.x[0] + margin <= place[0] <= self.x[1] - margin
        return inside_x and self.y[0] + margin <= place[1] <= self.y[1] - margin


class Table:
    """Keeps the latest sighting of every object, and whether the hand is in view."""

    def __init__(self) -> None:
        self.objects: dict[str, Sighting] = {}
        self.hand_in_view = False
        self.hand_changed_s = 0.0

    def on_gesture(self, gesture: Gesture) -> None:
        """Take in what happened."""
        time_s = gesture.captured.ToNanoseconds() * 1e-9
        if gesture.kind in (Gesture.KIND_HAND_APPEARED, Gesture.KIND_HAND_VANISHED):
            self.hand_in_view = gesture.kind == Gesture.KIND_HAND_APPEARED
            self.hand_changed_s = time_s
        elif gesture.object and gesture.kind != Gesture.KIND_POINTED_AT:
            place = (gesture.x, gesture.y) if gesture.located else None
            self.objects[gesture.object] = Sighting(gesture.kind, time_s, gesture.u_px, gesture.v_px, place)

    def hand_away_for(self, now_s: float) -> float:
        """How long the hand has been out of view, s; 0 while it is in view."""
        return 0.0 if self.hand_in_view else now_s - self.hand_changed_s

    def standing(self, but: str = "", settled_s: float = float("inf")) -> dict[str, tuple[float, float]]:
        """Places of the objects seen at rest, m, without `but`, and without those that came to rest after a time, s."""
        return {
            name: sighting.place
            for name, sighting in self.objects.items()
            if sighting.at_rest and sighting.place is not None and name != but and sighting.time_s <= settled_s
        }
