"""Measures of the tool box, in the frame of the robot's right shoulder (x forward, y left, z up; m).

The upper face of the box is the working plane. One side is closed, the other has four openings with compartments; the
box turns about the x axis through its centre and is equally high either way up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np

from paramove.documents import Floats
from sim import opening

SURFACE_Z = -0.134  # the working plane
X_RANGE = (0.100, 0.240)
Y_RANGE = (-0.170, 0.130)
THICKNESS = 0.105
FLOOR_THICKNESS = 0.005
COMPARTMENT_DEPTH = THICKNESS - FLOOR_THICKNESS

OPENING_RADIUS = 0.014
CHAMFER = 0.006  # 45 degrees
OPENING_X = 0.135
OPENING_Y = (-0.095, -0.038, 0.019, 0.076)

CYLINDER_RADIUS = 0.010
CYLINDER_HALF_HEIGHT = 0.025
CYLINDER_MASS = 0.020
COLOURS = ("yellow", "green", "blue")

TABLE_Z = SURFACE_Z - THICKNESS

HALF_SIZE = (
    (X_RANGE[1] - X_RANGE[0]) / 2,
    (Y_RANGE[1] - Y_RANGE[0]) / 2,
    THICKNESS / 2,
)
CENTRE = (sum(X_RANGE) / 2, sum(Y_RANGE) / 2, SURFACE_Z - THICKNESS / 2)


T = TypeVar("T")
ShapeKind = Literal["cylinder", "block", "lying"]


@dataclass(frozen=True)
class Shape:
    """Of an object, m."""

    kind: ShapeKind
    half_width: float
    half_height: float


@dataclass(frozen=True)
class Measures:
    """Measures that differ between worlds; no node knows them.

    Attributes:
        camera_elevation_deg: Above the working plane. From above 52 degrees, a cylinder in its compartment can be seen.
        opening_radius: Free radius of every opening, m, above a cylinder's.
        chamfer: Height and width of the openings' chamfer, m.
        object_width: Of the objects, or of each in the order of `COLOURS`, m; None: as it suits the robot's gripper.
        object_height: Of all or each of them, m; less than a compartment is deep.
        object_shape: Of all or each of them. A block has a square foot: it is a cube if it is as high as wide. A
            cylinder that lies, and is put down lying, is as long as its width and as thick as its height.
    """

    camera_elevation_deg: float = 52.0
    opening_radius: float = OPENING_RADIUS
    chamfer: float = CHAMFER
    object_width: float | tuple[float, float, float] | None = None
    object_height: float | tuple[float, float, float] = 2 * CYLINDER_HALF_HEIGHT
    object_shape: ShapeKind | tuple[ShapeKind, ShapeKind, ShapeKind] = "cylinder"

    def __post_init__(self) -> None:
        widest = opening.TILE_HALF
        if not CYLINDER_RADIUS < self.opening_radius < self.opening_radius + self.chamfer < widest:
            raise ValueError(
                f"openings of radius {self.opening_radius} m with a chamfer of {self.chamfer} m: a radius above "
                f"{CYLINDER_RADIUS} m, and with the chamfer below {widest} m, expected"
            )
        if not all(0 < height < COMPARTMENT_DEPTH for height in _of_each(self.object_height)):
            raise ValueError(f"objects of height {self.object_height} m: less than {COMPARTMENT_DEPTH:g} m expected")

    def shapes(self, usual_width: float) -> dict[str, Shape]:
        """Of the objects, by their colours."""
        kinds: tuple[ShapeKind, ShapeKind, ShapeKind] = _of_each(self.object_shape)
        widths = _of_each(usual_width if self.object_width is None else self.object_width)
        each = zip(COLOURS, kinds, widths, _of_each(self.object_height), strict=True)
        return {colour: Shape(kind, width / 2, height / 2) for colour, kind, width, height in each}


def _of_each(value: T | tuple[T, T, T]) -> tuple[T, T, T]:
    return value if isinstance(value, tuple) else (value, value, value)


NOMINAL = Measures()
WIDE = Measures(opening_radius=0.0185)
"""For the objects of a servo arm."""


@dataclass(frozen=True)
class Opening:
    """One opening: name and centre on the working plane, shoulder frame, m."""

    name: str
    x: float
    y: float

    @property
    def centre(self) -> Floats:
        """Centre on the working plane, [3], shoulder frame."""
        return np.array((self.x, self.y, SURFACE_Z))


OPENINGS = tuple(Opening(f"opening_{place}", OPENING_X, y) for place, y in enumerate(OPENING_Y))


def standing_centre(x: float, y: float, half_height: float = CYLINDER_HALF_HEIGHT) -> Floats:
    """Centre of an object that stands on the working plane at (x, y), [3], shoulder frame."""
    return np.array((x, y, SURFACE_Z + half_height))
