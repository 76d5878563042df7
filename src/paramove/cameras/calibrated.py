"""Calibrated cameras: projection, correction of lens distortion, and calibration files (thesis D.3).

The camera frame is OpenCV's: x right, y down, z forward, m. Pixel coordinates are those of pixel centres: the middle of
the upper left pixel is (0, 0).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import cv2
import numpy as np
from numpy.typing import ArrayLike
from ruamel.yaml import YAML

from paramove.documents import Floats, Image, InputError, read_document, replacing

SAME_SQUARE_M = 5e-4
"""A print is measured this exactly."""
MAX_CAMERAS = 4
WORLD_FRAME = "table"
COEFFICIENTS = (0, 4, 5, 8, 12, 14)
"""Numbers of distortion coefficients that OpenCV supports."""


@dataclass(frozen=True, eq=False)
class CalibratedCamera:
    """A camera with known lens and pose.

    Attributes:
        name: of the camera, and of its frame.
        width_px, height_px: of its images.
        matrix: (3, 3), px.
        distortion: (k,), OpenCV's order k1 k2 p1 p2 k3 ...; k = 0 is a lens without distortion.
        camera_from_world: (4, 4), m.

    Raises InputError for other shapes, numbers that are not finite and matrices that are no rotation.
    """

    name: str
    width_px: int
    height_px: int
    matrix: Floats
    distortion: Floats
    camera_from_world: Floats

    def __post_init__(self) -> None:
        for name in ("matrix", "distortion", "camera_from_world"):
            value = np.array(getattr(self, name), dtype=np.float64)
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        self._check()

    def _check(self) -> None:
        here = f"camera {self.name!r}"
        if self.width_px < 1 or self.height_px < 1:
            raise InputError(f"{here}: {self.width_px} x {self.height_px} px found, a size above 0 expected")
        for name, shape in (("matrix", (3, 3)), ("camera_from_world", (4, 4))):
            if getattr(self, name).shape != shape:
                raise InputError(f"{here}: {name} of shape {getattr(self, name).shape} found, {shape} expected")
        if self.distortion.ndim != 1 or len(self.distortion) not in COEFFICIENTS:
            raise InputError(
                f"{here}: distortion of shape {self.distortion.shape} found, {COEFFICIENTS} numbers supported"
            )
        if not all(np.isfinite(value).all() for value in (self.matrix, self.distortion, self.camera_from_world)):
            raise InputError(f"{here}: a number is not finite; calibrate it again")
        if min(self.matrix[0, 0], self.matrix[1, 1]) <= 0.0 or not np.allclose(
            self.matrix[[1, 2, 2, 2], [0, 0, 1, 2]], [0.0, 0.0, 0.0, 1.0], rtol=0.0, atol=1e-9
        ):
            raise InputError(f"{here}: [[fx, s, cx], [0, fy, cy], [0, 0, 1]] expected, {self.matrix.tolist()} found")
        turn = self.camera_from_world[:3, :3]
        is_rotation = np.allclose(turn @ turn.T, np.eye(3), rtol=0.0, atol=1e-5) and np.linalg.det(turn) > 0.0
        if not is_rotation or not np.allclose(self.camera_from_world[3], [0, 0, 0, 1], rtol=0.0, atol=1e-9):
            raise InputError(f"{here}: camera_from_world is not a rotation and translation")

    def resized(self, width_px: int, height_px: int) -> CalibratedCamera:
        """The camera of the same picture at another size; the borders of the picture stay where they are."""
        scale = np.diag([width_px / self.width_px, height_px / self.height_px, 1.0])
        half = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
        matrix = np.linalg.inv(half) @ scale @ half @ self.matrix
        return replace(self, width_px=width_px, height_px=height_px, matrix=matrix)

    def project(self, points: ArrayLike, *, distorted: bool = True) -> Floats:
        """Projects points of the world: (..., 3), m -> (..., 2), px of the image as captured, or undistorted.

        A point that is not in front of the camera is NaN.
        """
        in_world = np.asarray(points, dtype=np.float64)
        in_camera = in_world @ self.camera_from_world[:3, :3].T + self.camera_from_world[:3, 3]
        depth = np.where(in_camera[..., 2:] > 0.0, in_camera[..., 2:], np.nan)
        normalised = in_camera[..., :2] / depth
        pixels: Floats = normalised @ self.matrix[:2, :2].T + self.matrix[:2, 2]
        return self.distort(pixels) if distorted else pixels

    def depths(self, points: Floats) -> Floats:
        """How far before the camera points of the world, (..., 3), m, are along its axis, (...), m."""
        return np.asarray(points @ self.camera_from_world[2, :3] + self.camera_from_world[2, 3])

    def distort(self, pixels: ArrayLike) -> Floats:
        """Pixels of the undistorted image -> of the image as captured. Shape (..., 2), px."""
        ideal = np.asarray(pixels, dtype=np.float64)
        if not len(self.distortion) or not ideal.size:
            return ideal.copy()
        normalised = (ideal - self.matrix[:2, 2]) @ np.linalg.inv(self.matrix[:2, :2]).T
        rays = np.concatenate([normalised, np.ones((*ideal.shape[:-1], 1))], axis=-1).reshape(-1, 1, 3)
        captured, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), self.matrix, self.distortion)
        return cast(Floats, captured.reshape(ideal.shape))

    def normalised(self, pixels: ArrayLike) -> Floats:
        """Ray directions (x/z, y/z) in the camera frame of points (..., 2), px of the image as captured; NaN stays."""
        captured = np.asarray(pixels, dtype=np.float64)
        result = np.full_like(captured, np.nan)
        known = np.isfinite(captured).all(axis=-1)
        if known.any():
            criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-10)
            lens: Any = self.distortion if len(self.distortion) else np.zeros(4)
            straight, same = np.eye(3), np.eye(3)
            ideal = cv2.undistortPointsIter(captured[known][:, None], self.matrix, lens, straight, same, criteria)
            result[known] = ideal.reshape(-1, 2)
        return result

    def check_size(self, image: Image) -> None:
        """Raises InputError unless an image (H, W) or (H, W, C) has the calibrated size."""
        height_px, width_px = image.shape[:2]
        if (width_px, height_px) != (self.width_px, self.height_px):
            raise InputError(
                f"{self.name} gives {width_px} x {height_px} px, calibrated are {self.width_px} x {self.height_px} px: "
                "set its resolution or calibrate it again"
            )

    def check_image(self, image: Image) -> None:
        """Raises InputError unless an image is (H, W, 3) uint8 and has the calibrated size."""
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise InputError(f"{self.name}: an image (H, W, 3) uint8 expected, found {image.shape} {image.dtype}")
        self.check_size(image)

    def undistort(self, image: Image) -> Image:
        """The image (H, W) or (H, W, C) with the lens distortion removed; the camera matrix is the same."""
        self.check_size(image)
        if not len(self.distortion):
            return image
        return cast(Image, cv2.remap(image, *self._maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))

    @cached_property
    def _maps(self) -> tuple[Any, Any]:
        size = (self.width_px, self.height_px)
        return cv2.initUndistortRectifyMap(self.matrix, self.distortion, None, self.matrix, size, cv2.CV_16SC2)

    @property
    def position(self) -> Floats:
        """Of the camera in the world, (3,), m."""
        turn, shift = self.camera_from_world[:3, :3], self.camera_from_world[:3, 3]
        result: Floats = -turn.T @ shift
        return result


def write_cameras(path: Path, cameras: Sequence[CalibratedCamera], square: float | None = None) -> None:
    """Write a calibration file, YAML with a list `cameras`, and the side of its board's squares, m, if it is known."""
    yaml = YAML()
    yaml.default_flow_style = None
    listed = [
        {
            "name": camera.name,
            "width_px": camera.width_px,
            "height_px": camera.height_px,
            "matrix": camera.matrix.tolist(),
            "distortion": camera.distortion.tolist(),
            "camera_from_world": camera.camera_from_world.tolist(),
        }
        for camera in cameras
    ]
    with replacing(path) as unfinished, unfinished.open("w", encoding="utf-8") as file:
        board = {} if square is None else {"square_m": square}
        yaml.dump({"world_frame": WORLD_FRAME, **board, "cameras": listed}, file)


def read_cameras(path: Path) -> tuple[CalibratedCamera, ...]:
    """The cameras of a calibration file. Raises InputError if the file is missing or not a calibration."""
    content = read_document(path, "calibration file", remedy="`paramove calibrate cameras` writes one").data
    listed = content.get("cameras")
    if not isinstance(listed, list) or not listed:
        raise InputError(f"{path}: a list 'cameras' expected; `paramove calibrate cameras` writes one")
    return tuple(_camera(path, number, entry) for number, entry in enumerate(listed))


def check_square_of(path: Path, square: float) -> None:
    """Raises InputError if a calibration file was made with squares of another side, m."""
    made_with = read_document(path, "calibration file").data.get("square_m")
    if isinstance(made_with, int | float) and abs(made_with - square) > SAME_SQUARE_M:
        raise InputError(
            f"{path} was made with squares of {1e3 * made_with:g} mm, given are {1e3 * square:g} mm: which board is it?"
        )


def _camera(path: Path, number: int, entry: Any) -> CalibratedCamera:
    expected = ("name", "width_px", "height_px", "matrix", "distortion", "camera_from_world")
    if not isinstance(entry, dict) or set(entry) != set(expected):
        found = sorted(map(str, entry)) if isinstance(entry, dict) else type(entry).__name__
        raise InputError(f"{path}: camera {number}: the keys {', '.join(expected)} expected, {found} found")
    try:
        arrays = [np.array(entry[key], dtype=np.float64) for key in expected[3:]]
        return CalibratedCamera(str(entry["name"]), int(entry["width_px"]), int(entry["height_px"]), *arrays)
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: camera {number}: {error}") from error


def measured_file(run_folder: Path, path: Path) -> Path:
    """The file in the run's folder if it exists there, else the path as given."""
    return run_folder / path if (run_folder / path).is_file() else path


def measured_cameras(run_folder: Path, path: Path) -> list[CalibratedCamera]:
    """The cameras of a calibration file, named camera_1, camera_2, ... in their order, as their topics are.

    Raises InputError for a file that is no calibration, or holds more than `MAX_CAMERAS`.
    """
    cameras = read_cameras(measured_file(run_folder, path))
    if len(cameras) > MAX_CAMERAS:
        raise InputError(f"{path}: {len(cameras)} cameras found, at most {MAX_CAMERAS} are used")
    return [replace(one, name=f"camera_{number}") for number, one in enumerate(cameras, start=1)]
