"""Sets of images that wait a little for the key points that a slower process finds in them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence

from paramove.cameras import Views
from paramove.documents import Image
from paramove.observation import BodyKeyPoints

LONGEST_WAIT_NS = 150_000_000
"""A set goes on without its key points after this time. Nothing waits for a detector that takes longer."""
GONE_NS = 1_000_000_000
"""Without key points for this long nothing waits for them."""

Timed = tuple[int, Image]
"""When an image was captured, ns, and the image."""
Awaited = tuple[Views[Timed], list[BodyKeyPoints | None]]


class AwaitedKeyPoints:
    """Sets of images and key points in, sets with the key points of each image out, in the order of time.

    Args:
        names: Of the cameras, in the order of a set's images.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._points: dict[str, deque[tuple[int, BodyKeyPoints]]] = {name: deque(maxlen=16) for name in names}
        self._late_ns = dict.fromkeys(names, 0)
        self._sets: deque[Views[Timed]] = deque()
        self._now_ns = 0

    def add_set(self, views: Views[Timed]) -> Iterator[Awaited]:
        """What goes on now that there is this set."""
        self._sets.append(views)
        return self.released(views.captured_ns)

    def add_points(self, camera: str, captured_ns: int, points: BodyKeyPoints) -> Iterator[Awaited]:
        """What goes on now that there are key points of an image of this camera."""
        self._late_ns[camera] = self._now_ns - captured_ns
        self._points[camera].append((captured_ns, points))
        return self.released(self._now_ns)

    def released(self, now_ns: int) -> Iterator[Awaited]:
        """Sets that wait no longer."""
        self._now_ns = max(self._now_ns, now_ns)
        while self._sets and not self._waits(self._sets[0]):
            views = self._sets.popleft()
            images = zip(self._points, views.images, strict=True)
            yield views, [None if timed is None else self._of(camera, timed[0]) for camera, timed in images]

    def trouble(self) -> str:
        """Which detector is too slow to be waited for; "" if none is."""
        late = [
            f"{camera}, {late_ns / 1e6:.0f} ms"
            for camera, late_ns in self._late_ns.items()
            if late_ns > LONGEST_WAIT_NS
        ]
        if not late or all(self._is_gone(camera, self._now_ns) for camera in self._points):
            return ""
        return (
            f"key points come too late to be used ({'; '.join(late)} after the image): fewer cameras or a faster "
            "machine helps; until then the arm is tracked by its outline alone"
        )

    def _waits(self, views: Views[Timed]) -> bool:
        if self._now_ns - views.captured_ns >= LONGEST_WAIT_NS:
            return False
        return any(
            timed is not None and self._is_due(camera, timed[0])
            for camera, timed in zip(self._points, views.images, strict=True)
        )

    def _is_due(self, camera: str, captured_ns: int) -> bool:
        """Whether the key points of an image will probably come in time."""
        if self._is_gone(camera, captured_ns) or self._late_ns[camera] > LONGEST_WAIT_NS:
            return False
        return self._points[camera][-1][0] < captured_ns

    def _is_gone(self, camera: str, at_ns: int) -> bool:
        return not self._points[camera] or self._points[camera][-1][0] < at_ns - GONE_NS

    def _of(self, camera: str, captured_ns: int) -> BodyKeyPoints | None:
        return next((points for at_ns, points in self._points[camera] if at_ns == captured_ns), None)
