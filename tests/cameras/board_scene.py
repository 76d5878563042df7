"""Images of the calibration board without a camera: a printed sheet seen through a lens with distortion, with noise."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import cv2
import numpy as np

from paramove.cameras.calibrated import CalibratedCamera
from paramove.cameras.charuco_sheet import PAPERS, board_sheet

MM_PER_PX = 0.5
"""Of the sheet's raster."""


def rectangles_mm(pdf):
    """Every filled rectangle of a PDF of ours: [N, 4] x, y of the lower left corner, width, height; mm."""
    pdf = pdf.partition(b"\nf\n")[0]  # what follows the black ones is only drawn around
    found = re.findall(rb"([\d.]+) ([\d.]+) ([\d.]+) ([\d.]+) re", pdf)
    return np.array(found, dtype=float)


def raster(pdf, width_mm, height_mm, px_per_mm=1 / MM_PER_PX):
    """The sheet as an image, uint8 [H, W]: each pixel by its covered share."""
    fine = 4
    image = np.full((round(height_mm * px_per_mm * fine), round(width_mm * px_per_mm * fine)), 255, np.uint8)
    for x, y, width, height in rectangles_mm(pdf) * px_per_mm * fine:
        bottom = height_mm * px_per_mm * fine
        image[round(bottom - y - height) : round(bottom - y), round(x) : round(x + width)] = 0
    return cv2.resize(image, None, fx=1 / fine, fy=1 / fine, interpolation=cv2.INTER_AREA)


def looking(position, target, roll_deg=0.0):
    """camera_from_world of a camera at a place that looks at another; image up is up in the world."""
    position = np.asarray(position, dtype=float)
    forward = np.asarray(target) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(forward, right), forward])
    turn = cv2.Rodrigues(np.array([0.0, 0.0, np.deg2rad(roll_deg)]))[0] @ turn
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, -turn @ position
    return pose


def camera(name="left", pose=None, size=(640, 480), focal=620.0, k1=-0.12, k2=0.05):
    """A camera with a lens that bends; at 0.8 m, looking down on the table unless `pose` is given."""
    pose = looking((1.0, 0.3, 0.7), (0.12, 0.0, 0.0)) if pose is None else pose
    matrix = np.array([[focal, 0, size[0] / 2 - 3.5], [0, focal, size[1] / 2 + 2.5], [0, 0, 1]])
    return CalibratedCamera(name, *size, matrix, np.array([k1, k2, 0.001, -0.0005, 0.0]), pose)


_IDEAL = {}


def _undistorted_pixels(camera, fine):
    """Where the pixels of a camera's image, `fine` times as large, were in an image without distortion: [N, 1, 2]."""
    size, matrix = (camera.width_px * fine, camera.height_px * fine), camera.matrix
    key = (size, matrix.tobytes(), camera.distortion.tobytes())
    if key not in _IDEAL:
        matrix = camera.resized(*size).matrix
        v, u = np.mgrid[0 : size[1], 0 : size[0]].astype(np.float64)
        normalised = np.column_stack([u.ravel(), v.ravel()]) - matrix[:2, 2]
        bent = normalised / np.diag(matrix)[:2]
        k1, k2, p1, p2, _ = camera.distortion
        x, y = bent.T.copy()
        for _ in range(9):
            square = x * x + y * y
            radial = 1 + k1 * square + k2 * square**2
            dx, dy = 2 * p1 * x * y + p2 * (square + 2 * x * x), p1 * (square + 2 * y * y) + 2 * p2 * x * y
            x, y = (bent[:, 0] - dx) / radial, (bent[:, 1] - dy) / radial
        if len(_IDEAL) > 6:
            _IDEAL.clear()
        ideal = np.column_stack([x, y]) * np.diag(matrix)[:2] + matrix[:2, 2]
        _IDEAL[key] = ideal[:, None].astype(np.float32)
    return _IDEAL[key]


@dataclass(frozen=True)
class Sheet:
    """A printed board. `scale`: how much larger the printer made it."""

    paper: str = "a4"
    scale: float = 1.0

    def __post_init__(self):
        paper = PAPERS[self.paper]
        object.__setattr__(self, "image", raster(board_sheet(self.paper), paper.width_mm, paper.height_mm))

    def seen_by(self, camera, table_from_sheet=None, noise=3.0, seed=0, blur_px=0.6):
        """The image, uint8 [H, W, 3]; the sheet lies on the table, or where `table_from_sheet` (4, 4) moves it."""
        pose = camera.camera_from_world @ (np.eye(4) if table_from_sheet is None else table_from_sheet)
        paper, unit = PAPERS[self.paper], MM_PER_PX * 1e-3 * self.scale
        middle, bottom = paper.width_mm / MM_PER_PX / 2 - 0.5, paper.height_mm / MM_PER_PX - 0.5
        # Raster (column, row) to the plane of the table: x forward = up on the sheet, y left, origin below the middle.
        sheet_from_raster = np.array([[0, -unit, unit * bottom], [-unit, 0, unit * middle], [0, 0, 1]])
        fine = 2
        size = (camera.width_px * fine, camera.height_px * fine)
        matrix = camera.resized(*size).matrix
        image_from_raster = matrix @ pose[:3, [0, 1, 3]] @ sheet_from_raster
        ideal = _undistorted_pixels(camera, fine)
        at = cv2.perspectiveTransform(ideal, np.linalg.inv(image_from_raster)).reshape(size[1], size[0], 2)
        large = cv2.remap(self.image, at, None, cv2.INTER_LINEAR, borderValue=120)
        image = cv2.resize(large, (camera.width_px, camera.height_px), interpolation=cv2.INTER_AREA)
        image = cv2.GaussianBlur(image, (0, 0), blur_px) if blur_px else image
        noisy = (
            20
            + 0.8 * image[..., None]
            + np.random.default_rng(seed).standard_normal((*image.shape, 3), np.float32) * noise
        )
        return np.clip(np.round(noisy), 0, 255).astype(np.uint8)


def held(camera, seed, distance=(0.35, 0.6), tilt_deg=40.0):
    """table_from_sheet of a board held before a camera, its middle anywhere in the image, tilted to any side."""
    draw = np.random.default_rng(seed)
    depth = draw.uniform(*distance)
    pixel = draw.uniform([0.3, 0.3], [0.7, 0.7]) * [camera.width_px, camera.height_px]
    normalised = np.linalg.solve(camera.matrix, [*pixel, 1.0])
    facing = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # sheet x is up, y left, in the camera
    axis = draw.uniform(0, 2 * np.pi)
    tilt = np.deg2rad(tilt_deg) * np.sqrt(draw.uniform(0.05, 1.0))
    turn = cv2.Rodrigues(tilt * np.array([np.cos(axis), np.sin(axis), 0.0]))[0] @ facing
    camera_from_sheet = np.eye(4)
    camera_from_sheet[:3, :3] = turn
    camera_from_sheet[:3, 3] = depth * normalised - turn @ [0.105, 0.0, 0.0]
    return np.linalg.inv(camera.camera_from_world) @ camera_from_sheet


def session(camera, sheet, count=18, seed=0, tilt_deg=40.0, **looks):
    """Images of a board that is held before a camera, and one of it on the table: {name: image}."""
    images = {
        f"view_{number:02d}": sheet.seen_by(
            camera, held(camera, 1000 * seed + number, tilt_deg=tilt_deg), seed=number, **looks
        )
        for number in range(count)
    }
    return images | {"table": sheet.seen_by(camera, seed=99, **looks)}


def blank(camera):
    """An image without a board."""
    return np.full((camera.height_px, camera.width_px, 3), 120, np.uint8)


__all__ = ["Sheet", "blank", "camera", "held", "looking", "raster", "rectangles_mm", "replace", "session"]
