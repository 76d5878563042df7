"""Pictures of MuJoCo models."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

import mujoco
import numpy as np

from paramove.diagnosis.graphics import graphics_backend
from paramove.documents import Image


class GraphicsError(RuntimeError):
    """Nothing can be rendered on this machine as it is; the text names what to install or set."""


class Eye:
    """Renders pictures of a model, RGB [H, W, 3]. Holds a graphics context: use it in one thread and `close` it.

    The context is made here and not by `mujoco.Renderer`, which needs MUJOCO_GL before the first import of mujoco.

    Raises:
        GraphicsError: MuJoCo finds no way to render.

    Attributes:
        options: What of the model is drawn.
    """

    def __init__(self, model: mujoco.MjModel, width_px: int, height_px: int) -> None:
        self._model = model
        self._size = (width_px, height_px)
        backend = graphics_backend()
        try:
            self._gl = import_module(f"mujoco.{backend}").GLContext(width_px, height_px)
            self._gl.make_current()
            self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        except Exception as error:  # the back ends raise whatever their libraries raise
            raise GraphicsError(
                f"MuJoCo cannot render with {backend} ({type(error).__name__}: {error}); set MUJOCO_GL=egl (packages "
                "libegl1 libgl1) or MUJOCO_GL=osmesa (package libosmesa6), or give the simulator the parameters "
                "camera: false, video: false"
            ) from error
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._scene = mujoco.MjvScene(model, maxgeom=500)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = 0
        self.options = mujoco.MjvOption()
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._upside_down = np.empty((height_px, width_px, 3), dtype=np.uint8)
        self._picture = np.empty_like(self._upside_down)

    def look(
        self, data: mujoco.MjData, camera: str, adorn: Callable[[mujoco.MjvScene], None] = lambda _: None
    ) -> Image:
        """The picture of the camera of that name; `adorn` changes what is drawn. The next call uses the array again."""
        self._gl.make_current()
        self._camera.fixedcamid = self._model.camera(camera).id
        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, data, self.options, None, self._camera, every, self._scene)
        adorn(self._scene)
        port = mujoco.MjrRect(0, 0, *self._size)
        mujoco.mjr_render(port, self._scene, self._context)
        mujoco.mjr_readPixels(self._upside_down, None, port, self._context)
        np.copyto(self._picture, self._upside_down[::-1])
        return self._picture

    def close(self) -> None:
        """Gives the graphics context back."""
        self._gl.make_current()
        self._context.free()
        self._gl.free()
