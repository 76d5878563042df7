"""The openings: as wide as they should be, made of convex pieces, with visible surfaces that face the right way."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import ConvexHull

from sim import opening, tool_box

RADIUS, CHAMFER, DEPTH = tool_box.OPENING_RADIUS, tool_box.CHAMFER, tool_box.COMPARTMENT_DEPTH


def test_free_radius_is_that_of_the_opening() -> None:
    """The nearest any wedge comes to the axis, below the chamfer, is the radius: the inner faces are circumscribed."""
    nearest = []
    for piece in opening.wedges(RADIUS, CHAMFER, DEPTH):
        inner = piece[(piece[:, 2] <= -CHAMFER) & (np.abs(piece[:, :2]).max(axis=1) < opening.TILE_HALF - 1e-9)]
        ends = inner[inner[:, 2] == -DEPTH][:, :2]
        nearest.append(np.linalg.norm(ends.mean(axis=0)))
    assert_allclose(nearest, RADIUS, rtol=0, atol=1e-12)


def test_wedges_fill_the_tile_around_the_opening() -> None:
    volume = sum(ConvexHull(piece).volume for piece in opening.wedges(RADIUS, CHAMFER, DEPTH))
    area_of_polygon = 16 * np.tan(np.pi / 16)  # of the regular polygon around a circle of radius 1
    wide = RADIUS + CHAMFER
    cone = area_of_polygon * CHAMFER / 3 * (RADIUS**2 + RADIUS * wide + wide**2)
    hole = area_of_polygon * RADIUS**2 * (DEPTH - CHAMFER) + cone
    # The chamfer is not quite convex from inside: a wedge's hull covers a sliver of it.
    assert_allclose(volume, (2 * opening.TILE_HALF) ** 2 * DEPTH - hole, rtol=2e-3, atol=0)


def test_a_held_cylinder_disappears_in_a_compartment() -> None:
    assert 2 * tool_box.CYLINDER_HALF_HEIGHT < tool_box.COMPARTMENT_DEPTH
    assert tool_box.CYLINDER_RADIUS < tool_box.OPENING_RADIUS


def test_cover_faces_outwards_and_lining_faces_the_axis() -> None:
    centres = np.array([(item.x, item.y) for item in tool_box.OPENINGS]) - np.array(tool_box.CENTRE)[:2]
    vertices, triangles = opening.cover(tool_box.HALF_SIZE, centres, RADIUS, CHAMFER)
    normals, middles = _normals(vertices, triangles)
    nonzero = np.linalg.norm(normals, axis=1) > 1e-12
    assert (np.einsum("ij,ij->i", normals, middles)[nonzero] > 0).all()

    vertices, triangles = opening.lining(RADIUS, CHAMFER, DEPTH)
    normals, middles = _normals(vertices, triangles)
    inwards = -middles * (1, 1, 0) + (0, 0, 1e-3)
    assert (np.einsum("ij,ij->i", normals, inwards) > 0).all()


@pytest.mark.parametrize("item", tool_box.OPENINGS, ids=lambda item: item.name)
def test_openings_lie_inside_the_box(item: tool_box.Opening) -> None:
    wide = opening.TILE_HALF
    assert tool_box.X_RANGE[0] < item.x - wide
    assert item.x + wide < tool_box.X_RANGE[1]
    assert tool_box.Y_RANGE[0] < item.y - wide
    assert item.y + wide < tool_box.Y_RANGE[1]


def _normals(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a), (a + b + c) / 3
