"""Which cameras give images of use, and what is wrong with the others, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

from paramove.cameras.calibrated import CalibratedCamera
from paramove.documents import Image

SILENT_S = 1.0
"""A camera of which nothing was heard for so long is told."""


class CameraWatch:
    """Hears of every image and of time.

    Args:
        cameras: As calibrated.
    """

    def __init__(self, cameras: Sequence[CalibratedCamera]) -> None:
        self._calibrated = {camera.name: camera for camera in cameras}
        self._refused: dict[str, str] = {}
        self._heard_ns: dict[str, int] = {}
        self._now_ns = 0

    def refuse(self, camera: str, captured_ns: int, sentence: str) -> None:
        """An image that could not be used, and why."""
        self._heard(camera, captured_ns)
        self._refused[camera] = f"{camera}: {sentence}"

    def accepts(self, camera: str, captured_ns: int, image: Image) -> bool:
        """Whether an image has the size that its camera was calibrated with."""
        self._heard(camera, captured_ns)
        calibrated, (height_px, width_px) = self._calibrated[camera], image.shape[:2]
        if (width_px, height_px) == (calibrated.width_px, calibrated.height_px):
            self._refused.pop(camera, None)
            return True
        self._refused[camera] = (
            f"{camera} gives {width_px} x {height_px} px, calibrated are {calibrated.width_px} x "
            f"{calibrated.height_px} px: set its resolution or calibrate it anew"
        )
        return False

    def tick(self, now_ns: int) -> None:
        """Time has passed, with images or without."""
        self._now_ns = now_ns
        for name in self._calibrated:  # from the first tick on
            self._heard_ns.setdefault(name, now_ns)

    def refused(self) -> list[str]:
        """Why the latest images of some cameras could not be used, a sentence each."""
        return list(self._refused.values())

    def troubles(self) -> list[str]:
        """What is wrong, a sentence each."""
        silent = [name for name, heard_ns in self._heard_ns.items() if self._now_ns - heard_ns > SILENT_S * 1e9]
        told = [one for name, one in self._refused.items() if name not in silent]
        if len(silent) == len(self._calibrated):
            return [f"no camera gives images: {', '.join(silent)} silent"]
        return [*(f"{name} is silent" for name in silent), *told]

    def _heard(self, camera: str, captured_ns: int) -> None:
        self._heard_ns[camera] = max(captured_ns, self._heard_ns.get(camera, captured_ns))
