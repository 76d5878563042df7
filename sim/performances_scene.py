"""The room in which a clip is filmed: person, table with clutter, walls, lights; and the four cameras around the table.

World frame: that of the table, m (x forward, y left, z up).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats
from sim.body_markers import add_markers, mute
from sim.human import Pattern, PersonLook, add_person, camera_frame
from sim.persons.performances import Performance

WIDTH_PX, HEIGHT_PX = 320, 240
MARGIN_PX = 16  # on each side, rendered beyond the image, which the lens may pull in
OVERSAMPLING = 1.5
"""Pixels rendered per pixel of the image and axis; they are averaged."""
NEAR_EDGE, FAR_EDGE, RIGHT_EDGE, LEFT_EDGE = -0.085, 0.72, -0.66, 0.72
"""The near row of targets lies 7 cm before the origin, so the table begins there."""
TABLE_THICKNESS = 0.03
OBJECT_HALF = (0.022, 0.05)
"""Radius and half height of the glass and of the objects."""
BOX_HALF = (0.06, 0.07)
TEXTURE_PX = 128

CAMERA_PLACES = (  # 1 and 4 have the depth along y, 2 and 3 along x (thesis 6.7.1.2)
    ((0.30, -1.80, 0.85), (-0.03, -0.16, 0.12)),
    ((1.12, -0.55, 1.68), (-0.07, -0.17, 0.06)),
    ((1.12, 0.45, 1.64), (-0.07, -0.17, 0.06)),
    ((-0.45, -1.65, 1.30), (0.00, -0.12, 0.12)),
)
FOCAL_PX = 345.0
NAMES = tuple(f"camera_{number}" for number in (1, 2, 3, 4))
LOOKS_ONLY = {"contype": 0, "conaffinity": 0, "mass": 0.0}
BOX, CYLINDER = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
PATTERNS: tuple[Pattern, ...] = ("plain", "stripes", "checks", "speckles")


@dataclass(frozen=True)
class Room:
    """How one clip looks.

    Attributes:
        person: clothes and skin.
        brightness: of the two lights, factors.
        noise: standard deviation of the sensors' noise, of 255.
        seed: of the clutter.
    """

    person: PersonLook
    brightness: tuple[float, float]
    noise: float
    seed: int

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Room:
        """The looks of a clip."""
        hue, value = rng.random(), float(rng.uniform(0.25, 0.8))
        cloth = colour(hue, 0.5, value)
        contrast = float(np.clip(value + rng.choice([-0.25, 0.25]), 0.1, 0.95))
        look = PersonLook(
            cloth=cloth,
            second=colour(rng.random(), 0.4, contrast),
            pattern=PATTERNS[int(rng.integers(4))],
            skin=_shaded(rng.uniform(0.6, 1.05), (0.88, 0.66, 0.53)),
            hair=_shaded(rng.uniform(0.3, 1.6), (0.25, 0.17, 0.11)),
            trousers=colour(rng.random(), 0.3, float(rng.uniform(0.1, 0.45))),
            hand_shape="pointing",
        )
        light = rng.uniform(0.6, 1.4, 2)
        return cls(look, (float(light[0]), float(light[1])), float(rng.uniform(2.0, 6.0)), int(rng.integers(2**31)))


def _shaded(factor: float, rgb: tuple[float, float, float]) -> tuple[float, float, float]:
    red, green, blue = (float(factor) * part for part in rgb)
    return red, green, blue


def colour(hue: float, saturation: float, value: float) -> tuple[float, float, float]:
    """RGB of a colour; hue, saturation and value 0 to 1."""
    turned = (hue * 6.0 + np.array([0.0, 4.0, 2.0])) % 6.0
    pure = np.clip(np.abs(turned - 3.0) - 1.0, 0.0, 1.0)
    red, green, blue = value * (1.0 - saturation * (1.0 - pure))
    return float(red), float(green), float(blue)


def draw_cameras(rng: np.random.Generator) -> tuple[CalibratedCamera, ...]:
    """The four cameras of a clip, a little elsewhere and with another lens each time. Without errors."""
    return tuple(draw_camera(name, *place, rng) for name, place in zip(NAMES, CAMERA_PLACES, strict=True))


def draw_camera(
    name: str, eye: Any, target: Any, rng: np.random.Generator, scale: float = 1.0, height: float = 0.0
) -> CalibratedCamera:
    """A camera about there, (3,), m, looking about at `target` (3,), in a scene of that scale and height, m."""
    up = np.array([0.0, 0.0, height])
    position = scale * (np.array(eye) + rng.uniform(-0.04, 0.04, 3)) + up
    forward = scale * (np.array(target) + rng.uniform(-0.02, 0.02, 3)) + up - position
    pose = np.eye(4)
    pose[:3, :3] = looking(forward, float(rng.uniform(-0.03, 0.03)))
    pose[:3, 3] = -pose[:3, :3] @ position
    focal = FOCAL_PX * float(rng.uniform(0.97, 1.03))
    centre = np.array([(WIDTH_PX - 1) / 2, (HEIGHT_PX - 1) / 2]) + rng.uniform(-3.0, 3.0, 2)
    matrix = np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])
    lens = np.array([float(rng.uniform(-0.10, 0.06)), 0.0, 0.0, 0.0])
    return CalibratedCamera(name, WIDTH_PX, HEIGHT_PX, matrix, lens, pose)


def looking(forward: Floats, roll: float = 0.0) -> Floats:
    """Rotation (3, 3) from the world to a camera that looks `forward`, its x axis level but for a roll, rad."""
    z = forward / np.linalg.norm(forward)
    x = np.cross(z, (0.0, 0.0, 1.0))
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    cos, sin = np.cos(roll), np.sin(roll)
    return np.stack([cos * x + sin * y, cos * y - sin * x, z])


def as_calibrated(camera: CalibratedCamera, rng: np.random.Generator) -> CalibratedCamera:
    """The camera with the errors of a calibration: about 0.3 px in the image and 1 mm in the world."""
    focal, along_x, along_y = rng.uniform(-0.3, 0.3, 3)
    matrix = camera.matrix + np.array([[focal, 0.0, along_x], [0.0, focal, along_y], [0.0, 0.0, 0.0]])
    lens = camera.distortion + np.array([float(rng.uniform(-0.003, 0.003)), 0.0, 0.0, 0.0])
    angles = rng.uniform(-0.0005, 0.0005, 3)
    turn = np.array([[1.0, -angles[2], angles[1]], [angles[2], 1.0, -angles[0]], [-angles[1], angles[0], 1.0]])
    left, _, right = np.linalg.svd(turn)
    pose = np.eye(4)
    pose[:3, :3] = left @ right @ camera.camera_from_world[:3, :3]
    pose[:3, 3] = -pose[:3, :3] @ (camera.position + rng.uniform(-0.001, 0.001, 3))
    return CalibratedCamera(camera.name, camera.width_px, camera.height_px, matrix, lens, pose)


def build(
    performance: Performance, room: Room, cameras: tuple[CalibratedCamera, ...], markers: tuple[str, ...] = ()
) -> mujoco.MjModel:
    """The room of a clip with its person; bodies `object_0`, ... are what is carried in each act.

    With `markers` the person wears coloured balls at these points of the arm, and nothing else has strong colours.
    """
    spec = mujoco.MjSpec()
    _set_visual(spec)
    _add_lights(spec, room.brightness)
    rng = np.random.default_rng(room.seed)
    _add_room(spec, rng)
    _add_table(spec, rng, performance)
    add_person(spec, performance.person.sizes, room.person, performance.person.shoulder)
    _add_objects(spec, rng, performance)
    if markers:
        mute(spec)
        add_markers(spec, performance.person.sizes, markers)
    for camera in cameras:
        position, quaternion = camera_frame(camera.camera_from_world)
        half = HEIGHT_PX / 2 + MARGIN_PX
        fovy = float(np.rad2deg(2 * np.arctan(half / camera.matrix[1, 1])))
        spec.worldbody.add_camera(name=camera.name, pos=position, quat=quaternion, fovy=fovy)
    return spec.compile()


def rendered_px() -> tuple[int, int]:
    """Width and height of what is rendered for an image."""
    return round(OVERSAMPLING * (WIDTH_PX + 2 * MARGIN_PX)), round(OVERSAMPLING * (HEIGHT_PX + 2 * MARGIN_PX))


def _set_visual(spec: mujoco.MjSpec) -> None:
    visual = spec.visual
    visual.global_.offwidth, visual.global_.offheight = rendered_px()
    visual.quality.offsamples = 0
    visual.quality.shadowsize = 768
    visual.quality.numslices, visual.quality.numstacks = 16, 10
    visual.map.znear, visual.map.zfar = 0.05, 12.0
    visual.map.shadowclip = 1.6
    spec.stat.extent = 1.0
    spec.stat.center = (0.0, 0.0, 0.1)


def _add_lights(spec: mujoco.MjSpec, brightness: tuple[float, float]) -> None:
    spec.visual.headlight.ambient = (0.21 * sum(brightness),) * 3
    spec.visual.headlight.diffuse = (0.0, 0.0, 0.0)
    spec.visual.headlight.specular = (0.0, 0.0, 0.0)
    for number, (level, place) in enumerate(zip(brightness, ((0.9, 0.9, 2.4), (-0.4, -1.4, 2.2)), strict=True)):
        spec.worldbody.add_light(
            name=f"light_{number}",
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            pos=place,
            dir=-np.array(place),
            diffuse=(0.48 * level,) * 3,
            specular=(0.1 * level,) * 3,
            castshadow=number == 0,  # a second shadow would double the time
        )


def _texture(spec: mujoco.MjSpec, name: str, picture: Floats) -> str:
    """A material with a picture RGB [h, w, 3], 0 to 1."""
    height, width = picture.shape[:2]
    pixels = (255.0 * np.clip(picture, 0.0, 1.0)).astype(np.uint8)
    spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3, data=pixels.ravel()
    )
    spec.add_material(name=name, specular=0.05, shininess=0.05).textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    return name


def _picture(rng: np.random.Generator, kind: str, base: tuple[float, ...], second: tuple[float, ...]) -> Floats:
    """A texture: boards, stripes, tiles, blots or posters."""
    row, column = np.mgrid[:TEXTURE_PX, :TEXTURE_PX]
    if kind == "boards":
        grain = np.repeat(rng.random((1, TEXTURE_PX)), TEXTURE_PX, axis=0) * 0.5 + 0.1 * np.sin(row / 9.0)
        weight = np.clip(grain, 0.0, 1.0)
    elif kind == "stripes":
        weight = (column // 8 % 2).astype(np.float64)
    elif kind == "tiles":
        weight = ((row % 32 < 2) | (column % 32 < 2)).astype(np.float64)
    elif kind == "blots":
        coarse = rng.random((16, 16))
        weight = np.kron(coarse, np.ones((8, 8))) ** 2
    else:
        weight = np.zeros((TEXTURE_PX, TEXTURE_PX))
        for _ in range(14):
            x, y = rng.integers(0, TEXTURE_PX - 24, 2)
            w, h = rng.integers(8, 40, 2)
            weight[y : y + h, x : x + w] = rng.random()
    return np.asarray((1.0 - weight[..., None]) * np.array(base) + weight[..., None] * np.array(second))


def _add_room(spec: mujoco.MjSpec, rng: np.random.Generator) -> None:
    grey = float(rng.uniform(0.55, 0.8))
    floor = _texture(spec, "floor", _picture(rng, "tiles", (0.5 * grey,) * 3, (0.35 * grey,) * 3))
    walls = [
        ("wall_back", (-1.5, 0.0, 0.6), (0.02, 2.6, 1.8)),
        ("wall_left", (0.3, 2.1, 0.6), (2.0, 0.02, 1.8)),
    ]
    spec.worldbody.add_geom(name="floor", type=BOX, pos=(0, 0, -0.76), size=(4, 4, 0.02), material=floor, **LOOKS_ONLY)
    for name, place, size in walls:
        kind = ("posters", "blots", "stripes", "posters")[int(rng.integers(4))]
        base = colour(rng.random(), 0.12, grey)
        second = colour(rng.random(), float(rng.uniform(0.1, 0.4)), float(np.clip(grey + rng.uniform(-0.3, 0.2), 0, 1)))
        material = _texture(spec, name, _picture(rng, kind, base, second))
        spec.worldbody.add_geom(name=name, type=BOX, pos=place, size=size, material=material, **LOOKS_ONLY)
    spec.worldbody.add_geom(
        name="chair", type=BOX, pos=(-0.50, 0.0, 0.05), size=(0.02, 0.2, 0.24),
        rgba=(*colour(rng.random(), 0.3, 0.3), 1.0), **LOOKS_ONLY,
    )  # fmt: skip
    for number in range(6):  # shelves, boxes and bags along the walls and on the floor
        half = rng.uniform(0.08, 0.3, 3)
        corner = np.array([rng.uniform(-1.3, 0.9), rng.uniform(1.4, 1.9), -0.74 + half[2]])
        if number % 2:
            corner[:2] = rng.uniform(-1.3, -1.1), rng.uniform(-1.6, 1.6)
        spec.worldbody.add_geom(
            name=f"thing_{number}", type=BOX, pos=corner, size=half, quat=_upright(rng),
            rgba=(*colour(rng.random(), 0.5, float(rng.uniform(0.2, 0.8))), 1.0), **LOOKS_ONLY,
        )  # fmt: skip


def _upright(rng: np.random.Generator) -> Floats:
    angle = float(rng.uniform(0.0, np.pi))
    return np.array([np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)])


def _add_table(spec: mujoco.MjSpec, rng: np.random.Generator, performance: Performance) -> None:
    kind = ("boards", "blots", "plain")[int(rng.integers(3))]
    base = colour(float(rng.uniform(0.05, 0.12)), float(rng.uniform(0.1, 0.45)), float(rng.uniform(0.45, 0.85)))
    second = tuple(0.75 * part for part in base)
    wood = _texture(spec, "table", _picture(rng, kind if kind != "plain" else "posters", base, second))
    if kind == "plain":
        spec.material("table").rgba = (*base, 1.0)
    middle = ((NEAR_EDGE + FAR_EDGE) / 2, (RIGHT_EDGE + LEFT_EDGE) / 2, -TABLE_THICKNESS / 2)
    size = ((FAR_EDGE - NEAR_EDGE) / 2, (LEFT_EDGE - RIGHT_EDGE) / 2, TABLE_THICKNESS / 2)
    spec.worldbody.add_geom(name="table", type=BOX, pos=middle, size=size, material=wood, **LOOKS_ONLY)
    for number, (x, y) in enumerate(((0.6, 0.2), (0.6, -0.3), (0.1, 0.55), (0.62, 0.55), (0.5, -0.55), (0.35, 0.5))):
        place = np.array([x, y]) + rng.uniform(-0.05, 0.05, 2)
        half = rng.uniform(0.02, 0.055, 3)
        shade = (*colour(rng.random(), float(rng.uniform(0.1, 0.8)), float(rng.uniform(0.15, 0.9))), 1.0)
        form = BOX if rng.random() < 0.6 else CYLINDER
        size = tuple(half) if form == BOX else (half[0], half[2], 0.0)
        height = size[2] if form == BOX else size[1]
        spec.worldbody.add_geom(
            name=f"clutter_{number}", type=form, pos=(*place, height), size=size, quat=_upright(rng), rgba=shade,
            **LOOKS_ONLY,
        )  # fmt: skip
    if performance.kind.scene == "plain":
        _add_monitor(spec, rng)


def _add_monitor(spec: mujoco.MjSpec, rng: np.random.Generator) -> None:
    """A flat screen that lies back at the table's far left corner, out of the way of all four views."""
    body = spec.worldbody.add_body(name="monitor", pos=(0.52, 0.66, 0.16), quat=(0.924, 0.0, 0.0, 0.383))
    body.add_geom(name="frame", type=BOX, size=(0.015, 0.20, 0.13), rgba=(0.08, 0.08, 0.09, 1.0), **LOOKS_ONLY)
    shine = (*colour(rng.random(), 0.4, 0.9), 1.0)
    body.add_geom(
        name="screen", type=BOX, pos=(-0.012, 0, 0), size=(0.005, 0.185, 0.115), rgba=shine, **LOOKS_ONLY
    )  # fmt: skip


def _add_objects(spec: mujoco.MjSpec, rng: np.random.Generator, performance: Performance) -> None:
    scene, where = performance.kind.scene, performance.furniture
    if scene == "plain":
        return
    shade = (*colour(rng.random(), 0.5, float(rng.uniform(0.4, 0.85))), 1.0)
    if scene == "box":
        top = float(where[2]) - 0.07
        size = (*BOX_HALF, top / 2)
        spec.worldbody.add_geom(
            name="box", type=BOX, pos=(where[0] + 0.01, where[1], top / 2), size=size, rgba=shade, **LOOKS_ONLY
        )
    else:  # the teapot stands beyond the place where the fingers pour
        x, y = where[0] + 0.09, where[1] + 0.05
        spec.worldbody.add_geom(
            name="pot", type=mujoco.mjtGeom.mjGEOM_ELLIPSOID, pos=(x, y, 0.06), size=(0.07, 0.07, 0.06), rgba=shade,
            **LOOKS_ONLY,
        )  # fmt: skip
        spec.worldbody.add_geom(
            name="spout", type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=(0.012, 0.0, 0.0), rgba=shade,
            fromto=(x + 0.05, y + 0.04, 0.06, x + 0.1, y + 0.08, 0.11), **LOOKS_ONLY,
        )  # fmt: skip
    for number in range(len(performance.acts)):
        body = spec.worldbody.add_body(name=f"object_{number}", mocap=True, pos=(0.0, 0.0, -2.0))
        glass = (0.75, 0.85, 0.9, 1.0) if scene == "pot" else (*colour(rng.random(), 0.85, 0.75), 1.0)
        body.add_geom(name=f"object_{number}", type=CYLINDER, size=(*OBJECT_HALF, 0.0), rgba=glass, **LOOKS_ONLY)
