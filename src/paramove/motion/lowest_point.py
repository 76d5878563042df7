"""The lowest point of shapes of a MuJoCo model, exactly for every kind of shape that a link can have."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from paramove.documents import Floats, Ints

_SHAPES = mujoco.mjtGeom


class LowestPoint:
    """Computes how deep shapes reach in a pose. Meshes count as their convex hull, as in MuJoCo's collisions.

    Args:
        model: Has the shapes.
        geoms: Their numbers.
    """

    def __init__(self, model: mujoco.MjModel, geoms: Sequence[int]) -> None:
        self._geoms = np.array(geoms, dtype=np.intp)
        self._kind = model.geom_type[self._geoms]
        self._size = model.geom_size[self._geoms]
        self._ball = model.geom_rbound[self._geoms]
        self._vertices = {
            row: _hull(model, int(model.geom_dataid[geom]))
            for row, geom in enumerate(self._geoms)
            if self._kind[row] == _SHAPES.mjGEOM_MESH
        }

    def height(self, data: mujoco.MjData) -> float:
        """Height of the lowest point in the pose of `data`, world, m."""
        up = data.geom_xmat[self._geoms].reshape(-1, 3, 3)[:, 2]  # the world's upward direction in each shape's axes
        return float((data.geom_xpos[self._geoms, 2] - self._depths(up)).min())

    def _depths(self, up: Floats) -> Floats:
        """Distance of each shape's lowest point below its middle for upward directions [N, 3], m."""
        size = self._size
        along = np.abs(up[:, 2])
        across = np.sqrt(np.maximum(0.0, 1.0 - along**2))
        depth_of = {
            _SHAPES.mjGEOM_BOX: (np.abs(up) * size).sum(axis=1),
            _SHAPES.mjGEOM_CYLINDER: size[:, 1] * along + size[:, 0] * across,
            _SHAPES.mjGEOM_CAPSULE: size[:, 1] * along + size[:, 0],
            _SHAPES.mjGEOM_SPHERE: size[:, 0],
            _SHAPES.mjGEOM_ELLIPSOID: np.linalg.norm(up * size, axis=1),
        }
        depths: Floats = np.array(self._ball, dtype=np.float64)
        for kind, depth in depth_of.items():
            depths = np.where(self._kind == kind, depth, depths)
        for row, vertices in self._vertices.items():
            depths[row] = -float((vertices @ up[row]).min())
        return depths


def _hull(model: mujoco.MjModel, mesh: int) -> Floats:
    """Vertices of a mesh's convex hull, or all if MuJoCo made none, [V, 3], in the axes of its shape, m."""
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    vertices: Floats = np.asarray(model.mesh_vert[first : first + count], dtype=np.float64)
    graph = int(model.mesh_graphadr[mesh])
    if graph < 0:
        return vertices
    n_hull = int(model.mesh_graph[graph])  # then the number of faces, n_hull addresses of edges, n_hull vertices
    on_hull: Ints = np.asarray(model.mesh_graph[graph + 2 + n_hull : graph + 2 + 2 * n_hull], dtype=np.int64)
    return np.asarray(vertices[on_hull])
