"""Meshes of the openings: convex wedges to touch, and thin surfaces to look at.

MuJoCo takes the convex hull of a mesh for contacts, so a hole must be put together from convex pieces around it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats

TILE_HALF = 0.027  # of the square around an opening that the wedges fill, m


def wedges(radius: float, chamfer: float, depth: float, count: int = 16) -> list[Floats]:
    """Corners of the convex pieces around one round opening with a 45 degree chamfer.

    The inner faces are circumscribed about the opening, so a cylinder of `radius` just passes.

    Args:
        radius: Free radius of the opening, m.
        chamfer: Height and width of the chamfer, m.
        depth: Of the compartment, m.
        count: How many pieces; a multiple of 4.

    Returns:
        `count` arrays [n, 3]; origin in the middle of the opening on the upper face, z up.
    """
    pieces = []
    for piece in range(count):
        ends = (2 * np.pi * piece / count, 2 * np.pi * (piece + 1) / count)
        points = [point for angle in ends for point in _profile(angle, radius, chamfer, depth, count)]
        corners = [corner for corner in np.pi / 4 + np.pi / 2 * np.arange(4) if ends[0] < corner < ends[1]]
        for angle in (*ends, *corners):
            x, y = _on_square(float(angle))
            points += [(x, y, 0.0), (x, y, -depth)]
        pieces.append(np.array(points))
    return pieces


def lining(radius: float, chamfer: float, depth: float, count: int = 16) -> tuple[Floats, NDArray[np.int32]]:
    """Visible inside of one opening: chamfer, wall, floor. Vertices [n, 3] and triangles [m, 3], facing inwards."""
    rings = np.array([_profile(2 * np.pi * k / count, radius, chamfer, depth, count) for k in range(count)])
    vertices = np.concatenate([rings.reshape(-1, 3), [[0.0, 0.0, -depth]]])
    triangles = []
    for k in range(count):
        here, there = 3 * k, 3 * ((k + 1) % count)
        for low in (0, 1):  # wall, chamfer
            a, b, c, d = here + low, there + low, there + low + 1, here + low + 1
            triangles += [(a, c, b), (a, d, c)]
        triangles.append((here, there, 3 * count))
    return vertices, np.array(triangles, dtype=np.int32)


def cover(
    half_size: tuple[float, float, float], centres: Floats, radius: float, chamfer: float, count: int = 16
) -> tuple[Floats, NDArray[np.int32]]:
    """Visible outside of the box, its upper face pierced at `centres` [k, 2]. Vertices [n, 3], triangles [m, 3].

    Origin in the middle of the box. All openings lie in one row along y.
    """
    hx, hy, hz = half_size
    quads: list[Floats] = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            if (axis, sign) != (2, 1.0):
                quads.append(_face(half_size, axis, sign))
    row_x = float(centres[0, 0])
    quads += [_flat(-hx, row_x - TILE_HALF, -hy, hy, hz), _flat(row_x + TILE_HALF, hx, -hy, hy, hz)]
    edge = -hy
    for y in sorted(float(y) for y in centres[:, 1]):
        quads.append(_flat(row_x - TILE_HALF, row_x + TILE_HALF, edge, y - TILE_HALF, hz))
        edge = y + TILE_HALF
        quads += _pierced_tile(row_x, y, hz, radius + chamfer, count)
    quads.append(_flat(row_x - TILE_HALF, row_x + TILE_HALF, edge, hy, hz))
    corners = np.concatenate(quads)
    first = 4 * np.arange(len(quads))[:, None]
    triangles = np.concatenate([first + np.array((0, 1, 2)), first + np.array((0, 2, 3))])
    return corners, triangles.astype(np.int32)


def _profile(angle: float, radius: float, chamfer: float, depth: float, count: int) -> list[tuple[float, float, float]]:
    """Bottom of the wall, top of the wall, top of the chamfer."""
    outside = 1 / np.cos(np.pi / count)  # corners lie outside the circle that the faces touch
    x, y = np.cos(angle) * outside, np.sin(angle) * outside
    wide = radius + chamfer
    return [(radius * x, radius * y, -depth), (radius * x, radius * y, -chamfer), (wide * x, wide * y, 0.0)]


def _on_square(angle: float) -> tuple[float, float]:
    x, y = float(np.cos(angle)), float(np.sin(angle))
    scale = TILE_HALF / max(abs(x), abs(y))
    return scale * x, scale * y


def _flat(x0: float, x1: float, y0: float, y1: float, z: float) -> Floats:
    return np.array([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)])


def _face(half_size: tuple[float, float, float], axis: int, sign: float) -> Floats:
    """Corners of one side of a box, anticlockwise from outside."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    corners = np.zeros((4, 3))
    corners[:, axis] = sign * half_size[axis]
    for row, (a, b) in enumerate(((-1, -1), (1, -1), (1, 1), (-1, 1))):
        corners[row, u], corners[row, v] = a * half_size[u], b * half_size[v]
    return corners if sign > 0 else corners[::-1]


def _pierced_tile(x: float, y: float, z: float, radius: float, count: int) -> list[Floats]:
    """Quads between a circle of `radius` and the square tile around it."""
    outside = radius / np.cos(np.pi / count)
    quads = []
    for k in range(count):
        a, b = 2 * np.pi * k / count, 2 * np.pi * (k + 1) / count
        inner = [(x + outside * np.cos(t), y + outside * np.sin(t), z) for t in (a, b)]
        outer = [(x + u, y + v, z) for u, v in (_on_square(a), _on_square(b))]
        quads.append(np.array([inner[0], outer[0], outer[1], inner[1]]))
        corners = [corner for corner in np.pi / 4 + np.pi / 2 * np.arange(4) if a + 1e-9 < corner < b - 1e-9]
        for corner in corners:
            u, v = _on_square(float(corner))
            tip = (x + u, y + v, z)
            quads.append(np.array([outer[0], tip, outer[1], outer[1]]))
    return quads
