"""Key points of both arms in one image: what a pose network publishes and what an observer compares postures with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.msgs.body_key_points_pb2 import BodyKeyPoints as BodyKeyPointsMessage

SIDES = ("right", "left")
ARM_POINTS = ("shoulder", "elbow", "wrist", "hand")
"""The hand's is its middle, whether the index finger is stretched or not."""
LARGEST = (1e5, 1e5, 1e4, 10.0)
"""x, y, deviation, px, and depth, m, that a point may have."""
NAMES = {f"{side}_{point}": (i, j) for i, side in enumerate(SIDES) for j, point in enumerate(ARM_POINTS)}


@dataclass(frozen=True)
class BodyKeyPoints:
    """The arms of one person in one image as captured; the first axis is `SIDES`, the second `ARM_POINTS`.

    Attributes:
        positions: (2, 4, 2), px; NaN where a point is unknown.
        deviations: Along each axis, (2, 4), px.
        depths: How much farther from the camera than the shoulder of that arm, (2, 4), m of the size that the network
            estimates the person to have.
        certainties: That a point is visible, (2, 4), 0 to 1.
        certainty: That there is a person, 0 to 1.
        px_per_m: How large the person of that size is in the image, px/m; 0 if unknown.
    """

    positions: Floats
    deviations: Floats
    depths: Floats
    certainties: Floats
    certainty: float
    px_per_m: float = 0.0

    @classmethod
    def nobody(cls, certainty: float = 0.0) -> BodyKeyPoints:
        """No person in view."""
        shape = (len(SIDES), len(ARM_POINTS))
        unknown = np.full(shape, np.nan)
        return cls(np.full((*shape, 2), np.nan), unknown, unknown, np.zeros(shape), certainty)

    @property
    def has_person(self) -> bool:
        """Whether any point is known."""
        return bool(np.isfinite(self.positions).any())

    @property
    def arm_direction(self) -> Floats:
        """From the right shoulder to the hand, unit vector (3,) in the optical frame; NaN where it is unknown.

        It needs no calibration: lengths in the image and depths are of the size that the network estimates.
        """
        along = np.append((self.positions[0, 3] - self.positions[0, 0]) / (self.px_per_m or np.nan), self.depths[0, 3])
        return np.asarray(along / np.linalg.norm(along))

    def exchanged(self) -> BodyKeyPoints:
        """Right and left exchanged."""
        return BodyKeyPoints(
            self.positions[::-1], self.deviations[::-1], self.depths[::-1], self.certainties[::-1], self.certainty,
            self.px_per_m,
        )  # fmt: skip

    def depths_at(self, shoulder_m: ArrayLike, focal_px: float) -> Floats:
        """`depths` in true metres, (..., 2, 4), of a person whose shoulder is at these depths (...), m."""
        away = np.asarray(shoulder_m, dtype=np.float64)[..., None, None]
        return self.depths * (self.px_per_m * away / focal_px if self.px_per_m else np.ones_like(away))


def key_points_message(points: BodyKeyPoints, captured_ns: int) -> BodyKeyPointsMessage:
    """The known points."""
    message = BodyKeyPointsMessage(certainty=points.certainty, px_per_m=points.px_per_m)
    message.captured.FromNanoseconds(captured_ns)
    for name, at in NAMES.items():
        x, y = points.positions[at]
        if np.isfinite((x, y)).all():
            deviation, depth, certainty = points.deviations[at], points.depths[at], points.certainties[at]
            message.points.add(name=name, x=x, y=y, deviation=deviation, depth=depth, certainty=certainty)
    return message


def key_points_from(message: BodyKeyPointsMessage) -> BodyKeyPoints:
    """The points of a message; unusable ones and those of other names are left out."""
    points = BodyKeyPoints.nobody(message.certainty)
    deviations, depths = points.deviations.copy(), points.depths.copy()
    for one in message.points:
        at = NAMES.get(one.name)
        values = np.abs((one.x, one.y, one.deviation, one.depth))
        if at is not None and (values <= LARGEST).all() and one.deviation > 0.0:  # NaN is not
            points.positions[at], points.certainties[at] = (one.x, one.y), one.certainty
            deviations[at], depths[at] = one.deviation, one.depth
    size = message.px_per_m if 0.0 < message.px_per_m <= LARGEST[0] else 0.0
    return BodyKeyPoints(points.positions, deviations, depths, points.certainties, points.certainty, size)
