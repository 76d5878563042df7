"""Draws preview.png: HOAP-3 in its base pose. Run from the workspace root: python -m robot_description.hoap3.preview"""

from __future__ import annotations

import os
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")

import cv2
import mujoco
import numpy as np

FOLDER = Path(__file__).parent


def render(width_px: int = 960, height_px: int = 960) -> np.ndarray:
    """The scene in the base pose, BGR, uint8 [height, width, 3]."""
    model = mujoco.MjModel.from_xml_path(str(FOLDER / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("base").id)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (-0.02, -0.02, -0.01)
    camera.distance, camera.azimuth, camera.elevation = 0.95, 148, -14
    with mujoco.Renderer(model, height_px, width_px) as renderer:
        renderer.update_scene(data, camera)
        return np.ascontiguousarray(renderer.render()[:, :, ::-1])


if __name__ == "__main__":
    cv2.imwrite(str(FOLDER / "preview.png"), render())
