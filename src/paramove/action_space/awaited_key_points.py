"""Images of one camera that wait a little for the key points that a slower process finds in them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from paramove.documents import Image
from paramove.observation import BodyKeyPoints

LONGEST_WAIT_NS = 150_000_000
"""An image goes on without its key points after this time."""
GONE_NS = 1_000_000_000
"""Without key points for this long nothing waits for them."""

Item = tuple[Image, BodyKeyPoints | None]


class AwaitedKeyPoints:
    """Images and key points by their capture times, in; images with key points, in the order of time, out."""

    def __init__(self) -> None:
        self._images: deque[tuple[int, Image]] = deque()
        self._points: deque[tuple[int, BodyKeyPoints]] = deque(maxlen=16)

    def add_image(self, captured_ns: int, image: Image) -> Iterator[tuple[int, Item]]:
        """What goes on now that there is this image."""
        self._images.append((captured_ns, image))
        return self.released(captured_ns)

    def add_points(self, captured_ns: int, points: BodyKeyPoints) -> Iterator[tuple[int, Item]]:
        """What goes on now that there are these key points."""
        self._points.append((captured_ns, points))
        return self.released(captured_ns)

    def released(self, now_ns: int) -> Iterator[tuple[int, Item]]:
        """Capture time, image and key points, or None, of each image that waits no longer."""
        while self._images:
            captured_ns, image = self._images[0]
            while self._points and self._points[0][0] < captured_ns and len(self._points) > 1:
                self._points.popleft()
            latest_ns = self._points[-1][0] if self._points else captured_ns - GONE_NS - 1
            waits = captured_ns - GONE_NS <= latest_ns < captured_ns and now_ns - captured_ns < LONGEST_WAIT_NS
            if waits:
                return
            self._images.popleft()
            found = next((points for at_ns, points in self._points if at_ns == captured_ns), None)
            yield captured_ns, (image, found)
