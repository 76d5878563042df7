"""Where a robot works: the surface before its arm, and the upright objects on it."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from paramove.robots.description import RobotDescription
from paramove.robots.description_file import DescriptionError, SurfacePart

AROUND_SERVO_ARM = SurfacePart(x=(0.0, 0.35), y=(-0.2, 0.2), z=0.0)
"""A servo arm stands on the table on which it works."""


class WorkingSurface(SurfacePart):
    """A surface in the frame of the arm's base, m, and the objects on it, which are upright cylinders."""

    object_radius: float = 0.010
    object_height: float = 0.050


class SurfaceParameters(BaseModel):
    """A working surface as parameters of a node; what is left out is as the robot's description has it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    x: tuple[float, float] | None = None
    y: tuple[float, float] | None = None
    z: float | None = None
    object_radius: float | None = None
    object_height: float | None = None

    def of(self, robot: RobotDescription, side: str) -> WorkingSurface:
        """That of a robot, of a humanoid's arm on this side. Raises DescriptionError if the arm has none."""
        own = AROUND_SERVO_ARM if robot.chain is not None else robot.arm(side).surface
        if own is None:
            raise DescriptionError(f"{robot.model_path.parent}: arm {side!r} has no `surface` on which it could work")
        return WorkingSurface.model_validate(own.model_dump() | self.model_dump(exclude_none=True))
