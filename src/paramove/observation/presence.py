"""Whether an arm is visible at its estimated pose, from the changes against the learned background."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats
from paramove.observation.arm_body import HAND
from paramove.observation.background import FULL

AXIS_FRACTIONS = np.linspace(0.25, 0.95, 15)
"""Positions on the line from elbow over the wrist to the fingertip that must be visible, as fractions of it."""
CHANGED = 30
"""A pixel with more than this, of `FULL`, has changed."""
AROUND = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1)), axis=-1).reshape(-1, 2)
"""Pixels (x, y) around such a position."""


@dataclass(frozen=True)
class Presence:
    """Whether there is an arm at all, as far as the background is known.

    Attributes:
        there: along forearm and hand, mean over the views: 1 where something else than the background is visible, -1
            where only the background is, 0 where it is unknown.
        changed: area in which the images differ from the background, as a multiple of the arm's; mean over the views.
    """

    there: float = 0.0
    changed: float = 0.0


def presence_in_view(
    pose: Floats, camera: CalibratedCamera, table: NDArray[np.uint8], change: NDArray[np.int8], arm_area: float
) -> Presence:
    """In one view.

    Args:
        pose: shoulder, elbow, fingertip, (9,), or also the wrist, (12,), m, world. camera: at the compared size.
        table: 1 where the table is visible, and change: from the background; both flat with a border of one pixel.
        arm_area: px.
    """
    changed = np.count_nonzero(change > CHANGED) / arm_area
    elbow, hand = pose[3:6], pose[HAND]
    wrist = pose[9:12] if len(pose) > 9 else 0.5 * (elbow + hand)
    corners = np.stack([elbow, wrist, hand])
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    axis = np.stack([np.interp(AXIS_FRACTIONS * lengths[-1], lengths, column) for column in corners.T], axis=1)
    pixels = np.round(camera.project(axis, distorted=False))
    size, stride = (camera.width_px, camera.height_px), camera.width_px + 2
    inside = ((pixels >= 0.0) & (pixels < size)).all(axis=1)  # NaN, behind the camera, is not
    at = (pixels[inside].astype(np.int64) + 1) @ (1, stride)
    if len(table) > 0:
        at = at[(table[at] == 0) | (axis[inside, 2] >= 0.0)]  # what the table does not hide
    there = change[at[:, None] + AROUND @ (1, stride)].mean() / FULL if len(at) > 0 else 0.0
    return Presence(float(there), float(changed))
