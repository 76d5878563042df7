"""The servo arms' files agree, their limits are the servos', and a grasp in the model is held by friction."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest

from paramove.robots.description import RobotDescription
from paramove.robots.dynamixel.bus.servo_models import BAUD_RATES, PULSES_PER_TURN, model_named
from tests.robots.servo_arms import ARMS, KOCH, OPEN_MANIPULATOR_X, ArmModel

STALL_TORQUE = {"xm430_w350": 4.1, "xl430_w250": 1.4, "xl330_m288": 0.52}
"""N m at the recommended voltage, 12, 11.1 and 5 V; ROBOTIS e-Manual."""

each_arm = pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.name)


@each_arm
def test_joints_ranges_and_torques_of_the_model_are_those_of_robot_yaml(robot: RobotDescription) -> None:
    model = ArmModel(robot).model
    assert model.nu == robot.n_joints
    for place, name in enumerate(robot.joint_names):
        np.testing.assert_allclose(model.joint(name).range, [robot.lower[place], robot.upper[place]], rtol=0, atol=1e-8)
        torque = robot.torque_peak[place]
        assert model.actuator(place).name == name
        assert model.actuator_trnid[place, 0] == model.joint(name).id
        for limits in (model.actuator_ctrlrange[place], model.jnt_actfrcrange[model.joint(name).id]):
            np.testing.assert_allclose(limits, [-torque, torque], rtol=1e-9, atol=0)


@each_arm
def test_the_actuators_are_plain_motors(robot: RobotDescription) -> None:
    model = ArmModel(robot).model
    assert (model.actuator_gaintype == mujoco.mjtGain.mjGAIN_FIXED).all()
    assert (model.actuator_biastype == mujoco.mjtBias.mjBIAS_NONE).all()
    np.testing.assert_array_equal(model.actuator_gainprm[:, 0], 1.0)


@each_arm
def test_no_limit_is_above_what_the_servo_can_do(robot: RobotDescription) -> None:
    for place, motor in enumerate(robot.motors):
        top_speed = model_named(motor).top_speed * 2 * np.pi / 60
        assert robot.operating_velocity[place] < robot.velocity[place] <= top_speed * (1 + 1e-9)
        assert robot.torque_average[place] < robot.torque_peak[place] <= STALL_TORQUE[motor]
        assert robot.operating_acceleration[place] < robot.stop_acceleration[place]


@each_arm
def test_the_stretched_arm_stops_with_the_torque_that_it_has(robot: RobotDescription) -> None:
    """Gravity and the stop of a joint at its full deceleration together, with 50 g in the gripper."""
    model = ArmModel(robot)
    assert robot.chain is not None
    kinematics = robot.chain.kinematics
    stretched = robot.base_pose.copy()
    elbow = np.arctan2(kinematics.forearm[1], kinematics.forearm[0]) - np.arctan2(*kinematics.upper_arm[::-1])
    first = np.arctan2(kinematics.upper_arm[1], kinematics.upper_arm[0])
    stretched[robot.chain.indices[1:4]] = first, elbow, -first - elbow
    model.place(np.clip(stretched, robot.lower, robot.upper))
    load = np.zeros(model.model.nv)
    site = model.data.site("end_effector")
    body = model.model.site_bodyid[site.id]
    mujoco.mj_applyFT(model.model, model.data, np.array([0, 0, -0.05 * 9.81]), np.zeros(3), site.xpos, body, load)
    inertia = np.zeros((model.model.nv, model.model.nv))
    mujoco.mj_fullM(model.model, model.data, inertia)
    for place in robot.chain.indices:
        dof = model.dofs[place]
        gravity = abs(model.data.qfrc_bias[dof] - load[dof])
        carried = 0.05 * np.sum((site.xpos - model.data.xanchor[model.model.dof_jntid[dof]]) ** 2)
        needed = gravity + (inertia[dof, dof] + carried) * robot.stop_acceleration[place]
        assert needed < 0.75 * robot.torque_peak[place], robot.joint_names[place]


@each_arm
def test_counts_are_those_of_a_servo(robot: RobotDescription) -> None:
    np.testing.assert_allclose(np.abs(robot.units.counts_per_rad), PULSES_PER_TURN / (2 * np.pi), rtol=1e-12, atol=0)
    np.testing.assert_array_equal(robot.units.to_counts(np.zeros(robot.n_joints)), PULSES_PER_TURN // 2)
    low, high = robot.units.counts_range()
    assert (low >= 0).all()
    assert (high < PULSES_PER_TURN).all()
    assert robot.bus is not None
    assert robot.bus.baud_rate in BAUD_RATES


@each_arm
def test_the_urdf_puts_every_link_where_the_model_does(robot: RobotDescription) -> None:
    ours = ArmModel(robot)
    urdf = mujoco.MjModel.from_xml_path(str(robot.model_path.with_suffix(".urdf")))
    data, rng = mujoco.MjData(urdf), np.random.default_rng(5)
    for _ in range(200):
        ours.place(rng.uniform(robot.lower, robot.upper))
        for joint in range(urdf.njnt):
            data.qpos[joint] = ours.data.joint(urdf.joint(joint).name).qpos[0]
        mujoco.mj_kinematics(urdf, data)
        for body in range(1, urdf.nbody):
            there = ours.data.body(urdf.body(body).name)
            np.testing.assert_allclose(data.xpos[body], there.xpos, rtol=0, atol=1e-9)
            np.testing.assert_allclose(data.xmat[body], there.xmat, rtol=0, atol=1e-9)


@each_arm
def test_joints_limits_and_inertias_of_the_urdf_are_those_of_the_model(robot: RobotDescription) -> None:
    ours = ArmModel(robot).model
    path = robot.model_path.with_suffix(".urdf")
    urdf, root = mujoco.MjModel.from_xml_path(str(path)), ET.parse(path).getroot()
    assert {urdf.joint(i).name for i in range(urdf.njnt)} == {ours.joint(i).name for i in range(ours.njnt)}
    for i in range(urdf.njnt):
        np.testing.assert_allclose(urdf.jnt_range[i], ours.joint(urdf.joint(i).name).range, rtol=0, atol=1e-8)
    for i in range(1, urdf.nbody):  # the base stands still: MuJoCo leaves it out
        body = ours.body(urdf.body(i).name)
        np.testing.assert_allclose(urdf.body_mass[i], body.mass[0], rtol=1e-8, atol=0)
        np.testing.assert_allclose(urdf.body_ipos[i], body.ipos, rtol=0, atol=1e-9)
        np.testing.assert_allclose(inertia(urdf, i), inertia(ours, body.id), rtol=1e-6, atol=1e-12)
    assert float(root.find("link/inertial/mass").get("value")) == ours.body_mass[1]
    for name, effort, velocity in zip(robot.joint_names, robot.torque_peak, robot.velocity, strict=True):
        limit = root.find(f"joint[@name='{name}']/limit")
        np.testing.assert_allclose(
            [float(limit.get(one)) for one in ("effort", "velocity")], [effort, velocity], rtol=1e-5, atol=0
        )
    for i in range(ours.neq):
        mimic = root.find(f"joint[@name='{ours.joint(ours.eq_obj1id[i]).name}']/mimic")
        assert mimic.get("joint") == ours.joint(ours.eq_obj2id[i]).name
        found = [float(mimic.get(one)) for one in ("offset", "multiplier")]
        np.testing.assert_allclose(found, ours.eq_data[i, :2], rtol=1e-9, atol=0)


def inertia(model: mujoco.MjModel, body: int) -> np.ndarray:
    """About the centre of mass, in the body's frame, kg m^2."""
    turned = np.zeros(9)
    mujoco.mju_quat2Mat(turned, model.body_iquat[body])
    axes = turned.reshape(3, 3)
    return axes @ np.diag(model.body_inertia[body]) @ axes.T


@each_arm
def test_sites_of_the_model_are_frames_of_the_urdf(robot: RobotDescription) -> None:
    ours = ArmModel(robot).model
    root = ET.parse(robot.model_path.with_suffix(".urdf")).getroot()
    assert ours.nsite > 0
    for i in range(ours.nsite):
        fixed = root.find(f"joint[@name='{ours.site(i).name}_fixed']")
        assert fixed.find("parent").get("link") == ours.body(ours.site_bodyid[i]).name
        assert fixed.find("child").get("link") == f"{ours.site(i).name}_frame"
        place = [float(word) for word in fixed.find("origin").get("xyz").split()]
        np.testing.assert_allclose(place, ours.site_pos[i], rtol=0, atol=1e-9)


@each_arm
@pytest.mark.parametrize("file", [None, "scene.xml"])
def test_the_home_key_is_the_base_pose(robot: RobotDescription, file: str | None) -> None:
    here = ArmModel(robot, file)
    here.place(robot.base_pose)
    np.testing.assert_allclose(here.model.key("home").qpos, here.data.qpos, rtol=0, atol=1e-6)


def test_servos_and_ids() -> None:
    assert OPEN_MANIPULATOR_X.servo_ids == (11, 12, 13, 14, 15)
    assert set(OPEN_MANIPULATOR_X.motors) == {"xm430_w350"}
    assert KOCH.servo_ids == (1, 2, 3, 4, 5, 6)
    assert KOCH.motors == ("xl430_w250", "xl430_w250", *["xl330_m288"] * 4)


@each_arm
def test_links_of_the_closed_form_are_the_sites_of_the_model(robot: RobotDescription) -> None:
    model = ArmModel(robot)
    model.place(np.zeros(robot.n_joints))
    assert robot.chain is not None
    arm, data = robot.chain.kinematics, model.data
    np.testing.assert_allclose(data.site(robot.chain.sites.base).xpos, 0.0, rtol=0, atol=1e-12)
    yaw, shoulder = (data.xanchor[model.model.joint(name).id] for name in robot.chain.joints[:2])
    np.testing.assert_allclose(yaw[:2], arm.yaw_axis, rtol=0, atol=1e-9)
    np.testing.assert_allclose(shoulder, [*(yaw[:2] + arm.shoulder[:2]), arm.shoulder[2]], rtol=0, atol=1e-9)
    elbow, wrist, end = (data.site(name).xpos for name in ("elbow", "wrist", robot.chain.sites.end_effector))
    np.testing.assert_allclose((elbow - shoulder)[[0, 2]], arm.upper_arm, rtol=0, atol=1e-9)
    np.testing.assert_allclose((wrist - elbow)[[0, 2]], arm.forearm, rtol=0, atol=1e-9)
    np.testing.assert_allclose(end - wrist, arm.hand, rtol=0, atol=1e-9)


def test_open_manipulator_reaches_as_far_as_the_manual_says() -> None:
    """380 mm from the shoulder; the links' lengths of the manual are 77, 130, 124 and 126 mm."""
    assert OPEN_MANIPULATOR_X.chain is not None
    arm = OPEN_MANIPULATOR_X.chain.kinematics
    lengths = [arm.shoulder[2], np.hypot(*arm.upper_arm), np.hypot(*arm.forearm), np.linalg.norm(arm.hand)]
    np.testing.assert_allclose(lengths, [0.077, 0.130, 0.124, 0.126], rtol=0, atol=6e-4)
    np.testing.assert_allclose(sum(lengths[1:]), 0.380, rtol=0, atol=5e-4)


def finger_gap(model: ArmModel, robot: RobotDescription, angle: float) -> float:
    """Between the fingers' faces, m, for an angle of the gripper's servo."""
    posture = np.zeros(robot.n_joints)
    assert robot.chain is not None
    posture[robot.chain.gripper_index] = angle
    model.place(posture)
    left, right = (model.model.geom(name).id for name in ("left_finger", "right_finger"))
    thickness = model.model.geom_size[[left, right], 1].sum()
    return float(model.data.geom_xpos[left, 1] - model.data.geom_xpos[right, 1] - thickness)


def test_the_servo_of_open_manipulator_drives_both_fingers_as_robotis_says() -> None:
    """-1.52 rad is 19 mm outward, 0.92 rad 10 mm inward (open_manipulator_x_system.ros2_control.xacro)."""
    model = ArmModel(OPEN_MANIPULATOR_X)
    for angle, outward in ((-1.52, 0.019), (0.92, -0.010)):
        finger_gap(model, OPEN_MANIPULATOR_X, angle)
        for finger in ("left_finger", "right_finger"):
            qpos = model.data.qpos[model.model.joint(finger).qposadr[0]]
            np.testing.assert_allclose(qpos, outward, rtol=0, atol=1e-9)
    np.testing.assert_allclose(finger_gap(model, OPEN_MANIPULATOR_X, -1.52), 0.075, rtol=0, atol=1e-6)
    np.testing.assert_allclose(finger_gap(model, OPEN_MANIPULATOR_X, 0.92), 0.017, rtol=0, atol=1e-6)


@each_arm
@pytest.mark.parametrize("pose", ["zero", "base", "closed"])
def test_nothing_touches_at_rest(robot: RobotDescription, pose: str) -> None:
    model = ArmModel(robot)
    assert robot.chain is not None
    angles = np.zeros(robot.n_joints) if pose == "zero" else robot.base_pose.copy()
    if pose == "closed":
        angles[robot.chain.gripper_index] = robot.chain.gripper_closed
    model.place(angles)
    assert model.data.ncon == 0


class TorqueHand:
    """Moves an arm of a scene by torques, as a servo would, from posture to posture."""

    def __init__(self, robot: RobotDescription) -> None:
        assert robot.chain is not None
        self.robot, self.chain, self.model = robot, robot.chain, ArmModel(robot, "scene.xml")
        self.posture = robot.base_pose.copy()
        self.model.place(self.posture)
        model = self.model.model
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, self.model.data, inertia)
        self.stiffness = 900.0 * inertia.diagonal()[self.model.dofs]
        self.limit = robot.torque_peak.copy()
        self.limit[self.chain.gripper_index] *= 0.25

    def move(self, position: np.ndarray, gripper: float, steps: int) -> None:
        """To a position from above."""
        goal = self.posture.copy()
        arm = self.chain.kinematics
        goal[self.chain.indices] = arm.joint_angles(position, arm.nearest_pitch(position, np.pi / 2))
        goal[self.chain.gripper_index] = gripper
        model, data = self.model.model, self.model.data
        for i in range(steps):
            part = min(1.0, 1.4 * i / steps)
            target = self.posture + (goal - self.posture) * part * part * (3 - 2 * part)
            torque = self.stiffness * (target - data.qpos[self.model.qpos] - data.qvel[self.model.dofs] / 15.0)
            torque += data.qfrc_bias[self.model.dofs]
            data.ctrl[:] = np.clip(torque, -self.limit, self.limit)
            mujoco.mj_step(model, data)
        self.posture = goal


@each_arm
@pytest.mark.parametrize("thing", ["red_cube", "green_cube", "blue_cylinder"])
def test_an_object_is_lifted_by_friction_alone(robot: RobotDescription, thing: str) -> None:
    hand = TorqueHand(robot)
    data, body = hand.model.data, hand.model.model.body(thing).id
    begin = data.xpos[body].copy()
    up = np.array([0.0, 0.0, 0.07])
    opened = hand.chain.gripper_open * 0.6
    hand.move(begin + up, opened, 600)
    np.testing.assert_allclose(data.xpos[body], begin, rtol=0, atol=1e-4)
    hand.move(begin, opened, 600)
    hand.move(begin, hand.chain.gripper_closed, 1200)
    deepest = min(
        contact.dist for contact in data.contact[: data.ncon] if body in hand.model.model.geom_bodyid[contact.geom]
    )
    assert deepest > -0.0007
    hand.move(begin + up, hand.chain.gripper_closed, 600)
    lifted = data.xpos[body].copy()
    np.testing.assert_allclose(lifted - begin, up, rtol=0, atol=0.006)
    hand.move(begin + up, hand.chain.gripper_closed, 400)
    np.testing.assert_allclose(data.xpos[body], lifted, rtol=0, atol=0.001)
    hand.move(begin + up, opened, 600)
    assert data.xpos[body, 2] < begin[2] + 0.02
