"""Coloured balls that a person wears at the joints of the right arm, for a body tracker; and a room without such hues.

Each ball is centred at its joint and larger than the arm there, so that every camera sees it around the same point.
"""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.observation import ArmSizes
from sim.human import LOOKS_ONLY

COLOURS = {
    "shoulder": (0.86, 0.82, 0.10),
    "elbow": (0.12, 0.72, 0.16),
    "wrist": (0.10, 0.30, 0.85),
    "index": (0.85, 0.10, 0.72),
}
"""Hues of 58, 124, 224 and 310 degrees."""
LARGER = {"shoulder": 1.1, "elbow": 1.6, "wrist": 1.45}
"""Radius of the ball over that of the arm."""
TIP_RADIUS = 0.021
MAX_SATURATION = 0.2
"""Of everything else in the room; skin keeps a little more."""


def mute(spec: mujoco.MjSpec) -> None:
    """Takes the strong colours out of a room: a marker's colour is nowhere else, as a tracker by colour needs it."""
    for geom in spec.geoms:
        geom.rgba = [*muted(np.array(geom.rgba[:3])), float(geom.rgba[3])]
    for material in spec.materials:
        material.rgba = [*muted(np.array(material.rgba[:3])), float(material.rgba[3])]
    for texture in spec.textures:
        pixels = np.frombuffer(bytes(texture.data), dtype=np.uint8).reshape(-1, 3)
        texture.data = muted(pixels).round().astype(np.uint8).tobytes()


def muted(colours: ArrayLike) -> Floats:
    """RGB (..., 3) with their brightest channel kept and their saturation cut to `MAX_SATURATION`."""
    rgb = np.asarray(colours, dtype=np.float64)
    maximum = rgb.max(axis=-1, keepdims=True)
    saturation = (maximum - rgb.min(axis=-1, keepdims=True)) / np.maximum(maximum, 1e-9)
    fraction = np.minimum(1.0, MAX_SATURATION / np.maximum(saturation, 1e-9))
    return np.asarray(maximum + fraction * (rgb - maximum))


def add_markers(spec: mujoco.MjSpec, sizes: ArmSizes, names: Iterable[str]) -> None:
    """Adds a ball for each of these points of the arm; `place_markers` moves them."""
    radii = {name: factor * getattr(sizes, f"{name}_radius") for name, factor in LARGER.items()} | {"index": TIP_RADIUS}
    for name in names:
        spec.add_material(name=f"marker_{name}", specular=0.0, shininess=0.0, rgba=(*COLOURS[name], 1.0))
        body = spec.worldbody.add_body(name=f"marker_{name}", mocap=True)
        body.add_geom(
            name=f"marker_{name}", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(radii[name], 0.0, 0.0),
            material=f"marker_{name}", **LOOKS_ONLY,
        )  # fmt: skip


def place_markers(model: mujoco.MjModel, data: mujoco.MjData, pose: Floats, wrist: Floats) -> None:
    """Puts the balls where the joints of a pose (9,) and the wrist (3,) are, m."""
    shoulder, elbow, tip = pose.reshape(3, 3)
    for name, place in {"shoulder": shoulder, "elbow": elbow, "wrist": wrist, "index": tip}.items():
        number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, f"marker_{name}")
        if number >= 0:
            data.mocap_pos[model.body_mocapid[number]] = place
