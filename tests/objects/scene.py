"""A small tool-box world, rendered with MuJoCo, for tests of vision. World frame: origin under the right shoulder on
the working plane; x forward, y left, z up."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from paramove.diagnosis import graphics_backend
from paramove.documents.array_types import Floats

COLOURS = {"yellow": "0.90 0.78 0.05 1", "green": "0.08 0.60 0.15 1", "blue": "0.08 0.18 0.75 1"}
WORKING_AREA = ((0.12, -0.12), (0.19, -0.12), (0.19, 0.08), (0.12, 0.08))
CYLINDER_RADIUS, CYLINDER_HEIGHT = 0.010, 0.050
HIDDEN = (0.0, 0.0, -2.0)
MARGIN = 60  # px rendered beyond each border, which distortion may pull in


@dataclass(frozen=True)
class Look:
    """What differs between runs: light, camera, lens, noise."""

    brightness: float = 1.0
    camera_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    camera_turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    focal_scale: float = 1.0
    k1: float = 0.0
    noise: float = 2.0
    light_share: float = 0.6
    base: tuple[float, float, float] = field(default=(0.80, 0.10, 0.62))

    @classmethod
    def random(cls, seed: int, distorted: bool = True) -> Look:
        draw = np.random.default_rng(seed)
        offset, turn = draw.uniform(-0.05, 0.05, 3), draw.uniform(-6, 6, 3)
        k1 = float(draw.uniform(-0.1, 0.1))
        return cls(
            brightness=float(draw.uniform(0.5, 1.6)),
            camera_offset=(offset[0], offset[1], offset[2]),
            camera_turn_deg=(turn[0], turn[1], turn[2]),
            focal_scale=float(draw.uniform(0.9, 1.1)),
            k1=k1 if distorted else 0.0,
            noise=float(draw.uniform(2, 6)),
            light_share=float(draw.uniform(0.3, 0.7)),
        )


def _world(opening_radius: float | None) -> str:
    cylinders = "".join(
        f'<body name="{name}" mocap="true" pos="0 0 -2"><geom type="cylinder" size="{CYLINDER_RADIUS} '
        f'{CYLINDER_HEIGHT / 2}" rgba="{rgba}"/></body>'
        for name, rgba in COLOURS.items()
    )
    top = '<geom type="box" pos="0.155 -0.02 -0.04" size="0.11 0.17 0.04" rgba="0.13 0.13 0.14 1" material="matt"/>'
    if opening_radius is not None:
        top = _box_with_opening(opening_radius)
    return f"""<mujoco><visual><global offwidth="{480 + 2 * MARGIN}" offheight="{360 + 2 * MARGIN}"/>
      <headlight ambient="0 0 0" diffuse="0 0 0" specular="0 0 0"/><quality offsamples="4"/><map znear="0.02"/></visual>
      <asset><material name="matt" specular="0.05" shininess="0.1"/></asset>
      <worldbody>
        <light name="a" pos="0.6 0.9 1.6" dir="-0.3 -0.6 -1" directional="true" castshadow="false"/>
        <light name="b" pos="0.7 -1.1 1.5" dir="-0.4 0.7 -1" directional="true" castshadow="false"/>
        <geom type="plane" pos="0 0 -0.08" size="2 2 0.1" rgba="0.72 0.66 0.56 1" material="matt"/>{top}
        {cylinders}
        <body name="hand" mocap="true" pos="0 0 -2">
          <geom type="ellipsoid" size="0.030 0.022 0.014" rgba="0.85 0.10 0.60 1"/>
          <geom type="capsule" fromto="-0.025 0 0 -0.065 0 -0.004" size="0.006" rgba="0.85 0.10 0.60 1"/></body>
        <body name="arm" mocap="true" pos="0 0 -2"><geom type="capsule" fromto="0 0 0 -0.16 0.04 0.08" size="0.022"
          rgba="0.82 0.82 0.84 1"/><geom type="box" size="0.025 0.015 0.02" rgba="0.55 0.56 0.58 1"/></body>
        <camera name="eye" pos="0 0 1"/>
      </worldbody></mujoco>"""


def _box_with_opening(radius: float, x: float = 0.155, y: float = -0.02) -> str:
    """The box, here light, with one round opening at the centre (24 flat sides), 8 cm deep and dark inside."""
    reach = 0.03  # of the sectors around the opening; four boxes make up the rest of the upper face
    half = radius + reach - 0.005
    sides = (
        (x + half + (0.11 - half) / 2, y, (0.11 - half) / 2, 0.17),
        (x - half - (0.11 - half) / 2, y, (0.11 - half) / 2, 0.17),
        (x, y + half + (0.17 - half) / 2, half, (0.17 - half) / 2),
        (x, y - half - (0.17 - half) / 2, half, (0.17 - half) / 2),
    )
    look = 'rgba="0.50 0.50 0.52 1" material="matt"/>'
    outer = "".join(f'<geom type="box" pos="{a} {b} -0.04" size="{c} {d} 0.04" {look}' for a, b, c, d in sides)
    sectors = ""
    for angle in np.arange(24) * 2 * np.pi / 24:
        away = radius + reach
        a, b = x + away * np.cos(angle), y + away * np.sin(angle)
        sectors += (
            f'<geom type="box" pos="{a} {b} -0.04" size="{reach} 0.012 0.04" euler="0 0 {np.rad2deg(angle)}" {look}'
        )
        a, b = x + radius * np.cos(angle), y + radius * np.sin(angle)
        sectors += (
            f'<geom type="box" pos="{a} {b} -0.0405" size="0.0003 0.0035 0.04" euler="0 0 {np.rad2deg(angle)}" '
            'rgba="0.06 0.06 0.06 1" material="matt"/>'
        )
    corner = "".join(
        f'<geom type="box" pos="{x + i * half} {y + j * half} -0.04" size="0.02 0.02 0.04" {look}'
        for i in (-1, 1)
        for j in (-1, 1)
    )
    return outer + sectors + corner


class Scene:
    """Renders the tool box for one look. Positions in world frame, m."""

    def __init__(self, look: Look, seed: int = 0, opening_radius: float | None = None) -> None:
        self.look = look
        self._draw = np.random.default_rng(seed)
        self._model = mujoco.MjModel.from_xml_string(_world(opening_radius))
        self._data = mujoco.MjData(self._model)
        self._open_renderer()
        self.focal_px = 560.0 * look.focal_scale
        self._place_camera()
        self._set_lights()
        self._map = self._distortion_map()

    def close(self) -> None:
        self._context.free()
        self._gl.free()

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def put(self, name: str, position: tuple[float, float, float], yaw: float = 0.0) -> None:
        """Put a body's centre at `position`; a standing cylinder's is 25 mm above the plane."""
        body = self._model.body_mocapid[self._model.body(name).id]
        self._data.mocap_pos[body] = position
        self._data.mocap_quat[body] = (np.cos(yaw / 2), 0, 0, np.sin(yaw / 2))

    def stand(self, name: str, x: float, y: float) -> None:
        self.put(name, (x, y, CYLINDER_HEIGHT / 2))

    def hide(self, name: str) -> None:
        self.put(name, HIDDEN)

    def image(self) -> NDArray[np.uint8]:
        """The image, BGR, [360, 480, 3]."""
        mujoco.mj_forward(self._model, self._data)
        self._gl.make_current()
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, self._data, self._options, None, self._eye, everything, self._scene)
        rgb = np.zeros((360 + 2 * MARGIN, 480 + 2 * MARGIN, 3), np.uint8)
        area = mujoco.MjrRect(0, 0, rgb.shape[1], rgb.shape[0])
        mujoco.mjr_render(area, self._scene, self._context)
        mujoco.mjr_readPixels(rgb, None, area, self._context)
        bgr = cv2.remap(cv2.cvtColor(np.flipud(rgb), cv2.COLOR_RGB2BGR), *self._map, interpolation=cv2.INTER_LINEAR)
        noisy = bgr + self._draw.normal(0.0, self.look.noise, bgr.shape)
        return np.clip(np.round(noisy), 0, 255).astype(np.uint8)

    def project(self, point: Floats) -> Floats:
        """The image point of a world point, px, distorted like the image."""
        in_camera = self._camera_from_world[:3, :3] @ point + self._camera_from_world[:3, 3]
        x, y = in_camera[0] / in_camera[2], in_camera[1] / in_camera[2]
        scale = 1 + self.look.k1 * (x * x + y * y)
        return np.array([self.focal_px * x * scale + 239.5, self.focal_px * y * scale + 179.5])

    def _open_renderer(self) -> None:
        """As `Eye`: mujoco.Renderer depends on MUJOCO_GL at the first import of mujoco in the tests."""
        self._gl = import_module(f"mujoco.{graphics_backend()}").GLContext(480 + 2 * MARGIN, 360 + 2 * MARGIN)
        self._gl.make_current()
        self._scene = mujoco.MjvScene(self._model, maxgeom=100)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        self._options = mujoco.MjvOption()
        self._eye = mujoco.MjvCamera()
        self._eye.type, self._eye.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, self._model.camera("eye").id
        self._context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)

    def _place_camera(self) -> None:
        look = self.look
        position = np.array(look.base) + look.camera_offset
        target = np.array([0.155, -0.02, 0.02])
        forward = (target - look.base) / np.linalg.norm(target - look.base)
        right = np.cross(forward, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        optical = np.stack([right, np.cross(forward, right), forward], axis=1)  # world_from_optical
        turn, _ = cv2.Rodrigues(np.deg2rad(np.array(look.camera_turn_deg)))
        optical = optical @ turn
        camera = self._model.camera("eye").id
        graphics = optical @ np.diag([1.0, -1.0, -1.0])  # OpenGL looks along -z
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, graphics.ravel())
        self._model.cam_pos[camera], self._model.cam_quat[camera] = position, quaternion
        height = 360 + 2 * MARGIN
        self._model.cam_fovy[camera] = np.rad2deg(2 * np.arctan(height / 2 / self.focal_px))
        self._camera_from_world = np.eye(4)
        self._camera_from_world[:3, :3] = optical.T
        self._camera_from_world[:3, 3] = -optical.T @ position

    def _set_lights(self) -> None:
        share = self.look.light_share
        for name, part in (("a", share), ("b", 1 - share)):
            light = self._model.light(name).id
            self._model.light_diffuse[light] = 0.85 * self.look.brightness * part
            self._model.light_ambient[light] = 0.15 * self.look.brightness
            self._model.light_specular[light] = 0.1 * self.look.brightness

    def _distortion_map(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        v, u = np.mgrid[0:360, 0:480].astype(np.float64)
        distorted_x, distorted_y = (u - 239.5) / self.focal_px, (v - 179.5) / self.focal_px
        x, y = distorted_x.copy(), distorted_y.copy()
        for _ in range(20):
            scale = 1 + self.look.k1 * (x * x + y * y)
            x, y = distorted_x / scale, distorted_y / scale
        return (
            (x * self.focal_px + 239.5 + MARGIN).astype(np.float32),
            (y * self.focal_px + 179.5 + MARGIN).astype(np.float32),
        )
