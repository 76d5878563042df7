"""Key points of a person's arms by MediaPipe's pose and hand landmark networks, one image after the other.

The networks: V. Bazarevsky et al., "BlazePose: On-device Real-time Body Pose tracking", 2020; F. Zhang et al.,
"MediaPipe Hands: On-device Real-time Hand Tracking", 2020. The noise was measured on pictures of a person by four
calibrated cameras.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Image, InputError
from paramove.observation.body_key_points import BodyKeyPoints

POSE_PX, HAND_PX = 256, 224
"""Side of the square picture that each network takes."""
ARMS = np.array([[12, 14, 16, 20], [11, 13, 15, 19]])
"""Rows of shoulder, elbow, wrist, knuckle of the index finger among the landmarks; right arm, left arm."""
LITTLE_FINGER = np.array([18, 17])
"""Rows of the knuckle of the little finger."""
TRUNK = np.array([11, 12, 13, 14, 15, 16, 23, 24])
"""Rows of shoulders, elbows, wrists and hips, which show how large a person is."""
CENTRE, TOP = 33, 34
"""Rows of the middle of the hips, and of a point as far from it as the person is large, upwards."""
BODY_SIDE = 2.5
"""Side of the next crop, of the distance between these two points."""
HAND_SIDE = 4.0
"""Side of the crop of a hand, of the distance from wrist to knuckles."""
MIN_PERSON, MIN_HAND = 0.5, 0.02
"""Certainty from which on there is a person, and from which on the hand's network is better than the body's."""
NOISE_PX = np.array([2.4, 3.0, 2.7, 3.3])
"""Deviation of shoulder, elbow, wrist, hand along each axis, px of the crop."""
HAND_NOISE = 0.5
"""Deviation of the hand's middle by the hand's network, of that by the body's."""
FIRST_PASSES = 4
"""Crops until they show a new person well: each is placed by the one before."""
WINDOWS = (
    *((0.75, x, x) for x in (0.5, 0.0, 1.0)),
    *((0.45, x, y) for y in (0.5, 0.0, 1.0) for x in (0.5, 0.0, 1.0)),
)
"""Where else a person is searched: side of a square, of the picture's longer one, and place in the picture, 0 to 1."""
WATCHED_EVERY = 5
"""In every so many images one of them is searched for another person."""
TURNS = np.radians([0.0, 90.0, 180.0, 270.0])
VOTES = 8
"""Images of a person that decide how the picture is turned: a turned person is often found as well, with less certain
arms."""
NEARER = 1.25
"""Another person who is larger than the present one by so much is followed instead."""


@dataclass(frozen=True)
class Crop:
    """A square part of an image, turned: centre (2,), px; side, px; angle of its downward axis to the image's, rad."""

    centre: Floats
    side_px: float
    angle: float = 0.0

    @classmethod
    def whole(cls, image: Image, angle: float = 0.0) -> Crop:
        """The smallest one that has all of an image."""
        return cls.window(image, 1.0, 0.5, 0.5, angle)

    @classmethod
    def window(cls, image: Image, side: float, x: float, y: float, angle: float = 0.0) -> Crop:
        """One of that side, of the longer one of an image, within the image; x, y from its left and top, 0, to 1."""
        size = np.array(image.shape[1::-1], dtype=np.float64)
        side_px = side * size.max()
        room = np.maximum(size - side_px, 0.0)
        return cls(size / 2.0 - 0.5 + room * (np.array([x, y]) - 0.5), float(side_px), angle)

    def image_from_crop(self, size: int) -> Floats:
        """(2, 3), from px of a picture of that size to px of the image."""
        turn = self.side_px / size * np.array(
            [[np.cos(self.angle), -np.sin(self.angle)], [np.sin(self.angle), np.cos(self.angle)]]
        )  # fmt: skip
        return np.column_stack([turn, self.centre - turn @ np.full(2, size / 2.0 - 0.5)])

    def cut(self, image: Image, size: int) -> Floats:
        """The picture as a network takes it, (1, 3, size, size), 0 to 1."""
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        cut = cv2.warpAffine(image, self.image_from_crop(size), (size, size), flags=flags)
        return np.asarray(cv2.dnn.blobFromImage(cut, 1.0 / 255.0, swapRB=True))

    def placed(self, points: ArrayLike, size: int) -> Floats:
        """Points (N, 2), px of the picture, in the image."""
        matrix = self.image_from_crop(size)
        return np.asarray(np.asarray(points, dtype=np.float64) @ matrix[:, :2].T + matrix[:, 2])


class PoseNetwork:
    """Detects the arms of one person in the images of one camera, each near where the one before was.

    The person who is nearest, and so largest in the picture, is followed.

    Args:
        pose, hand: Files of the networks.

    Raises InputError for a file that is no network.
    """

    def __init__(self, pose: Path, hand: Path) -> None:
        self._pose, self._hand = _network(pose), _network(hand)
        self._crop: Crop | None = None
        self._images = 0
        self._window = 0
        self._other_window: int | None = None
        self._candidate: Crop | None = None
        self._passes = 0
        self._votes, self._voted = np.zeros(len(TURNS)), 0

    @property
    def others(self) -> bool:
        """Whether another person was in view lately."""
        return self._other_window is not None

    @property
    def turn(self) -> float:
        """Angle of a person's downward axis to the picture's, rad; a multiple of 90 degrees."""
        return float(TURNS[self._votes.argmax()])

    def detect(self, image: Image) -> BodyKeyPoints:
        """Of an image (H, W, 3), BGR. Without a person, the whole image and one of its windows are searched."""
        self._images += 1
        before = self._crop
        if self._voted < VOTES:
            self._voted += before is not None
            self._crop = self._vote(image) or before or self._converged(image, self._next_window(image))
        elif before is None:
            whole = Crop.whole(image, self.turn)
            self._crop = self._converged(image, whole) or self._converged(image, self._next_window(image))
        elif self._images % WATCHED_EVERY == 0:
            self._watch(image, before)
        if self._crop is None:
            return BodyKeyPoints.nobody()
        found, self._crop = self._body(image, self._crop)
        for side in range(len(ARMS) if found.has_person else 0):
            self._refine(image, found, side)
        return found

    def _next_window(self, image: Image) -> Crop:
        self._window = (self._window + 1) % len(WINDOWS)
        return Crop.window(image, *WINDOWS[self._window], self.turn)

    def _vote(self, image: Image) -> Crop | None:
        """Searches a person in the whole picture, in each turn; the one in the turn that is the likeliest so far."""
        crops = [self._converged(image, Crop.whole(image, angle)) for angle in TURNS]
        certainties = [0.0 if crop is None else self._body(image, crop)[0].certainties.mean() for crop in crops]
        self._votes += certainties
        return crops[self._votes.argmax()]

    def _watch(self, image: Image, followed: Crop) -> None:
        """Searches another person in one part of an image; one pass an image, so that none takes long."""
        crop = self._candidate or self._next_window(image)
        _, self._candidate = self._body(image, crop)
        self._passes = 0 if self._candidate is None else self._passes + 1
        if 0 < self._passes < FIRST_PASSES:
            return
        other, self._candidate, self._passes = self._candidate, None, 0
        apart = 0.0 if other is None else float(np.hypot(*(other.centre - followed.centre)))
        if other is not None and apart > 0.5 * min(other.side_px, followed.side_px) / BODY_SIDE:
            self._other_window = self._window
            if other.side_px > NEARER * followed.side_px:
                self._crop = other
        elif self._other_window == self._window:
            self._other_window = None

    def _converged(self, image: Image, crop: Crop) -> Crop | None:
        """The crop around a person whom a crop shows; None if it shows none."""
        placed: Crop | None = crop
        for _ in range(FIRST_PASSES):
            if placed is not None:
                _, placed = self._body(image, placed)
        return placed

    def _body(self, image: Image, crop: Crop) -> tuple[BodyKeyPoints, Crop | None]:
        """The person in a crop, and the crop of the next image; None without a person."""
        names = ("Identity", "Identity_1", "Identity_4")
        landmarks, person, world = _outputs(self._pose, crop.cut(image, POSE_PX), names)
        certainty = float(person.ravel()[0])
        rows = landmarks.reshape(-1, 5).astype(np.float64)
        in_image = crop.placed(rows[:, :2], POSE_PX)
        up = in_image[TOP] - in_image[CENTRE]
        size = float(np.hypot(*up))
        if not (certainty >= MIN_PERSON and np.isfinite(rows).all() and 2.0 < size < 4.0 * max(image.shape)):
            return BodyKeyPoints.nobody(certainty), None
        body = world.reshape(-1, 3).astype(np.float64)
        positions, depths = in_image[ARMS], body[ARMS, 2]
        spread_px, spread_m = (
            float(np.linalg.norm(one[TRUNK] - one[TRUNK].mean(axis=0))) for one in (in_image, body[:, :2])
        )
        positions[:, 3] = (in_image[ARMS[:, 3]] + in_image[LITTLE_FINGER]) / 2.0
        certainties = _sigmoid(rows[ARMS, 3]) * _sigmoid(rows[ARMS, 4])
        deviations = np.tile(NOISE_PX * crop.side_px / POSE_PX, (len(ARMS), 1))
        px_per_m = spread_px / max(spread_m, 1e-3)
        found = BodyKeyPoints(positions, deviations, depths - depths[:, :1], certainties, certainty, px_per_m)
        return found, Crop(in_image[CENTRE], BODY_SIDE * size, float(np.arctan2(up[0], -up[1])))

    def _refine(self, image: Image, found: BodyKeyPoints, side: int) -> None:
        """Replaces the middle of a hand by that of the hand's network, where that sees a hand."""
        middle = found.positions[side, 3]
        along = middle - found.positions[side, 2]
        length = float(np.hypot(*along))
        if length < 1.0:
            return
        crop = Crop(middle, HAND_SIDE * length, float(np.arctan2(along[0], -along[1])))
        landmarks, hand = _outputs(self._hand, crop.cut(image, HAND_PX), ("Identity", "Identity_1"))
        if float(hand.ravel()[0]) >= MIN_HAND and np.isfinite(landmarks).all():
            found.positions[side, 3] = crop.placed(landmarks.reshape(-1, 3)[:, :2], HAND_PX).mean(axis=0)
            found.deviations[side, 3] *= HAND_NOISE


def _network(path: Path) -> cv2.dnn.Net:
    try:
        return cv2.dnn.readNetFromTFLite(str(path))
    except cv2.error as error:
        raise InputError(
            f"{path}: no network that OpenCV reads; fetch it again with `paramove webcam setup`"
        ) from error


def _outputs(network: cv2.dnn.Net, picture: Floats, names: tuple[str, ...]) -> tuple[Floats, ...]:
    network.setInput(picture)
    return tuple(np.asarray(one) for one in network.forward(names))


def _sigmoid(values: Floats) -> Floats:
    return np.asarray(1.0 / (1.0 + np.exp(-values)))
