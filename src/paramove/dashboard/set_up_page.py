"""The page while a person sets something up in front of a camera: the picture, the detected arms, what to do now."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np

from paramove.cameras import CalibratedCamera
from paramove.dashboard.live_picture import Texts
from paramove.dashboard.server import PageServer
from paramove.documents import Image
from paramove.observation import BodyKeyPoints

QUALITY = 80
"""Of the JPEG."""
COLOURS = ("rgb(56 189 248)", "rgb(147 163 175)")
"""Of the right and the left arm."""
DIAMETER_PX = 9.0


class SetUpPage:
    """What such a page shows.

    Args:
        server: Answers browsers.
        title: Of the page.
    """

    def __init__(self, server: PageServer, title: str) -> None:
        self._server = server
        server.show({"page": {"title": title, "robot": False, "origin": "", **Texts().model_dump()}})

    def passing(
        self, images: Iterator[tuple[CalibratedCamera, int, Image]], camera_name: str
    ) -> Iterator[tuple[CalibratedCamera, int, Image]]:
        """The same images; those of this camera are shown on their way."""
        for camera, captured_ns, image in images:
            if camera.name == camera_name:
                self.show(image)
            yield camera, captured_ns, image

    def show(self, image: Image) -> None:
        """Shows an image, (H, W, 3), BGR, if a browser is open."""
        if self._server.watched:
            done, encoded = cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, QUALITY))
            self._server.show({}, encoded.tobytes() if done else None)

    def drawing(
        self, key_points: Iterator[tuple[str, int, BodyKeyPoints]], camera_name: str
    ) -> Iterator[tuple[str, int, BodyKeyPoints]]:
        """The same key points; the arms in the images of this camera are drawn over its image on their way."""
        for name, captured_ns, points in key_points:
            if name == camera_name:
                self._server.show({"arm": drawn_arms(points)})
            yield name, captured_ns, points

    def prompt(self, sentence: str) -> None:
        """Shows what to do now."""
        self._server.show({"words": [{"sentence": sentence}]})

    def report(self, happened: str) -> None:
        """Shows what has just happened, beside that."""
        self._server.show({"stage": {"step": happened}})


def drawn_arms(points: BodyKeyPoints) -> dict[str, Any]:
    """Lines and balls of both arms, px; of points that are known."""
    arms = [np.round(arm[np.isfinite(arm).all(axis=1)], 1).tolist() for arm in points.positions]
    pairs = list(zip(arms, COLOURS, strict=True))
    return {
        "lines": [{"points": arm, "closed": False, "colour": colour} for arm, colour in pairs if arm],
        "balls": [
            {"place": place, "diameter": DIAMETER_PX, "colour": colour} for arm, colour in pairs for place in arm
        ],
    }
