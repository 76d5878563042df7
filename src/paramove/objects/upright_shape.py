"""Shape and size of an upright object from its outline: round or with a square foot, how wide, how high, how turned.

Near a point the camera is taken as a parallel projection. Then the outline of a prism is the (Minkowski) sum of its
foot, as the homography maps it, and of its height along the image of the vertical; and the width of a sum across any
direction is the sum of both widths. So for a round foot, and for a square one of each angle, the widths of the outline
in all directions are linear in width and height of the object. A square foot is taken if it fits clearly better.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from paramove.documents import Floats
from paramove.msgs.gesture_pb2 import Gesture
from paramove.objects.homography import PlaneHomography

_DIRECTIONS = np.deg2rad(np.arange(0.0, 180.0, 7.5))
_ACROSS = np.column_stack([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)])
_TURNS = np.deg2rad(np.arange(0.0, 90.0, 3.0))
_PIXEL = 0.7
"""Outlines run through the middles of the outermost pixels, half a pixel inside straight edges."""
CLEARLY = 0.7
"""Of the error of a round foot: an object is a block if a square one fits better than that."""
MAX_SINE = 0.98
"""Of the camera's elevation: one that is higher up does not see how high an object is."""


@dataclass(frozen=True)
class UprightShape:
    """Attributes:
    width: Diameter of a round foot, side of a square one, m; 0: not known.
    height: m; 0: not known.
    turn: Of a square foot: from x to one of its sides, 0 to π/2, rad, frame of the plane; None: it is round.
    """

    width: float
    height: float
    turn: float | None = None

    @classmethod
    def of(cls, gesture: Gesture) -> Self | None:
        """Of the gesture's object; None: not known."""
        turn = gesture.turn_rad if gesture.HasField("turn_rad") else None
        return cls(gesture.width_m, gesture.height_m, turn) if gesture.width_m or gesture.height_m else None

    @property
    def face(self) -> float:
        """Width times height, m²."""
        return self.width * self.height


def upright_shape(outline: Floats, homography: PlaneHomography) -> UprightShape | None:
    """Of a wholly visible object with this outline, [M, 2], px; None if that is not the outline of a solid.

    Args:
        homography: Of the plane of the object's middle, or of one near to it.

    Raises ValueError if the outline lies on the plane's horizon.
    """
    if len(outline) < 3:
        return None
    u, v = (float(middle) for middle in (outline.min(axis=0) + outline.max(axis=0)) / 2)
    image_from_plane = homography.image_directions(u, v)
    away, sine = homography.away_from_camera(u, v)
    up = image_from_plane @ away * math.sqrt(1.0 - min(sine, MAX_SINE) ** 2) / sine
    along = outline @ _ACROSS.T
    widths = along.max(axis=0) - along.min(axis=0) + _PIXEL
    of_height = np.abs(_ACROSS @ up)
    in_plane = _ACROSS @ image_from_plane
    feet = [np.linalg.norm(in_plane, axis=1)]
    for turn in _TURNS:
        side = np.array([math.cos(turn), math.sin(turn)])
        feet.append(np.abs(in_plane @ side) + np.abs(in_plane @ [-side[1], side[0]]))
    designs = [np.column_stack([foot, of_height]) for foot in feet]
    sizes = [np.linalg.lstsq(design, widths, rcond=None)[0] for design in designs]
    errors = [float(np.linalg.norm(design @ size - widths)) for design, size in zip(designs, sizes, strict=True)]
    best = 1 + int(np.argmin(errors[1:]))
    best = best if errors[best] < CLEARLY * errors[0] else 0
    width, height = (float(size) for size in sizes[best])
    if width <= 0.0 or height <= 0.0:
        return None
    return UprightShape(width, height, float(_TURNS[best - 1]) if best else None)
