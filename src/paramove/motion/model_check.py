"""Whether the lengths, joints and sites of a robot's description are those of its model."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np

from paramove.documents import Floats, Ints, nearest
from paramove.motion.gripper_arm import GripperArm
from paramove.robots import DescriptionError, RobotDescription

TOLERANCE_M = 0.001
RANGE_TOLERANCE = np.deg2rad(1.0)
N_POSES = 20


def check_model(robot: RobotDescription) -> None:
    """Compares the description of each arm with the robot's model, in poses all over its range.

    Raises:
        DescriptionError: MuJoCo rejects the model, or the model lacks a joint or a site, has a smaller range of a
            joint, or another position of the end effector: wrong lengths would send a real arm elsewhere, and nothing
            on it would notice.
    """
    try:
        model = mujoco.MjModel.from_xml_path(str(robot.model_path))
    except ValueError as error:
        raise DescriptionError(f"{robot.model_path} does not fit the robot's description: {error}") from error
    for side in robot.arms or [""]:
        _check_arm(robot, GripperArm.of(robot, side), model)


def _check_arm(robot: RobotDescription, arm: GripperArm, model: mujoco.MjModel) -> None:
    for kind, names, known in (
        ("joint", robot.joint_names, [model.joint(i).name for i in range(model.njnt)]),
        ("site", (arm.base_site, arm.tip_site), [model.site(i).name for i in range(model.nsite)]),
    ):
        for name in names:
            if name not in known:
                raise DescriptionError(
                    f"{robot.model_path} has no {kind} {name!r}, which robot.yaml names; {nearest(name, known)}"
                )
    indices = robot.indices(arm.joints)
    _check_ranges(robot, indices, model)
    data = mujoco.MjData(model)
    data.qpos[qpos_addresses(model, robot.joint_names)] = robot.base_pose
    qpos = qpos_addresses(model, arm.joints)
    draw = np.random.default_rng(0)
    for angles in draw.uniform(robot.lower[indices], robot.upper[indices], size=(N_POSES, len(indices))):
        data.qpos[qpos] = angles
        mujoco.mj_kinematics(model, data)
        base, tip = data.site(arm.base_site), data.site(arm.tip_site)
        in_model = base.xmat.reshape(3, 3).T @ (tip.xpos - base.xpos)
        described = arm.position(angles)
        if np.linalg.norm(in_model - described) > TOLERANCE_M:
            raise DescriptionError(
                f"by the lengths in robot.yaml the end effector is at {_whole(1000 * described)} mm from "
                f"{arm.base_site} with the joints at {_whole(np.rad2deg(angles[:-1]))} deg, in {robot.model_path.name} "
                f"{arm.tip_site} is at {_whole(1000 * in_model)} mm: make them agree"
            )


def qpos_addresses(model: mujoco.MjModel, joints: Iterable[str]) -> list[int]:
    """Where the positions of these joints stand in `qpos`."""
    return [int(model.joint(name).qposadr[0]) for name in joints]


def _check_ranges(robot: RobotDescription, indices: Ints, model: mujoco.MjModel) -> None:
    for index in indices:
        joint = model.joint(robot.joint_names[index])
        low, high = joint.range
        lower, upper = robot.lower[index], robot.upper[index]
        if model.jnt_limited[joint.id] and (lower < low - RANGE_TOLERANCE or upper > high + RANGE_TOLERANCE):
            found, allowed = (np.rad2deg(ends).round(1).tolist() for ends in ((lower, upper), (low, high)))
            raise DescriptionError(
                f"joint {robot.joint_names[index]}: robot.yaml allows {found[0]} to {found[1]} deg, "
                f"{robot.model_path.name} has {allowed[0]} to {allowed[1]} deg"
            )


def _whole(values: Floats) -> str:
    return f"({', '.join(f'{value:.0f}' for value in values)})"
