"""HOAP-3's files agree: MJCF, URDF, robot.yaml and the chain of the thesis (5.2.1) and the manual's tables."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from functools import cache

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from paramove.robots.description import RobotDescription
from tests.robots.hoap3.movements import HOAP3, ROBOT_DESCRIPTION

MODEL = mujoco.MjModel.from_xml_path(str(ROBOT_DESCRIPTION / "hoap3.xml"))
DATA = mujoco.MjData(MODEL)
PLACES = [MODEL.joint(name).qposadr[0] for name in HOAP3.joint_names]
URDF = ET.parse(ROBOT_DESCRIPTION / "hoap3.urdf").getroot()
TENTH_OF_A_MM = 1e-4
FRAMES = ("gripper", "fingertip", "elbow", "shoulder", "sole")

# Joint chains from the manual's table 6.1-2 as origins and axes in the zero pose; the right side, in m.
RIGHT_ARM = (
    ((-0.035, -0.111, 0.125), (0, 1, 0), "shoulder_pitch"),
    ((0, 0, 0), (0, 0, 1), "shoulder_roll"),
    ((0.110, 0, 0), (1, 0, 0), "shoulder_torsion"),
    ((0, 0, 0), (0, 1, 0), "elbow"),
    ((0, 0, 0), (1, 0, 0), "wrist"),
)
RIGHT_LEG = (
    ((0, 0, 0), (0, -1, 0), "waist_pitch"),
    ((-0.035, -0.039, -0.055), (0, 0, 1), "hip_yaw"),
    ((0, 0, 0), (1, 0, 0), "hip_roll"),
    ((0, 0, 0), (0, 1, 0), "hip_pitch"),
    ((0, 0, -0.105), (0, 1, 0), "knee"),
    ((0, 0, -0.105), (0, 1, 0), "ankle_pitch"),
    ((0, 0, 0), (1, 0, 0), "ankle_roll"),
)
TIPS = {"gripper": (RIGHT_ARM, (0.133, 0.006, 0)), "fingertip": (RIGHT_ARM, (0.171, -0.0145, 0)),
        "sole": (RIGHT_LEG, (0, 0, -0.040))}  # fmt: skip


def postures(count: int) -> np.ndarray:
    return np.random.default_rng(3).uniform(HOAP3.lower, HOAP3.upper, size=(count, 28))


def chain_position(frame: str, side: str, angles: dict[str, float]) -> np.ndarray:
    """Rotations about fixed axes, the last joint first."""
    chain, tip = TIPS[frame]
    mirror = np.array([1.0, 1.0 if side == "right" else -1.0, 1.0])
    point = np.array(tip) * mirror
    for origin, axis, joint in reversed(chain):
        name = joint if joint == "waist_pitch" else f"{side}_{joint}"
        point = np.array(origin) * mirror + Rotation.from_rotvec(angles[name] * np.array(axis, float)).apply(point)
    return point


@cache
def urdf_parents() -> dict[str, ET.Element]:
    return {joint.find("child").get("link"): joint for joint in URDF.iter("joint")}


def urdf_position(link: str, angles: dict[str, float]) -> np.ndarray:
    point = np.zeros(3)
    while (joint := urdf_parents().get(link)) is not None:
        if joint.get("type") == "revolute":
            axis = np.array(joint.find("axis").get("xyz").split(), float)
            point = Rotation.from_rotvec(angles[joint.get("name")] * axis).apply(point)
        point = point + np.array(joint.find("origin").get("xyz").split(), float)
        link = joint.find("parent").get("link")
    return point


@pytest.fixture(scope="module")
def moved() -> list[tuple[dict[str, float], dict[str, np.ndarray]]]:
    """1000 random postures and where MuJoCo puts the sites."""
    found = []
    for posture in postures(1000):
        DATA.qpos[PLACES] = posture
        mujoco.mj_kinematics(MODEL, DATA)
        sites = {
            f"{side}_{frame}": DATA.site(f"{side}_{frame}").xpos.copy()
            for side in ("right", "left")
            for frame in FRAMES
        }
        found.append((dict(zip(HOAP3.joint_names, posture, strict=True)), sites))
    return found


@pytest.mark.parametrize("side", ["right", "left"])
def test_mjcf_is_the_chain_of_the_manual(moved: list, side: str) -> None:
    for angles, sites in moved:
        for frame in TIPS:
            away = np.abs(sites[f"{side}_{frame}"] - chain_position(frame, side, angles)).max()
            assert away < TENTH_OF_A_MM


@pytest.mark.parametrize("side", ["right", "left"])
def test_urdf_is_the_mjcf(moved: list, side: str) -> None:
    for angles, sites in moved[:300]:
        for frame in FRAMES:
            away = np.abs(sites[f"{side}_{frame}"] - urdf_position(f"{side}_{frame}_frame", angles)).max()
            assert away < TENTH_OF_A_MM


def test_mujoco_reads_the_urdf_alike() -> None:
    model = mujoco.MjModel.from_xml_path(str(ROBOT_DESCRIPTION / "hoap3.urdf"))
    assert {model.joint(i).name for i in range(model.njnt)} == set(HOAP3.joint_names)
    for i in range(model.njnt):
        ours = MODEL.joint(model.joint(i).name)
        np.testing.assert_allclose(model.joint(i).range, ours.range, rtol=0, atol=1e-8)
    for i in range(1, model.nbody):
        name = model.body(i).name
        if not name.endswith("_frame"):
            np.testing.assert_allclose(model.body(i).mass, MODEL.body(name).mass, rtol=1e-6, atol=0)
            np.testing.assert_allclose(model.body(i).inertia, MODEL.body(name).inertia, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("side", ["right", "left"])
def test_closed_form_kinematics_is_the_mjcf(moved: list, side: str) -> None:
    arm = HOAP3.arms[side]
    points = arm.kinematics.forward([[angles[joint] for joint in arm.joints] for angles, _ in moved])
    for frame in ("elbow", "gripper", "fingertip"):
        in_shoulder = [sites[f"{side}_{frame}"] - sites[f"{side}_shoulder"] for _, sites in moved]
        np.testing.assert_allclose(getattr(points, frame), in_shoulder, rtol=0, atol=1e-9)


def test_joint_ranges_torques_and_base_pose_are_those_of_robot_yaml() -> None:
    for place, name in enumerate(HOAP3.joint_names):
        joint = MODEL.joint(name)
        np.testing.assert_allclose(joint.range, [HOAP3.lower[place], HOAP3.upper[place]], rtol=0, atol=1e-8)
        assert MODEL.actuator(place).name == name
        np.testing.assert_allclose(MODEL.actuator_ctrlrange[place, 1], HOAP3.torque_peak[place], rtol=1e-9, atol=0)
    base_pose = RobotDescription.load(ROBOT_DESCRIPTION).base_pose
    np.testing.assert_allclose(MODEL.key("base").qpos[PLACES], base_pose, rtol=0, atol=1e-6)


def test_heights_and_mass_are_those_of_the_manual() -> None:
    mujoco.mj_resetData(MODEL, DATA)
    DATA.qpos[PLACES[HOAP3.index("right_shoulder_pitch")]] = np.pi / 2
    DATA.qpos[PLACES[HOAP3.index("left_shoulder_pitch")]] = np.pi / 2
    mujoco.mj_forward(MODEL, DATA)
    sole = DATA.site("right_sole").xpos[2]
    for body, height in (("right_ankle", 0.040), ("right_shank", 0.145), ("pelvis", 0.305), ("head", 0.533)):
        np.testing.assert_allclose(DATA.body(body).xpos[2] - sole, height, rtol=0, atol=TENTH_OF_A_MM)
    np.testing.assert_allclose(MODEL.body_mass.sum(), 8.802, rtol=0, atol=0.002)
    np.testing.assert_allclose(DATA.subtree_com[0][2] - sole, 0.302, rtol=0, atol=1e-3)


@pytest.mark.parametrize("pose", ["zero", "base"])
def test_nothing_touches_in_the_zero_and_base_pose(pose: str) -> None:
    mujoco.mj_resetData(MODEL, DATA) if pose == "zero" else mujoco.mj_resetDataKeyframe(MODEL, DATA, 0)
    mujoco.mj_forward(MODEL, DATA)
    touching = [
        tuple(MODEL.body(MODEL.geom_bodyid[geom]).name for geom in (contact.geom1, contact.geom2))
        for contact in DATA.contact[: DATA.ncon]
    ]
    assert touching == []


def test_hands_are_mirror_images() -> None:
    right = [i for i in range(MODEL.ngeom) if MODEL.geom(i).name.startswith("right_")]
    assert len(right) >= 5
    for i in right:
        left = MODEL.geom(MODEL.geom(i).name.replace("right_", "left_", 1))
        np.testing.assert_allclose(left.size, MODEL.geom(i).size, rtol=0, atol=1e-9)
        np.testing.assert_allclose(left.pos, MODEL.geom(i).pos * [1, -1, 1], rtol=0, atol=1e-9)
