"""What differs from seed to seed: light, camera, lens, noise, rules, order. Every purpose draws from its own stream.

So a change in how one purpose draws leaves the others as they were.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from paramove.documents import Floats
from sim import tool_box

PURPOSES = ("camera", "light", "noise", "rules", "places", "order", "paths", "gaps", "turns")
WIDTH_PX, HEIGHT_PX = 480, 360
FOCAL_PX = 600.0
LOOK_AT = (0.155, -0.015, tool_box.SURFACE_Z)  # shoulder frame
DISTANCE = 0.60
AZIMUTH_DEG = 12.0
SEEN_MARGIN_PX = 6.0
UNSEEN_MARGIN_PX = 25.0
HAND_RADIUS = 0.13  # of the hand at rest about its fingertip, with its sleeve


def streams(seed: int) -> dict[str, np.random.Generator]:
    """One generator per purpose."""
    children = np.random.SeedSequence(seed).spawn(len(PURPOSES))
    return {purpose: np.random.default_rng(child) for purpose, child in zip(PURPOSES, children, strict=True)}


@dataclass(frozen=True)
class Camera:
    """A fixed camera and its lens. Radial distortion: distorted = undistorted * (1 + k1 r^2), r in focal lengths.

    Attributes:
        position: In the shoulder frame, [3], m.
        shoulder_from_optical: Rotation, [3, 3]; optical z forward, x right, y down.
        focal_px: Focal length.
        k1: Radial distortion.
        moved: Offset from the nominal position, [3], m; `turned_deg` [3] and `focal_scale` likewise.
    """

    position: Floats
    shoulder_from_optical: Floats
    focal_px: float
    k1: float
    moved: Floats
    turned_deg: Floats
    focal_scale: float

    @property
    def principal_point_px(self) -> tuple[float, float]:
        """Middle of the image; the middle of the first pixel is 0."""
        return (WIDTH_PX - 1) / 2, (HEIGHT_PX - 1) / 2

    def project(self, points: Floats) -> Floats:
        """Image points [n, 2], px, of points [n, 3] in the shoulder frame; NaN behind the camera."""
        in_camera = (np.asarray(points, dtype=np.float64) - self.position) @ self.shoulder_from_optical
        depth = np.where(in_camera[:, 2] > 1e-3, in_camera[:, 2], np.nan)
        flat = in_camera[:, :2] / depth[:, None]
        bent = flat * (1 + self.k1 * (flat**2).sum(axis=1, keepdims=True))
        return np.asarray(self.focal_px * bent + np.array(self.principal_point_px))


@dataclass(frozen=True)
class Looks:
    """How one world looks, and who belongs where.

    Attributes:
        brightness: Factor of each of the two lights, 0.5 to 1.6.
        camera: See `Camera`.
        pixel_noise: Standard deviation, of 255.
        rules: Colour -> name of its opening.
        turns: Colour -> how a block is turned about its upright axis at first, rad; a cylinder looks the same anyway.
        measures: Of the tool box, and of the nominal camera.
    """

    seed: int
    brightness: tuple[float, float]
    camera: Camera
    pixel_noise: float
    rules: dict[str, str]
    turns: dict[str, float]
    measures: tool_box.Measures

    @classmethod
    def draw(cls, seed: int, measures: tool_box.Measures = tool_box.NOMINAL) -> Looks:
        """The looks of a seed."""
        draw = streams(seed)
        light = draw["light"].uniform(0.5, 1.6, 2)
        places = draw["rules"].permutation(len(tool_box.OPENINGS))[: len(tool_box.COLOURS)]
        return cls(
            seed=seed,
            brightness=(float(light[0]), float(light[1])),
            camera=draw_camera(draw["camera"], measures.camera_elevation_deg),
            pixel_noise=float(draw["noise"].uniform(2.0, 6.0)),
            rules={
                colour: tool_box.OPENINGS[place].name for colour, place in zip(tool_box.COLOURS, places, strict=True)
            },
            turns=dict(zip(tool_box.COLOURS, draw["turns"].uniform(0.0, np.pi / 2, 3).tolist(), strict=True)),
            measures=measures,
        )


def draw_camera(draw: np.random.Generator, elevation_deg: float, max_draws: int = 2000) -> Camera:
    """A camera near the nominal pose, drawn again until it sees the working area and not the instructor at rest."""
    for _ in range(max_draws):
        moved, turned = draw.uniform(-0.05, 0.05, 3), draw.uniform(-6.0, 6.0, 3)
        scale, k1 = float(draw.uniform(0.9, 1.1)), float(draw.uniform(-0.1, 0.1))
        camera = _camera(elevation_deg, moved, turned, scale, k1)
        if sees_enough(camera):
            return camera
    raise RuntimeError(f"no camera in {max_draws} draws sees the working area; the nominal view is too narrow")


def sees_enough(camera: Camera) -> bool:
    """Whether everything that matters is in the image, and everything that is put away is not."""
    pixels = camera.project(_must_be_seen())
    inside = (pixels > SEEN_MARGIN_PX).all() and (
        pixels < (WIDTH_PX - SEEN_MARGIN_PX, HEIGHT_PX - SEEN_MARGIN_PX)
    ).all()
    if not inside:
        return False
    apart = camera.project(_must_not_be_seen())
    low, high = -UNSEEN_MARGIN_PX, np.array((WIDTH_PX, HEIGHT_PX)) + UNSEEN_MARGIN_PX
    visible = (apart > low).all(axis=1) & (apart < high).all(axis=1)
    return not bool(visible.any())


def _camera(elevation_deg: float, moved: Floats, turned_deg: Floats, scale: float, k1: float) -> Camera:
    elevation, azimuth = np.deg2rad((elevation_deg, AZIMUTH_DEG))
    backward = np.array((np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)))
    right = np.cross((0.0, 0.0, 1.0), backward)
    right /= np.linalg.norm(right)
    nominal = np.column_stack((right, np.cross(-backward, right), -backward))
    turn = rotation_of(np.deg2rad(turned_deg))
    return Camera(
        position=np.array(LOOK_AT) + DISTANCE * backward + moved,
        shoulder_from_optical=nominal @ turn,
        focal_px=FOCAL_PX * scale,
        k1=k1,
        moved=moved,
        turned_deg=turned_deg,
        focal_scale=scale,
    )


def rotation_of(vector: Floats) -> Floats:
    """Rotation matrix [3, 3] of a rotation vector [3], rad (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def _must_be_seen() -> Floats:
    """The openings with a margin, the strip, tall cylinders on both, and the corners of the calibration."""
    floor, top = tool_box.SURFACE_Z, tool_box.SURFACE_Z + 0.085
    plane = [(x, y, floor) for x in (0.105, 0.215) for y in (-0.145, 0.115)]
    above = [(x, y, top) for x in (0.12, 0.195) for y in (-0.13, 0.095)]
    return np.array(plane + above)


def _must_not_be_seen() -> Floats:
    from sim import places

    around = [
        (dx, dy, dz)
        for dx in (-HAND_RADIUS, HAND_RADIUS)
        for dy in (-HAND_RADIUS, HAND_RADIUS)
        for dz in (0.0, HAND_RADIUS)
    ]
    idle = places.IDLE_FINGERTIP + np.array(around)
    parked = np.concatenate([place + 0.03 * np.array(((-1, 1, 1), (1, 1, 1), (0, 1, -1))) for place in places.PARKED])
    return np.concatenate([idle, parked])
