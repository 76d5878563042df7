"""The servo arms of the workspace, and their models."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from paramove.robots.description import RobotDescription

FOLDER = Path(__file__).parents[2] / "robot_description"
OPEN_MANIPULATOR_X = RobotDescription.load(FOLDER / "open_manipulator_x")
KOCH = RobotDescription.load(FOLDER / "koch_v1_1")
ARMS = (OPEN_MANIPULATOR_X, KOCH)


class ArmModel:
    """A robot's model in MuJoCo, with its joints in the order of the description."""

    def __init__(self, robot: RobotDescription, file: str | None = None) -> None:
        path = robot.model_path if file is None else robot.model_path.parent / file
        self.model = mujoco.MjModel.from_xml_path(str(path))
        self.data = mujoco.MjData(self.model)
        self.qpos = [self.model.joint(name).qposadr[0] for name in robot.joint_names]
        self.dofs = [self.model.joint(name).dofadr[0] for name in robot.joint_names]

    def place(self, angles: np.ndarray) -> None:
        """Put the joints there, and those that are coupled to them."""
        self.data.qpos[self.qpos] = angles
        for i in range(self.model.neq):
            follower, leader = (
                self.model.jnt_qposadr[joint[i]] for joint in (self.model.eq_obj1id, self.model.eq_obj2id)
            )
            self.data.qpos[follower] = np.polyval(self.model.eq_data[i, 4::-1], self.data.qpos[leader])
        mujoco.mj_forward(self.model, self.data)
