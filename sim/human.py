"""A seated person for MuJoCo: torso, head, left arm in the lap, and a right arm that is put exactly into a pose.

The right arm is what `paramove.observation` projects: tapered capsules (convex hulls of two spheres) for the upper arm
and the forearm, an ellipsoid from the wrist to the tip of the index finger for the hand. With `hand_shape` "pointing"
the hand is a palm with a stretched index finger, the other fingers bent, and a thumb, of the same length.

Frame: x forward, y left, z up, m. Nothing has a mass that matters or touches anything: every part is placed per frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.documents import Floats
from paramove.observation import ArmSizes
from sim.scene import quaternion_of

HandShape = Literal["ellipsoid", "pointing"]

ARM_PARTS = ("upper_arm", "forearm", "hand")
HALF_SHOULDER_WIDTH = 0.18
ARM_LENGTH = 0.705  # of the person that the torso's measures below belong to: 26 + 26 + 18.5 cm
SEGMENTS, ARC_STEPS = 28, 7  # of a tapered capsule: around, and along each of its two caps
TEXTURE_PX = 64
LOOKS_ONLY = {"contype": 0, "conaffinity": 0, "mass": 0.0}
CAPSULE, ELLIPSOID = mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_ELLIPSOID


Colour = tuple[float, float, float]


Pattern = Literal["plain", "stripes", "checks", "speckles"]
"""Of cloth."""


@dataclass(frozen=True)
class PersonLook:
    """Clothes and skin.

    Attributes:
        cloth, second: colours of shirt and sleeves, and of their pattern.
        pattern: of the cloth.
        skin, hair, trousers: colours.
        hand_shape: see the head of this module.
    """

    cloth: Colour = (0.25, 0.35, 0.60)
    second: Colour = (0.55, 0.60, 0.75)
    pattern: Pattern = "plain"
    skin: Colour = (0.86, 0.66, 0.54)
    hair: Colour = (0.20, 0.14, 0.10)
    trousers: Colour = (0.18, 0.20, 0.25)
    hand_shape: HandShape = "ellipsoid"


def add_person(spec: mujoco.MjSpec, sizes: ArmSizes, look: PersonLook, shoulder: ArrayLike) -> None:
    """Adds the person whose right shoulder rests at `shoulder` (3,), m; `place_arm` and `place_torso` move parts."""
    rest = np.asarray(shoulder, dtype=np.float64)
    add_cloth(spec, look)
    build = (sizes.upper_arm + sizes.forearm + sizes.hand) / ARM_LENGTH
    _add_hips(spec, look, rest, build)
    _add_torso(spec, look, rest, build)
    add_arm(spec, sizes, look)


def add_arm(spec: mujoco.MjSpec, sizes: ArmSizes, look: PersonLook | None = None, prefix: str = "") -> None:
    """Adds the right arm alone. Its bodies have their origin at their nearer joint, z along the segment.

    With a look the material "cloth" must be there. A `prefix` of the bodies' names distinguishes them from others.
    """
    cloth = {"material": "cloth"} if look is not None else {"rgba": (1.0, 1.0, 1.0, 1.0)}
    segments = (
        ("upper_arm", sizes.upper_arm, sizes.shoulder_radius, sizes.elbow_radius),
        ("forearm", sizes.forearm, sizes.elbow_radius, sizes.wrist_radius),
    )
    for part, length, near, far in segments:
        name = prefix + part
        vertices, triangles, places = tapered_capsule(length, near, far)
        spec.add_mesh(
            name=name,
            uservert=vertices.ravel(),
            userface=triangles.ravel(),
            usertexcoord=places.ravel(),
            userfacetexcoord=triangles.ravel(),
        )
        body = spec.worldbody.add_body(name=name, mocap=True)
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **cloth, **LOOKS_ONLY)
    skin = (*look.skin, 1.0) if look is not None else (1.0, 1.0, 1.0, 1.0)
    hand = spec.worldbody.add_body(name=f"{prefix}hand", mocap=True)
    _add_hand(hand, sizes, look.hand_shape if look else "ellipsoid", skin, prefix)


def place_arm(
    model: mujoco.MjModel, data: mujoco.MjData, pose: ArrayLike, wrist: ArrayLike | None = None, prefix: str = ""
) -> None:
    """Puts the right arm into a pose: shoulder, elbow, tip of the index finger, (9,), m.

    Without a `wrist` (3,) it lies on the line from elbow to fingertip, as far before the tip as the hand is long.
    Segments keep their lengths: those of the arm begin at their joint and point to the next, the hand ends at the tip.
    """
    shoulder, elbow, tip = np.asarray(pose, dtype=np.float64).reshape(3, 3)
    length = float(model.body(f"{prefix}hand").ipos[2]) * 2.0  # the hand's inertial frame is its middle
    straight = tip - length * _unit(tip - elbow)
    bent_at = straight if wrist is None else np.asarray(wrist, dtype=np.float64)
    across = _bend_direction(shoulder, elbow, tip)
    for name, near, far in zip(ARM_PARTS, (shoulder, elbow, bent_at), (elbow, bent_at, tip), strict=True):
        number = model.body(prefix + name).mocapid[0]
        data.mocap_pos[number] = tip - length * _unit(tip - near) if name == "hand" else near
        data.mocap_quat[number] = quaternion_of(_rotation(far - near, across))


def place_torso(model: mujoco.MjModel, data: mujoco.MjData, shift: ArrayLike) -> None:
    """Moves chest, head and left arm by `shift` (3,), m, from where they rest."""
    body = model.body("torso")
    data.mocap_pos[body.mocapid[0]] = body.pos + np.asarray(shift, dtype=np.float64)


def camera_frame(camera_from_world: ArrayLike) -> tuple[Floats, Floats]:
    """Position (3,) and quaternion (4,) of MuJoCo's camera, which looks along -z with y up, from a pose (4, 4)."""
    pose = np.asarray(camera_from_world, dtype=np.float64)
    world_from_camera = pose[:3, :3].T
    return -world_from_camera @ pose[:3, 3], quaternion_of(world_from_camera @ np.diag((1.0, -1.0, -1.0)))


def tapered_capsule(length: float, near: float, far: float) -> tuple[Floats, NDArray[np.int32], Floats]:
    """The convex hull of a sphere of radius `near` about the origin and one of radius `far` about (0, 0, length), m.

    Vertices (n, 3), triangles (m, 3), texture coordinates (n, 2). Raises ValueError where one sphere holds the other.
    """
    if length <= abs(near - far):
        raise ValueError(f"a segment of {length:.3f} m between radii {near:.3f} and {far:.3f} m has no sides")
    tangent = np.arcsin((near - far) / length)  # latitude at which the cone touches both spheres
    low = np.linspace(-np.pi / 2, tangent, ARC_STEPS)
    high = np.linspace(tangent, np.pi / 2, ARC_STEPS)
    radius = np.concatenate([near * np.cos(low), far * np.cos(high)])
    height = np.concatenate([near * np.sin(low), length + far * np.sin(high)])
    angle = np.linspace(0.0, 2 * np.pi, SEGMENTS + 1)
    # The spheres' radius is met by the middle of the polygon's sides as by its corners, on average.
    radius = radius * (1.0 + (np.pi / SEGMENTS) ** 2 / 6)
    x, y = np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle))
    vertices = np.stack([x, y, np.repeat(height[:, None], SEGMENTS + 1, axis=1)], axis=-1).reshape(-1, 3)
    along = (height - height[0]) / (height[-1] - height[0])
    places = np.stack(np.meshgrid(angle / (2 * np.pi), along), axis=-1).reshape(-1, 2)
    triangles = []
    for ring in range(len(radius) - 1):
        first = ring * (SEGMENTS + 1) + np.arange(SEGMENTS)
        above = first + SEGMENTS + 1
        if radius[ring] > 1e-9:
            triangles.append(np.stack([first, first + 1, above + 1], axis=1))
        if radius[ring + 1] > 1e-9:
            triangles.append(np.stack([first, above + 1, above], axis=1))
    return vertices, np.concatenate(triangles).astype(np.int32), places


def _add_hand(body: Any, sizes: ArmSizes, shape: HandShape, rgba: tuple[float, ...], prefix: str) -> None:
    length, width, thickness = sizes.hand, sizes.hand_width, sizes.hand_thickness
    body.explicitinertial, body.mass, body.inertia, body.ipos = True, 1e-3, (1e-6,) * 3, (0.0, 0.0, length / 2)
    if shape == "ellipsoid":
        size = (width / 2, thickness / 2, length / 2)
        body.add_geom(name=f"{prefix}hand", type=ELLIPSOID, pos=(0, 0, length / 2), size=size, rgba=rgba, **LOOKS_ONLY)
        return
    palm = 0.62 * length
    finger, thumb = 0.0085 * length / 0.185, 0.0095 * length / 0.185
    size = (width / 2, thickness / 2, palm / 2)
    body.add_geom(name=f"{prefix}palm", type=ELLIPSOID, pos=(0, 0, palm / 2), size=size, rgba=rgba, **LOOKS_ONLY)
    parts = (
        ("index_finger", (0.0, 0.0, 0.40 * length), (0.0, 0.0, length - finger), finger),
        ("thumb", (0.30 * width, 0.0, 0.25 * length), (0.48 * width, 0.0, 0.55 * length), thumb),
        ("bent_fingers", (-0.34 * width, 0.0, 0.52 * length), (0.0, 0.0, 0.58 * length), 1.3 * finger),
    )
    for name, start, end, radius in parts:
        body.add_geom(
            name=prefix + name, type=CAPSULE, fromto=(*start, *end), size=(radius, 0.0, 0.0), rgba=rgba, **LOOKS_ONLY
        )  # fmt: skip


def add_cloth(spec: mujoco.MjSpec, look: PersonLook) -> None:
    """Adds the material "cloth" that sleeves are made of."""
    if look.pattern == "plain":
        spec.add_material(name="cloth", specular=0.1, shininess=0.1, rgba=(*look.cloth, 1.0))
        return
    picture = cloth_texture(look)
    spec.add_texture(
        name="cloth",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        width=TEXTURE_PX,
        height=TEXTURE_PX,
        nchannel=3,
        data=picture.ravel(),
    )
    material = spec.add_material(name="cloth", specular=0.1, shininess=0.1, texrepeat=(2.0, 2.0))
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "cloth"


def cloth_texture(look: PersonLook) -> NDArray[np.uint8]:
    """The pattern of shirt and sleeves, RGB [TEXTURE_PX, TEXTURE_PX, 3]."""
    row, column = np.mgrid[:TEXTURE_PX, :TEXTURE_PX]
    weight: Floats
    if look.pattern == "stripes":
        weight = (row // 8 % 2).astype(np.float64)
    elif look.pattern == "checks":
        weight = 0.5 * ((row // 8 % 2) + (column // 8 % 2))
    elif look.pattern == "speckles":
        weight = np.random.default_rng(5).random((TEXTURE_PX, TEXTURE_PX)) ** 2
    else:
        raise ValueError(f"patterns with a texture are stripes, checks and speckles, found {look.pattern!r}")
    mixed = (1.0 - weight[..., None]) * np.array(look.cloth) + weight[..., None] * np.array(look.second)
    return np.asarray((255.0 * mixed).round(), dtype=np.uint8)


def _add_hips(spec: mujoco.MjSpec, look: PersonLook, shoulder: Floats, build: float) -> None:
    """Pelvis, thighs and shins, which stay where they are."""
    body = spec.worldbody.add_body(name="hips", pos=shoulder)
    trousers = (*look.trousers, 1.0)
    middle = HALF_SHOULDER_WIDTH
    _add_ellipsoid(body, "pelvis", (-0.07, middle, -0.53), (0.12, 0.165, 0.11), build, rgba=trousers)
    for side, name in ((-1.0, "right"), (1.0, "left")):
        hip, knee = (-0.07, middle + 0.085 * side, -0.55), (0.36, middle + 0.11 * side, -0.54)
        _add_capsule(body, f"{name}_thigh", hip, knee, 0.072, build, rgba=trousers)
        foot = (0.34, middle + 0.11 * side, -0.98)
        _add_capsule(body, f"{name}_shin", knee, foot, 0.05, build, rgba=trousers)


def _add_torso(spec: mujoco.MjSpec, look: PersonLook, shoulder: Floats, build: float) -> None:
    body = spec.worldbody.add_body(name="torso", mocap=True, pos=shoulder)
    skin, hair = (*look.skin, 1.0), (*look.hair, 1.0)
    middle = HALF_SHOULDER_WIDTH
    cloth: dict[str, Any] = {"material": "cloth"}
    _add_ellipsoid(body, "chest", (-0.055, middle, -0.17), (0.095, 0.165, 0.24), build, **cloth)
    _add_ellipsoid(body, "belly", (-0.05, middle, -0.38), (0.105, 0.145, 0.19), build, **cloth)
    _add_capsule(body, "yoke", (-0.02, 0.01, -0.005), (-0.02, 2 * middle - 0.01, -0.005), 0.052, build, **cloth)
    _add_capsule(body, "neck", (-0.03, middle, 0.03), (-0.005, middle, 0.13), 0.055, build, rgba=skin)
    _add_ellipsoid(body, "head", (0.01, middle, 0.228), (0.095, 0.074, 0.118), build, rgba=skin)
    _add_ellipsoid(body, "hair", (-0.012, middle, 0.248), (0.098, 0.081, 0.110), build, rgba=hair)
    _add_capsule(body, "nose", (0.098, middle, 0.218), (0.108, middle, 0.201), 0.012, build, rgba=skin)
    left_shoulder, left_elbow = (0.0, 2 * middle, 0.0), (-0.02, 2 * middle + 0.06, -0.25)
    left_wrist, left_tip = (0.17, middle + 0.12, -0.415), (0.24, middle + 0.05, -0.445)
    _add_capsule(body, "left_upper_arm", left_shoulder, left_elbow, 0.047, build, **cloth)
    _add_capsule(body, "left_forearm", left_elbow, left_wrist, 0.036, build, **cloth)
    _add_capsule(body, "left_hand", left_wrist, left_tip, 0.028, build, rgba=skin)


def _add_capsule(
    body: Any, name: str, start: Sequence[float], end: Sequence[float], radius: float, build: float, **more: Any
) -> None:
    ends = build * np.array((*start, *end))
    body.add_geom(name=name, type=CAPSULE, fromto=ends, size=(build * radius, 0.0, 0.0), **more, **LOOKS_ONLY)


def _add_ellipsoid(
    body: Any, name: str, place: Sequence[float], half: Sequence[float], build: float, **more: Any
) -> None:
    size = build * np.array(half)
    body.add_geom(name=name, type=ELLIPSOID, pos=build * np.array(place), size=size, **more, **LOOKS_ONLY)


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))


def _bend_direction(shoulder: Floats, elbow: Floats, tip: Floats) -> Floats:
    """In the arm's plane, from the elbow towards the line of shoulder and fingertip; any if the arm is straight."""
    bend = 0.5 * (shoulder + tip) - elbow
    axis = _unit(tip - elbow)
    across = bend - (bend @ axis) * axis
    if np.linalg.norm(across) < 1e-6:
        across = np.cross(axis, (0.0, 1.0, 0.0) if abs(axis[1]) < 0.9 else (1.0, 0.0, 0.0))
    return _unit(across)


def _rotation(axis: Floats, across: Floats) -> Floats:
    """Rotation (3, 3) with z along `axis` and x as near to `across` as that allows."""
    z = _unit(axis)
    x = across - (across @ z) * z
    x = _unit(x) if np.linalg.norm(x) > 1e-6 else _unit(np.cross(z, (0.0, 1.0, 1e-3)))
    return np.column_stack((x, np.cross(z, x), z))
