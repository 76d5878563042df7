"""Pose networks on the images of several cameras, and what a person has to know about the pictures."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from paramove.documents import Floats, Image, InputError
from paramove.observation.body_key_points import BodyKeyPoints
from paramove.observation.network_files import stored_network
from paramove.observation.pose_network import PoseNetwork

REPORTED_IMAGES = 15
"""What so many images in a row lack is reported."""
WATCHED_IMAGES = 45
"""Over so many images the movements of both hands are compared."""
MOVED, STILL = 60.0, 15.0
"""A hand moves and one rests, deviations of a key point; a person's trunk is about 40 of them high."""


@dataclass
class _View:
    """A camera's network, and what its last images lacked."""

    network: PoseNetwork
    unseen: int = 0
    outside: int = 0
    hands: deque[Floats] = field(default_factory=lambda: deque(maxlen=WATCHED_IMAGES))

    def detect(self, image: Image) -> BodyKeyPoints:
        points = self.network.detect(image)
        self.unseen = 0 if points.has_person else self.unseen + 1
        arm, size = points.positions[0], image.shape[1::-1]
        inside = bool(((arm >= 0.0) & (arm < size)).all())
        self.outside = 0 if inside or not points.has_person else self.outside + 1
        if points.has_person:
            self.hands.append((points.positions[:, 3] - points.positions[:, 0]) / points.deviations[:, :1])
        else:
            self.hands.clear()
        return points

    @property
    def trouble(self) -> str:
        if self.unseen >= REPORTED_IMAGES:
            return "nobody is in view: sit where it sees head, shoulders and the pointing arm"
        if self.outside >= REPORTED_IMAGES:
            return "the right arm leaves the picture: move back, or turn the camera to the arm"
        if len(self.hands) == WATCHED_IMAGES:
            right, left = np.ptp(np.array(self.hands), axis=0).max(axis=1)
            if left > MOVED and right < STILL:
                return "the left arm moves and the right one rests, but the right one is tracked: point with that one"
        if self.network.others:
            return "another person is in view: the nearer one is followed; the other should leave the picture"
        return ""


class PoseDetection:
    """Detects the arms of one person in the images of cameras, each by a network of its own.

    Args:
        networks: Folder of the networks, by default that of the user's cache.
        offline: See `stored_network`.

    Attributes:
        missing: Why there are no networks; None if there are.

    Without the networks nothing is detected, and `trouble` gives the reason.
    """

    def __init__(self, networks: Path | None = None, *, offline: bool = False) -> None:
        self._folder, self._offline = networks, offline
        self._views: dict[str, _View] = {}
        self.missing: InputError | None = None
        self._unused: PoseNetwork | None = None
        try:
            self._unused = stored_network(networks, offline=offline)
        except InputError as error:
            self.missing = error

    def detect(self, camera: str, image: Image) -> BodyKeyPoints | None:
        """Of an image (H, W, 3), BGR; None without the networks."""
        if self.missing:
            return None
        if camera not in self._views:
            self._views[camera] = _View(self._unused or stored_network(self._folder, offline=self._offline))
            self._unused = None
        return self._views[camera].detect(image)

    @property
    def trouble(self) -> str:
        """What a person can do about the pictures, by camera; "" if nothing is wrong."""
        troubles = [f"{camera}: {view.trouble}" for camera, view in self._views.items() if view.trouble]
        if self.missing:
            return f"{self.missing}. Until then the arm is tracked by its outline alone"
        return "; ".join(troubles)
