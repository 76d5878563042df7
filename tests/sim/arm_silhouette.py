"""Masks of an arm, rendered: the reference that projected outlines are compared with."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.diagnosis import Eye
from paramove.observation import ArmSizes
from sim.human import add_arm, camera_frame, place_arm


class ArmSilhouette:
    """Masks of the right arm as a pinhole camera sees it, rendered by MuJoCo: the reference for projected outlines.

    Holds a graphics context: use it in one thread and `close` it.

    Args:
        sizes: Measures of the arm.
        matrix: Camera matrix (3, 3), px, with square pixels and the principal point in the middle of the image.
        width_px, height_px: Of the image.
    """

    def __init__(self, sizes: ArmSizes, matrix: ArrayLike, width_px: int, height_px: int) -> None:
        k = np.asarray(matrix, dtype=np.float64)
        middle = ((width_px - 1) / 2, (height_px - 1) / 2)
        if not np.allclose([k[0, 0], k[0, 2], k[1, 2]], [k[1, 1], *middle], rtol=0.0, atol=1e-6):
            raise ValueError(
                f"the silhouette needs square pixels and the principal point {middle} of {width_px} x {height_px} px, "
                f"found the camera matrix {k.tolist()}"
            )
        spec = mujoco.MjSpec()
        spec.visual.global_.offwidth, spec.visual.global_.offheight = width_px, height_px
        spec.visual.quality.offsamples = 0
        spec.visual.map.znear, spec.visual.map.zfar = 0.02, 10.0
        spec.stat.extent = 1.0
        add_arm(spec, sizes)
        rig = spec.worldbody.add_body(name="rig", mocap=True)
        rig.add_camera(name="camera", fovy=float(np.rad2deg(2 * np.arctan(height_px / 2 / k[1, 1]))))
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._eye = _SegmentEye(self._model, width_px, height_px)

    def mask(self, pose: ArrayLike, camera_from_world: ArrayLike, wrist: ArrayLike | None = None) -> NDArray[np.bool_]:
        """Silhouette of the arm in a pose (9,), m, in a camera with pose (4, 4), optical axes. Shape (H, W)."""
        place_arm(self._model, self._data, pose, wrist)
        position, quaternion = camera_frame(camera_from_world)
        number = self._model.body("rig").mocapid[0]
        self._data.mocap_pos[number], self._data.mocap_quat[number] = position, quaternion
        mujoco.mj_forward(self._model, self._data)
        return np.asarray(self._eye.look(self._data, "camera").any(axis=2))

    def close(self) -> None:
        """Gives the graphics context back."""
        self._eye.close()


class _SegmentEye(Eye):
    """Sees which geom each pixel shows, as colours; black where there is none."""

    def __init__(self, model: mujoco.MjModel, width_px: int, height_px: int) -> None:
        super().__init__(model, width_px, height_px)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = 1
        self._scene.flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = 1
