"""The points of a servo arm, compared with its kinematics and its model."""

import mujoco
import numpy as np
import pytest

from paramove.robots.description import RobotDescription
from paramove.robots.pose_points import CLOSED_M, OPEN_M, POINT_NAMES, arm_points
from tests.robots.dynamixel.koch_arm import KOCH

ARMS = [KOCH, KOCH.parent / "open_manipulator_x"]


@pytest.fixture(params=ARMS, ids=lambda path: path.name)
def robot(request):
    return RobotDescription.load(request.param)


def poses(robot):
    """Some within the limits, [N, J]."""
    rng = np.random.default_rng(3)
    return rng.uniform(robot.soft_lower, robot.soft_upper, (20, robot.n_joints))


def named(robot, angles):
    points = arm_points(robot.chain, angles[..., robot.chain.indices], angles[..., robot.chain.gripper_index])
    return dict(zip(POINT_NAMES, np.moveaxis(points, -2, 0), strict=True))


def test_the_middle_of_the_fingers_is_the_end_effector(robot):
    angles = poses(robot)
    found = named(robot, angles)
    end = robot.chain.kinematics.forward(angles[:, robot.chain.indices]).position
    middle = np.mean([found[name] for name in ("knuckle", "index", "thumb")], axis=0)
    np.testing.assert_allclose(middle, end, rtol=0.0, atol=1e-12)


def test_the_fixed_finger_is_that_of_the_model():
    model = mujoco.MjModel.from_xml_path(str(KOCH / "koch_v1_1.xml"))
    finger, site = model.geom("static_finger"), model.site("end_effector")
    face = finger.pos[1] + finger.size[1] - site.pos[1]
    np.testing.assert_allclose(RobotDescription.load(KOCH).chain.fixed_finger, face, rtol=0.0, atol=1e-12)


def test_elbow_and_wrist_are_on_the_axes_of_the_model(robot):
    """A point on a joint's axis: the line through the joint's anchor along its axis."""
    model = mujoco.MjModel.from_xml_path(str(robot.model_path))
    data = mujoco.MjData(model)
    base = model.site(robot.chain.sites.base)
    for angles in poses(robot)[:5]:
        for name, angle in zip(robot.joint_names, angles, strict=True):
            data.qpos[model.joint(name).qposadr[0]] = angle
        mujoco.mj_forward(model, data)
        found = named(robot, angles)
        rotation = data.site(base.id).xmat.reshape(3, 3)
        for point, joint in (("elbow", robot.chain.joints[2]), ("wrist", robot.chain.joints[3])):
            place = data.site(base.id).xpos + rotation @ found[point]
            number = model.joint(joint).id
            beside = np.cross(place - data.xanchor[number], data.xaxis[number])
            assert np.linalg.norm(beside) < 1e-3, point


def test_the_fingers_are_as_far_apart_as_the_gripper_is_open(robot):
    angles = np.repeat(poses(robot)[:1], 2, axis=0)
    angles[:, robot.chain.gripper_index] = robot.chain.gripper_closed, robot.chain.gripper_open
    found = named(robot, angles)
    apart = np.linalg.norm(found["thumb"] - found["index"], axis=1)
    np.testing.assert_allclose(apart, [CLOSED_M, OPEN_M], rtol=0.0, atol=1e-12)
    ahead = found["index"] + found["thumb"] - 2.0 * found["knuckle"]
    np.testing.assert_allclose(np.sum(ahead * (found["thumb"] - found["index"]), axis=1), 0.0, rtol=0.0, atol=1e-12)
