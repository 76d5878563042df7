"""Writes human.xml and preview.png: the person of default sizes, pointing at the table.

Run from the workspace root: python -m robot_description.human.preview
"""

from __future__ import annotations

from pathlib import Path

import cv2
import mujoco
import numpy as np

from paramove.demonstrations.synthetic import RESTING_SHOULDER
from paramove.observation.arm_body import ArmSizes, fitted_poses
from sim.camera import Eye
from sim.human import PersonLook, add_person, place_arm

FOLDER = Path(__file__).parent
ROUGHLY = np.array([*RESTING_SHOULDER, -0.22, -0.36, 0.17, 0.16, -0.14, 0.07])
POINTING = fitted_poses(ROUGHLY[None], ArmSizes())[0]
"""Shoulder, elbow and fingertip, (9,), m."""
SIZE_PX = (960, 720)


def person() -> mujoco.MjSpec:
    """The person alone, with the right arm pointing."""
    spec = mujoco.MjSpec()
    spec.modelname = "human"
    add_person(spec, ArmSizes(), PersonLook(hand_shape="ellipsoid"), RESTING_SHOULDER)
    model = spec.compile()
    data = mujoco.MjData(model)
    place_arm(model, data, POINTING)
    for name in ("upper_arm", "forearm", "hand"):
        number = model.body(name).mocapid[0]
        spec.body(name).pos, spec.body(name).quat = data.mocap_pos[number], data.mocap_quat[number]
    return spec


def render() -> np.ndarray:
    """The person at a table, BGR, uint8 [720, 960, 3]."""
    spec = mujoco.MjSpec.from_file(str(FOLDER / "human.xml"))
    spec.visual.global_.offwidth, spec.visual.global_.offheight = SIZE_PX
    spec.visual.headlight.ambient = (0.35, 0.35, 0.35)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.85, 0.87, 0.90),
        rgb2=(0.60, 0.62, 0.66),
        width=32,
        height=192,
    )
    table = {"type": mujoco.mjtGeom.mjGEOM_BOX, "rgba": (0.72, 0.62, 0.50, 1.0)}
    spec.worldbody.add_geom(pos=(0.35, 0.0, -0.015), size=(0.35, 0.65, 0.015), **table)
    spec.worldbody.add_light(pos=(1.0, -1.5, 2.0), dir=(-1.0, 1.5, -2.0), diffuse=(0.6, 0.6, 0.6))
    spec.worldbody.add_camera(
        name="camera", pos=(1.35, -1.30, 0.85), xyaxes=(0.64, 0.77, 0.0, -0.26, 0.22, 0.94), fovy=42
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    eye = Eye(model, *SIZE_PX)
    try:
        return np.ascontiguousarray(eye.look(data, "camera")[:, :, ::-1])
    finally:
        eye.close()


if __name__ == "__main__":
    described = person()
    described.compile()
    (FOLDER / "human.xml").write_text(described.to_xml(), encoding="utf-8")
    cv2.imwrite(str(FOLDER / "preview.png"), render())
