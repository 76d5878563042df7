"""Drawn tracks: what the colour tracker would say of objects and a hand at given places."""

from __future__ import annotations

from collections.abc import Iterable

from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.tracked_objects_pb2 import OutlinePoint, TrackedObject, TrackedObjects
from paramove.objects.recognizer import Recognizer

PERIOD_NS = 66_666_667
WIDTH, HEIGHT = 14.0, 32.0


def standing(name: str, u: float, v: float, cut_above: float = 0.0, cut_below: float = 0.0) -> TrackedObject:
    """A cylinder with its middle at (u, v), of which something hides the given px from above or below."""
    seen = HEIGHT - cut_above - cut_below
    top = v - HEIGHT / 2 + cut_above
    return TrackedObject(
        name=name,
        kind=TrackedObject.KIND_OBJECT,
        u_px=u,
        v_px=top + seen / 2,
        area_px=0.95 * WIDTH * seen,
        width_px=WIDTH,
        height_px=seen,
        left_px=u - WIDTH / 2,
        top_px=top,
        confidence=seen / HEIGHT,
    )


def hand_with_tip(u: float, v: float) -> TrackedObject:
    """A hand 60 px long whose finger points along +u and ends at (u, v)."""
    outline = [(u, v), (u - 28, v - 12), (u - 60, v - 10), (u - 60, v + 10), (u - 28, v + 12)]
    return TrackedObject(
        name="magenta",
        kind=TrackedObject.KIND_HAND,
        u_px=u - 42,
        v_px=v,
        area_px=900,
        width_px=60,
        height_px=24,
        left_px=u - 60,
        top_px=v - 12,
        confidence=1,
        outline=[OutlinePoint(u_px=a, v_px=b) for a, b in outline],
    )


def image_of(captured_ns: int, *seen: TrackedObject) -> TrackedObjects:
    tracked = TrackedObjects(frame="camera_optical", width_px=480, height_px=360, objects=seen)
    tracked.captured.FromNanoseconds(captured_ns)
    return tracked


class Play:
    """Plays drawn images to a recognizer, one per camera period."""

    def __init__(self) -> None:
        self.recognizer = Recognizer()
        self.gestures: list[Gesture] = []
        self._tick = 0

    def show(self, *seen: TrackedObject, ticks: int = 1) -> Play:
        for _ in range(ticks):
            self._tick += 1
            self.gestures += self.recognizer.update(image_of(self._tick * PERIOD_NS, *seen))
        return self

    def blind(self, ticks: int) -> Play:
        """So many camera periods without an image."""
        self._tick += ticks
        return self

    def kinds(self, name: str) -> list[str]:
        return [Gesture.Kind.Name(g.kind).removeprefix("KIND_") for g in self.gestures if g.object == name]


def line(start: tuple[float, float], end: tuple[float, float], ticks: int) -> Iterable[tuple[float, float]]:
    """Places on the straight line, without the first."""
    for tick in range(1, ticks + 1):
        yield start[0] + (end[0] - start[0]) * tick / ticks, start[1] + (end[1] - start[1]) * tick / ticks
