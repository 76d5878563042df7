"""Shape, size and turn of an object from its outline: a cylinder or a block with a square end, standing or lying.

Near a point the camera is taken as a parallel projection. Then the outline of a body that is the (Minkowski) sum of
others has the sum of their widths across every direction. A standing body is the sum of its foot, as the homography
maps it, and of its height along the image of the vertical; a lying one is the sum of its end, which is upright, and of
its length. So for each kind and each turn the widths of the outline in all directions are linear in two sizes. A square
foot is taken if it fits clearly better than a round one, a lying body if it fits clearly better than those that stand.
What lies along the line of sight, or a block square to it, can have the outline of what stands: it counts as standing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from paramove.documents import Floats
from paramove.msgs.gesture_pb2 import Gesture
from paramove.objects.homography import PlaneHomography

_DIRECTIONS = np.deg2rad(np.arange(0.0, 180.0, 7.5))
_ACROSS = np.column_stack([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)])
_TURNS = np.deg2rad(np.arange(0.0, 180.0, 3.0))
_ALONG = np.column_stack([np.cos(_TURNS), np.sin(_TURNS)])
_BESIDE = np.column_stack([-np.sin(_TURNS), np.cos(_TURNS)])
_QUARTER = len(_TURNS) // 2
_ALONG_SIGHT = math.cos(math.radians(10.0))
_PIXEL = 0.7
"""Outlines run through the middles of the outermost pixels, half a pixel inside straight edges."""
SQUARE_FITS, LYING_FITS = 0.7, 0.5
"""Of the error of a round foot, or of what stands: a square foot, or a lying body, that fits better is taken."""
MAX_SINE = 0.98
"""Of the camera's elevation: one that is higher up does not see how high an object is."""


@dataclass(frozen=True)
class ObjectShape:
    """Attributes:
    width: Diameter of a round foot, side of a square one, or across the length of an object that lies, m; 0: not known.
    height: m; 0: not known.
    turn: From x to one of the sides of a square foot, 0 to π/2, or to the length of an object that lies, 0 to π, rad,
        frame of the plane; None: it stands on a round foot, or that is not known.
    length: Of an object that lies, m; 0: it stands.
    """

    width: float
    height: float
    turn: float | None = None
    length: float = 0.0

    @classmethod
    def of(cls, gesture: Gesture) -> Self | None:
        """Of the gesture's object; None: not known."""
        turn = gesture.turn_rad if gesture.HasField("turn_rad") else None
        shape = cls(gesture.width_m, gesture.height_m, turn, gesture.length_m)
        return shape if shape.width or shape.height else None

    @property
    def face(self) -> float:
        """Width times height, m²."""
        return self.width * self.height


class _Fit(NamedTuple):
    error: float
    sizes: Floats
    turn: float


def object_shape(outline: Floats, homography: PlaneHomography) -> ObjectShape | None:
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
    spans = outline @ _ACROSS.T
    widths = spans.max(axis=0) - spans.min(axis=0) + _PIXEL
    in_plane, tall = _ACROSS @ image_from_plane, np.abs(_ACROSS @ up)
    along, beside = np.abs(_ALONG @ in_plane.T), np.abs(_BESIDE @ in_plane.T)
    clear = np.flatnonzero(np.abs(_ALONG @ away) < _ALONG_SIGHT)
    foot = _fit(np.linalg.norm(in_plane, axis=1)[None], tall, widths)
    square = _fit((along + beside)[:_QUARTER], tall, widths)
    ends = np.concatenate([np.hypot(beside, tall)[clear], (beside + tall)[clear]])
    lying = _fit(ends, np.tile(along[clear], (2, 1)), widths, np.tile(_TURNS[clear], 2))
    standing = square if square.error < SQUARE_FITS * foot.error else foot
    if lying.error < LYING_FITS * standing.error:
        width, length = (float(size) for size in lying.sizes)
        return ObjectShape(width, width, lying.turn, length)
    if not math.isfinite(standing.error):
        return None
    width, height = (float(size) for size in standing.sizes)
    return ObjectShape(width, height, square.turn if standing is square else None)


def _fit(one: Floats, other: Floats, widths: Floats, turns: Floats = _TURNS) -> _Fit:
    """The best of several bodies: widths [N] as a sum of a first size times `one` [K, N] and a second times `other`."""
    designs = np.stack(np.broadcast_arrays(one, other), axis=-1)
    sizes = np.linalg.pinv(designs) @ widths
    errors = np.linalg.norm(np.einsum("kns,ks->kn", designs, sizes) - widths, axis=1)
    errors[(sizes <= 0.0).any(axis=1)] = np.inf
    best = int(np.argmin(errors))
    return _Fit(float(errors[best]), sizes[best], float(turns[best]))
