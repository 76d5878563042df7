"""Monitors which cameras give usable images, and describes the faults of the others."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from paramove.cameras.calibrated import CalibratedCamera
from paramove.documents import Image, InputError

NO_DATA_S = 1.0
"""A camera without images for longer than this is reported."""
SLOW = 1.8
"""A camera whose images come in more than so many periods is reported, by the median of `INTERVALS` intervals."""
INTERVALS = 15


class CameraWatch:
    """Monitors the images of the cameras over time.

    Args:
        cameras: As calibrated.
        period_s: Expected time between two images of a camera, s.
    """

    def __init__(self, cameras: Sequence[CalibratedCamera], period_s: float) -> None:
        self._period_s = period_s
        self._times_ns = {camera.name: deque[int](maxlen=INTERVALS + 1) for camera in cameras}
        self._calibrated = {camera.name: camera for camera in cameras}
        self._rejected: dict[str, str] = {}
        self._received_ns: dict[str, int] = {}
        self._now_ns = 0

    def reject(self, camera: str, captured_ns: int, reason: str) -> None:
        """Records that an image could not be used, and why."""
        self._received(camera, captured_ns)
        self._rejected[camera] = f"{camera}: {reason}"

    def accepts(self, camera: str, captured_ns: int, image: Image) -> bool:
        """Whether an image has the size that its camera was calibrated with."""
        self._received(camera, captured_ns)
        try:
            self._calibrated[camera].check_size(image)
        except InputError as error:
            self._rejected[camera] = str(error)
            return False
        self._rejected.pop(camera, None)
        return True

    def tick(self, now_ns: int) -> None:
        """Advances the time, with images or without."""
        self._now_ns = now_ns
        for name in self._calibrated:  # from the first tick on
            self._received_ns.setdefault(name, now_ns)

    def troubles(self) -> list[str]:
        """All faults, one message each."""
        return [message for _, message in self._faults()]

    def kinds(self) -> list[str]:
        """The same without numbers that change all the time."""
        return [kind for kind, _ in self._faults()]

    def _faults(self) -> list[tuple[str, str]]:
        no_data = [
            name for name, received_ns in self._received_ns.items() if self._now_ns - received_ns > NO_DATA_S * 1e9
        ]
        if len(no_data) == len(self._calibrated):
            message = f"no images from any camera ({', '.join(no_data)})"
            return [(message, message)]
        messages = [f"no images from {name}" for name in no_data]
        messages += [one for name, one in self._rejected.items() if name not in no_data]
        slow = [(name, self._slow(name)) for name in self._calibrated if name not in no_data]
        return [*((one, one) for one in messages), *((f"{name} is slow", one) for name, one in slow if one)]

    def _slow(self, camera: str) -> str:
        times = self._times_ns[camera]
        if len(times) <= INTERVALS:
            return ""
        intervals_s = sorted(1e-9 * (later - earlier) for earlier, later in zip(times, list(times)[1:], strict=False))
        median_s = intervals_s[INTERVALS // 2]
        if median_s <= SLOW * self._period_s:
            return ""
        return (
            f"{camera} gives {1.0 / median_s:.0f} images per second, {1.0 / self._period_s:.0f} are expected: "
            "more light, a lower resolution or a port of its own helps"
        )

    def _received(self, camera: str, captured_ns: int) -> None:
        self._times_ns[camera].append(captured_ns)
        self._received_ns[camera] = max(captured_ns, self._received_ns.get(camera, captured_ns))
