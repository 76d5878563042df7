"""An arm with a gripper, as planners and synthesizer see it: the same for a humanoid's arm and a servo arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np

from paramove.documents import Floats
from paramove.robots import ARM_BASE, RobotDescription


@dataclass(frozen=True, eq=False)
class GripperArm:
    """Angles are [J + 1], rad: the arm's joints, then the gripper's.

    Attributes:
        joints: Names.
        frame: Of positions: that of the arm's base.
        base_angles: Of the base pose.
        resolution: One unit of each joint's servo, [J + 1], rad.
        opened, closed: Angles of the gripper for ξ = 1 and ξ = 0.
        felt_opening: Commanded to close, the gripper holds something if it stops at a wider opening ξ than this.
        holding_openings: ξ at which it stops on objects.
        base_site, tip_site: Sites of the robot's model at the base, and at the end effector.
        end_effector: Position [..., 3], m, of the end effector for angles [..., J] of the arm's joints.
    """

    joints: tuple[str, ...]
    frame: str
    base_angles: Floats
    resolution: Floats
    opened: float
    closed: float
    felt_opening: float
    holding_openings: tuple[float, float]
    base_site: str
    tip_site: str
    end_effector: Callable[[Floats], Floats]

    @classmethod
    def of(cls, robot: RobotDescription, side: str) -> Self:
        """The chain of a servo arm, or the arm of a humanoid on this side. Raises DescriptionError if there is none."""
        chain = robot.chain
        if chain is not None:
            joints, frame = (*chain.joints, chain.gripper), ARM_BASE
            opened, closed = chain.gripper_open, chain.gripper_closed
            felt, holding = chain.felt_opening, chain.holding_openings
            base_site, tip_site = chain.sites.base, chain.sites.end_effector
            kinematics = chain.kinematics

            def end_effector(angles: Floats) -> Floats:
                return kinematics.forward(angles).position

        else:
            arm = robot.arm(side)
            joints, frame = (*arm.joints, arm.fingers), f"{side}_shoulder"
            opened, closed = arm.fingers_open, arm.fingers_closed
            felt, holding = arm.felt_opening, arm.holding_openings
            base_site, tip_site = arm.sites.shoulder, arm.sites.gripper

            def end_effector(angles: Floats) -> Floats:
                return arm.kinematics.forward(angles).gripper

        indices = robot.indices(joints)
        resolution: Floats = 1.0 / np.abs(robot.units.counts_per_rad[indices])
        base_angles = robot.base_pose[indices]
        return cls(
            joints, frame, base_angles, resolution, opened, closed, felt, holding, base_site, tip_site, end_effector
        )

    def opening_of(self, angle: float) -> float:
        """ξ of an angle of the gripper, clipped to 0 … 1."""
        return float(np.clip((angle - self.closed) / (self.opened - self.closed), 0.0, 1.0))

    def angle_of(self, opening: float) -> float:
        """Angle of the gripper for an opening ξ, rad."""
        return self.closed + opening * (self.opened - self.closed)

    def position(self, angles: Floats) -> Floats:
        """Position of the end effector [..., 3], m, for angles [..., J + 1]."""
        return self.end_effector(angles[..., :-1])
