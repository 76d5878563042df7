"""A table without physics, for the instructor: what is held moves with the hand, what is let go falls straight down."""

from __future__ import annotations

import numpy as np

from paramove.documents.array_types import Floats
from sim import places, tool_box


class FakeTable:
    """Keeps the rules of `sim.instructor.Table`. A fallen cylinder is put in place with `positions[name] = …`."""

    def __init__(self) -> None:
        self.held_by_instructor: str | None = None
        self.shapes = tool_box.NOMINAL.shapes(2 * tool_box.CYLINDER_RADIUS)
        self.positions = dict(zip(tool_box.COLOURS, (place.copy() for place in places.PARKED), strict=True))
        self.gripper_position = np.array((0.155, -0.03, -0.06))
        self.fingertip = np.zeros(3)
        self.up = False
        self.box_offset = np.zeros(3)
        self.highest_while_box_moved = -np.inf
        self.grasps: list[str] = []
        self._offset = np.zeros(3)

    def position(self, name: str) -> Floats:
        return self.positions[name].copy()

    def gripper(self) -> tuple[Floats, Floats]:
        return self.gripper_position.copy(), np.eye(3)

    def openings_up(self) -> bool:
        return self.up

    def move_hand(self, fingertip: Floats, backward: Floats) -> None:
        assert np.linalg.norm(backward) > 0
        self.fingertip = np.array(fingertip)
        if self.held_by_instructor is not None:
            self.positions[self.held_by_instructor] = self.fingertip + self._offset

    def move_box(self, offset: Floats, quaternion: tuple[float, ...] | Floats) -> None:
        self.box_offset = np.array(offset)
        self.up = abs(quaternion[0]) > 0.5
        over_box = [centre for centre in self.positions.values() if self._support(centre) > tool_box.TABLE_Z + 0.03]
        assert not over_box, "the box is moved with cylinders on it"

    def grasp(self, name: str) -> None:
        assert self.held_by_instructor is None
        assert np.linalg.norm(self.fingertip - self.positions[name]) < 0.04, f"{name} is out of reach of the hand"
        self.held_by_instructor = name
        self.grasps.append(name)
        self._offset = self.positions[name] - self.fingertip

    def straighten(self, fraction: float) -> None:
        if fraction >= 1:
            self._offset = np.array((0.0, 0.0, -tool_box.CYLINDER_HALF_HEIGHT))

    def release(self) -> None:
        if self.held_by_instructor is not None:
            centre = self.positions[self.held_by_instructor]
            centre[2] = self._support(centre) + tool_box.CYLINDER_HALF_HEIGHT
        self.held_by_instructor = None

    def _support(self, centre: Floats) -> float:
        """Height of what is below a cylinder that falls from `centre`."""
        in_box = all(
            low <= value <= high
            for value, (low, high) in zip(centre[:2], (tool_box.X_RANGE, tool_box.Y_RANGE), strict=True)
        )
        if not in_box:
            return tool_box.TABLE_Z
        free = tool_box.OPENING_RADIUS - tool_box.CYLINDER_RADIUS
        if self.up and any(np.hypot(centre[0] - item.x, centre[1] - item.y) < free for item in tool_box.OPENINGS):
            return tool_box.SURFACE_Z - tool_box.COMPARTMENT_DEPTH
        return tool_box.SURFACE_Z
