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
PARALLEL = 0.999
"""Smallest cosine between the axis of a joint and where it should point."""
_FORWARD, _LEFT, _UP = np.eye(3)


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
                f"{arm.tip_site} is at {_whole(1000 * in_model)} mm: {_misfit(robot, model)}"
            )


def _misfit(robot: RobotDescription, model: mujoco.MjModel) -> str:
    """Which joint or length disagrees first from the base on, and the value that would fit."""
    if robot.chain is None:
        return "make its lengths and the model agree"
    chain = robot.chain
    lengths = chain.kinematics
    data = mujoco.MjData(model)
    data.qpos[qpos_addresses(model, robot.joint_names)] = robot.base_pose
    data.qpos[qpos_addresses(model, chain.joints)] = 0.0
    mujoco.mj_kinematics(model, data)
    base = data.site(chain.sites.base)
    axes_of_base = base.xmat.reshape(3, 3).T
    axes = axes_of_base @ np.array([data.joint(name).xaxis for name in chain.joints]).T
    for name, axis, expected in zip(chain.joints, axes.T, (_UP, *3 * (_LEFT,), _FORWARD), strict=False):
        if axis @ expected < PARALLEL:
            return (
                f"in the zero pose {name} turns about {_short(axis)} in the model, about {_short(expected)} expected: "
                "x is forward, y left, z up, and pitch is positive downward"
            )
    points = [data.joint(name).xanchor for name in chain.joints[:4]]
    yaw, *pitches, tip = (
        axes_of_base @ (np.array([*points, data.site(chain.sites.end_effector).xpos]) - base.xpos).T
    ).T
    stretches = np.diff(pitches, axis=0)
    in_model = {
        "yaw_axis": yaw[:2],
        "shoulder": np.array([pitches[0][0] - yaw[0], tip[1] - yaw[1] - lengths.hand[1], pitches[0][2]]),
        "upper_arm": stretches[0][[0, 2]],
        "forearm": stretches[1][[0, 2]],
        "hand": np.array([tip[0] - pitches[2][0], lengths.hand[1], tip[2] - pitches[2][2]]),
    }
    ends = dict(zip(in_model, (*chain.joints[:4], chain.sites.end_effector), strict=True))
    for length, found in in_model.items():
        described = np.array(getattr(lengths, length))
        if np.linalg.norm(found - described) > TOLERANCE_M / len(in_model):
            return (
                f"the first difference is at {ends[length]}: chain.links.{length} is {described.tolist()} m, by the "
                f"model it is {found.round(5).tolist()} m with all joints of the chain at 0"
            )
    return f"the joints from {chain.joints[1]} on agree only at 0: is a joint's axis or zero another one?"


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


def _short(direction: Floats) -> str:
    return f"({', '.join(f'{value:.2g}' for value in direction.round(3) + 0.0)})"


def _whole(values: Floats) -> str:
    return f"({', '.join(f'{value:.0f}' for value in values)})"
