"""Grids in parameter space: from theta in the user's unit to interpolation coordinates and weights."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats, Ints


@dataclass(frozen=True)
class ParameterGrid:
    """Points of an undistorted P-dimensional cuboid of the local models.

    Attributes:
        origin: theta of coordinates (0, ..., 0), shape (P,).
        edges: row p leads from the origin to the corner with coordinate p = 1; rows at right angles, shape (P, P).
        knots: increasing coordinates of the grid lines per dimension, first 0 and last 1.
    """

    origin: Floats
    edges: Floats
    knots: tuple[Floats, ...]

    def __post_init__(self) -> None:
        products = self.edges @ self.edges.T
        lengths = np.sqrt(np.diagonal(products))
        if not (lengths > 0).all():
            raise ValueError(f"every edge of the grid has a length above 0, found {lengths.tolist()}")
        cosines = products / np.outer(lengths, lengths) - np.eye(len(lengths))
        if np.abs(cosines).max() > 1e-6:
            raise ValueError(
                "the edges of the grid meet at right angles (an undistorted cuboid, thesis 5.2.2); "
                f"found a cosine of {np.abs(cosines).max():.3g} between two of them"
            )
        for number, knots in enumerate(self.knots):
            if len(knots) < 2 or knots[0] != 0.0 or knots[-1] != 1.0 or not (np.diff(knots) > 0).all():
                raise ValueError(f"grid lines of dimension {number} increase from 0 to 1, found {knots.tolist()}")

    @classmethod
    def from_lines(cls, *lines: ArrayLike) -> Self:
        """An axis-parallel grid: for each dimension the increasing values of theta at its grid lines."""
        values = [np.asarray(line, dtype=np.float64) for line in lines]
        for number, line in enumerate(values):
            if line.ndim != 1 or len(line) < 2 or not (np.diff(line) > 0).all():
                raise ValueError(f"dimension {number} needs at least two increasing values, found {line.tolist()}")
        spans = np.array([line[-1] - line[0] for line in values])
        knots = tuple((line - line[0]) / span for line, span in zip(values, spans, strict=True))
        return cls(np.array([line[0] for line in values]), np.diag(spans), knots)

    @classmethod
    def from_corners(cls, corners: ArrayLike, shape: Sequence[int]) -> Self:
        """A cuboid in any orientation, evenly divided: corners (0, 0, ..), (1, 0, ..), (0, 1, ..), ..; (P + 1, P)."""
        points = np.asarray(corners, dtype=np.float64)
        if points.ndim != 2 or points.shape[0] != points.shape[1] + 1 or len(shape) != points.shape[1]:
            raise ValueError(f"a P-dimensional cuboid has P + 1 corners of P values, found {points.shape}")
        return cls(points[0], points[1:] - points[0], tuple(np.linspace(0.0, 1.0, count) for count in shape))

    @classmethod
    def from_theta(cls, theta: Floats) -> Self:
        """The axis-parallel grid made of all different values of each component of theta, shape (K, P)."""
        lines = []
        for number, component in enumerate(theta.T):
            scale = max(float(np.ptp(component)), 1e-12)
            values = np.unique(np.round(component / scale, 6))
            line = [float(component[np.argmin(np.abs(component / scale - value))]) for value in values]
            if len(line) < 2:
                raise ValueError(f"component {number} of theta is {line[0]} for every sequence: nothing to interpolate")
            lines.append(line)
        return cls.from_lines(*lines)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of grid lines per dimension."""
        return tuple(len(knots) for knots in self.knots)

    @property
    def dimension(self) -> int:
        """P."""
        return len(self.knots)

    @property
    def size(self) -> int:
        """Number of grid points."""
        return int(np.prod(self.shape))

    def coordinates(self, theta: ArrayLike) -> Floats:
        """Interpolation coordinates of theta (5.1, corrected to a projection). Shape theta.shape."""
        offset = np.asarray(theta, dtype=np.float64) - self.origin
        result: Floats = offset @ self.edges.T / (self.edges**2).sum(axis=1)
        return result

    def theta(self, coordinates: ArrayLike) -> Floats:
        """Theta of interpolation coordinates (5.5). Shape coordinates.shape."""
        result: Floats = self.origin + np.asarray(coordinates, dtype=np.float64) @ self.edges
        return result

    def points(self) -> Floats:
        """Theta of every grid point, last dimension fastest. Shape (G, P)."""
        mesh = np.meshgrid(*self.knots, indexing="ij")
        return self.theta(np.stack([axis.ravel() for axis in mesh], axis=1))

    def cell(self, coordinates: Floats) -> Ints:
        """The cell of coordinates (..., P), outside that at the border: numbers of its lower grid lines, (..., P)."""
        lines = zip(self.knots, np.moveaxis(coordinates, -1, 0), strict=True)
        found = [np.searchsorted(knots[1:-1], component, side="right") for knots, component in lines]
        return np.stack(found, axis=-1).astype(np.int64)

    def regions(self, margin: float) -> Iterator[tuple[Floats, Floats]]:
        """Middle (P,) and bounds (P, 2) of cells, a single one in halves, and of the parts outside up to a margin."""
        sides = []
        for knots in self.knots:
            inside = knots if len(knots) > 2 else np.array([0.0, 0.5, 1.0])
            lines = np.concatenate([[-margin], inside, [1.0 + margin]])
            sides.append(np.column_stack([lines[:-1], lines[1:]]))
        for region in product(*sides):
            bounds = np.stack(region)
            yield bounds.mean(axis=1), bounds

    def nearest(self, theta: Floats) -> tuple[Ints, Floats]:
        """Index of the nearest grid point of each theta, and the distance as a fraction of the cell. Shapes (K,)."""
        coordinates = self.coordinates(theta)
        multi, distance = [], np.zeros(len(theta))
        for component, knots in zip(coordinates.T, self.knots, strict=True):
            index = np.abs(component[:, None] - knots[None, :]).argmin(axis=1)
            multi.append(index)
            spacing = np.diff(knots).min()
            distance = np.maximum(distance, np.abs(component - knots[index]) / spacing)
        return np.ravel_multi_index(tuple(multi), self.shape).astype(np.int64), distance

    def weights(self, coordinates: Floats, clamped: bool) -> tuple[Ints, Floats]:
        """Grid points around each position and their multilinear weights (3.8)-(3.10). Shapes (M, 2^P).

        Outside the grid the weights extrapolate linearly, or, clamped, are those of the nearest position inside.
        """
        positions = np.clip(coordinates, 0.0, 1.0) if clamped else coordinates
        indices = np.zeros((len(positions), 1), dtype=np.int64)
        weights = np.ones((len(positions), 1))
        for cell, component, knots in zip(self.cell(positions).T, positions.T, self.knots, strict=True):
            fraction = ((component - knots[cell]) / (knots[cell + 1] - knots[cell]))[:, None]
            lower = indices * len(knots) + cell[:, None]
            indices = np.concatenate([lower, lower + 1], axis=1)
            weights = np.concatenate([weights * (1.0 - fraction), weights * fraction], axis=1)
        return indices, weights
