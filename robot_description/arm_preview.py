"""Pictures of the servo arms: the scene's camera, the gripper open above an object, and the zero pose."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

os.environ.setdefault("MUJOCO_GL", "egl")

import cv2
import mujoco
import numpy as np

from paramove.robots.description import RobotDescription


def write(folder: Path, thing: str, height: float) -> None:
    """Draw preview.png and zero_pose.png of the arm in `folder`.

    In the first the end effector is `height` m above the middle of an object; the second shows how it is held to
    calibrate it.
    """
    robot = RobotDescription.load(folder)
    assert robot.chain is not None
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    arm, posture = robot.chain.kinematics, robot.base_pose.copy()
    position = data.body(thing).xpos + np.array([0.0, 0.0, height])
    posture[robot.chain.indices] = arm.joint_angles(position, arm.nearest_pitch(position, np.deg2rad(75)))
    posture[robot.chain.gripper_index] = 0.5 * robot.chain.gripper_open
    _draw(robot, model, data, posture, folder / "preview.png")
    _draw(robot, model, data, np.zeros_like(posture), folder / "zero_pose.png")


def _draw(robot: RobotDescription, model: Any, data: Any, posture: Any, path: Path) -> None:
    for joint, angle in zip(robot.joint_names, posture, strict=True):
        data.joint(joint).qpos[0] = angle
    for i in range(model.neq):  # fingers that a crank drives
        follower, leader = (model.jnt_qposadr[joint[i]] for joint in (model.eq_obj1id, model.eq_obj2id))
        data.qpos[follower] = np.polyval(model.eq_data[i, 4::-1], data.qpos[leader])
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, 720, 960) as renderer:
        renderer.update_scene(data, "front")
        cv2.imwrite(str(path), np.ascontiguousarray(renderer.render()[:, :, ::-1]))
