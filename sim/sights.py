"""What the instructor sees of the table: the truth, as a person would put it."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from paramove.documents import Floats
from sim import places, tool_box
from sim.tool_box import Opening, Shape

POINTING = np.array((0.84, -0.38, 0.38))  # backward direction of the pointing hand: its owner sits at the far side


class Table(Protocol):
    """What the instructor sees and moves; `sim.world.World` is one. Right shoulder's frame."""

    held_by_instructor: str | None
    shapes: dict[str, Shape]

    def position(self, name: str) -> Floats: ...
    def gripper(self) -> tuple[Floats, Floats]: ...
    def openings_up(self) -> bool: ...
    def move_hand(self, fingertip: Floats, backward: Floats) -> None: ...
    def move_box(self, offset: Floats, quaternion: tuple[float, ...] | Floats) -> None: ...
    def grasp(self, name: str) -> None: ...
    def straighten(self, fraction: float) -> None: ...
    def release(self) -> None: ...


class Sights:
    """A person's view of a table.

    Args:
        table: What is looked at.
        openings: Colour -> the opening where it belongs.
    """

    def __init__(self, table: Table, openings: dict[str, Opening]) -> None:
        self._table = table
        self._opening = openings

    def stands(self, name: str) -> bool:
        """Whether the cylinder is on the working plane (standing or lying), not in a compartment and not parked."""
        centre = self._table.position(name)
        over_box = all(
            low <= value <= high
            for value, (low, high) in zip(centre, (tool_box.X_RANGE, tool_box.Y_RANGE), strict=False)
        )
        return over_box and centre[2] > tool_box.SURFACE_Z + 0.5 * self._table.shapes[name].half_width

    def in_compartment(self, name: str) -> bool:
        """Whether the cylinder is in any opening."""
        centre = self._table.position(name)
        return centre[2] < tool_box.SURFACE_Z and any(
            np.hypot(centre[0] - item.x, centre[1] - item.y) < tool_box.OPENING_RADIUS for item in tool_box.OPENINGS
        )

    def is_parked(self, name: str) -> bool:
        """Whether the cylinder is at its place out of sight."""
        place = places.PARKED[tool_box.COLOURS.index(name)]
        return bool(np.linalg.norm(self._table.position(name) - place) < 0.02)

    def is_done(self, name: str) -> bool:
        """Whether the cylinder is in its own opening, wholly below the working plane."""
        centre, opening = self._table.position(name), self._opening[name]
        near = np.hypot(centre[0] - opening.x, centre[1] - opening.y) < tool_box.OPENING_RADIUS
        return bool(near and centre[2] + self._table.shapes[name].half_height < tool_box.SURFACE_Z)

    def top_of(self, name: str) -> Floats:
        """Fingertip on top of a cylinder, standing or lying."""
        centre, shape = self._table.position(name), self._table.shapes[name]
        on_plane = abs(centre[2] - tool_box.SURFACE_Z - shape.half_height) < 0.004
        standing = on_plane or self.is_parked(name) or self.in_compartment(name)
        over = shape.half_height if standing else shape.half_width
        return np.asarray(centre + np.array((0.0, 0.0, over)))

    def pointing_pose(self, name: str, draw: np.random.Generator) -> tuple[Floats, Floats]:
        """Fingertip next to the upper third of a cylinder, on the camera's side, as far as possible from the others."""
        centre, shape = self._table.position(name), self._table.shapes[name]
        distance = shape.half_width + 0.0075 + draw.uniform(0.008, 0.012)
        others = [self._table.position(other)[:2] for other in tool_box.COLOURS if other != name]
        best, best_gap = np.zeros(3), -1.0
        for azimuth in np.deg2rad(np.arange(-50.0, -27.0, 4.0)):
            ahead = np.array((np.cos(azimuth), np.sin(azimuth), 0.0))
            gap = min(float(np.linalg.norm((centre + distance * ahead)[:2] - other)) for other in others)
            if gap > best_gap:
                best, best_gap = ahead, gap
        fingertip = centre + distance * best
        fingertip[2] = tool_box.SURFACE_Z + 2 * shape.half_height * draw.uniform(0.66, 0.80)
        return fingertip, POINTING
