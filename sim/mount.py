"""A robot at the tool box: where it stands, and which of its parts are its hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from paramove.documents import Floats
from paramove.robots import RobotDescription
from sim import tool_box

STAND_HALF = 0.06
"""Of the block that a servo arm stands on, as high as the tool box, m."""
ARM_IN_SHOULDER = np.array((-0.02, -0.0145, tool_box.SURFACE_Z))
"""Base of a servo arm in the frame of the tool box's measures: they are those of HOAP-3's right shoulder."""
OBJECT_WIDTH = 0.028
"""Of the objects of a servo arm, m, if its gripper can hold them, else the nearest that it can."""
HOAP3_SIDES = {
    f"{hand}_{part}": side
    for hand in ("right", "left")
    for side, parts in (("fingers", ("finger_plate", "finger_pads", "palm")), ("thumb", ("thumb_base", "thumb_tip")))
    for part in parts
}


@dataclass(frozen=True)
class Mount:
    """A robot in the world.

    Attributes:
        description: Of the robot.
        origin: Of the frame of the tool box's measures in the world, [3], m; the axes are parallel.
        base: Origin of the frame of the robot's goals in the world, [3], m.
        gripper: Site of the end effector. root: the robot's first body.
        sides: Name of a geom or body -> side of the hand that it is part of; an object is held between two.
        object_width: Of the objects, which its gripper can hold and feel, m.
        table_edge: x of the table's near edge, frame of the tool box's measures, m: a servo arm stands on it.
    """

    description: RobotDescription
    origin: Floats
    base: Floats
    gripper: str
    root: str
    sides: Mapping[str, str]
    object_width: float = 2 * tool_box.CYLINDER_RADIUS
    table_edge: float = tool_box.X_RANGE[0] - 0.005

    @classmethod
    def of(cls, description: RobotDescription, spec: mujoco.MjSpec) -> Mount:
        """As the robot's model has it, which stands at the world's origin."""
        if description.chain is None:
            shoulder = np.array(spec.site("right_shoulder").pos, dtype=np.float64)
            return cls(description, shoulder, shoulder, "right_gripper", "torso", HOAP3_SIDES)
        hand = spec.site(description.chain.sites.end_effector).parent
        bodies = [hand, *(body for body in hand.bodies if body.geoms)]
        sides = {body.name: body.name for body in bodies}
        root = spec.worldbody.first_body().name
        width = float(np.clip(OBJECT_WIDTH, *description.chain.object_width))
        gripper = description.chain.sites.end_effector
        return cls(description, -ARM_IN_SHOULDER, np.zeros(3), gripper, root, sides, width, ARM_IN_SHOULDER[0] - 0.14)

    def add_stand(self, spec: mujoco.MjSpec, look: tuple[float, ...]) -> None:
        """The block under a servo arm; HOAP-3 stands behind the table."""
        if self.description.chain is not None:
            half = 0.5 * tool_box.THICKNESS
            spec.worldbody.add_geom(
                name="stand",
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=(0.0, 0.0, -half),
                size=(STAND_HALF, STAND_HALF, half),
                rgba=look,
            )
