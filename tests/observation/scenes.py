"""Rendered and drawn pictures for the tests."""

import cv2
import mujoco
import numpy as np

from paramove.demonstrations import RESTING_SHOULDER
from paramove.diagnosis import Eye
from paramove.observation import ArmSizes, fitted_poses
from sim.human import PersonLook, add_person, camera_frame, place_arm


def cluttered(mask, seed=0, arm=(170, 140, 120), noise=3.0):
    """A picture of an arm, where `mask` is, before lines and boxes, with the noise of a camera."""
    rng = np.random.default_rng(seed)
    image = np.full((*mask.shape, 3), 110, np.uint8)
    for _ in range(30):
        a, b = rng.integers(0, mask.shape[::-1], (2, 2)).tolist()
        cv2.line(image, a, b, rng.integers(60, 150, 3).tolist(), int(rng.integers(1, 9)))
    image[mask] = arm
    return np.clip(image + rng.normal(0.0, noise, image.shape), 0, 255).astype(np.uint8)


def rendered_person(pose, cameras, sizes=None, look=None):
    """Pictures of a person with the arm in a pose, one for each of the cameras, which share their lens."""
    spec = mujoco.MjSpec()
    camera = cameras[0]
    spec.visual.global_.offwidth, spec.visual.global_.offheight = camera.width_px, camera.height_px
    spec.stat.extent = 1.0
    spec.visual.map.znear = 0.02
    add_person(spec, sizes or ArmSizes(), look or PersonLook(pattern="plain"), RESTING_SHOULDER)
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.35, 0.6, 0.02], pos=[0.35, 0, -0.02], rgba=[0.5, 0.4, 0.3, 1]
    )
    spec.worldbody.add_light(pos=[0.5, 0.5, 2.0], dir=[-0.2, -0.2, -1.0])
    rig = spec.worldbody.add_body(name="rig", mocap=True)
    rig.add_camera(name="camera", fovy=float(np.rad2deg(2 * np.arctan(camera.height_px / 2 / camera.matrix[1, 1]))))
    model = spec.compile()
    data, eye = mujoco.MjData(model), Eye(model, camera.width_px, camera.height_px)
    place_arm(model, data, pose)
    pictures = []
    for camera in cameras:
        number = model.body("rig").mocapid[0]
        data.mocap_pos[number], data.mocap_quat[number] = camera_frame(camera.camera_from_world)
        mujoco.mj_forward(model, data)
        pictures.append(eye.look(data, "camera").copy())
    eye.close()
    return pictures


def displaced(pose, count, spread, seed=0, sizes=None):
    """Valid postures about one, their points shifted by a standard deviation of `spread` m."""
    near = pose + spread * np.random.default_rng(seed).normal(size=(count, 9))
    return fitted_poses(near, sizes or ArmSizes())
