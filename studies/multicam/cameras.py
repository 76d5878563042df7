"""Calibration file and videos of the recording `multicam_person` (Qualisys, four cameras)."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from paramove.cameras import CalibratedCamera
from paramove.documents import InputError, opened_video
from paramove.observation import BodyKeyPoints, stored_network

CALIBRATION = "Calib.qca.txt"
RATE_HZ = 60.0
LENS_UNITS = 64.0
"""Focal lengths and centres are in so many parts of a pixel; positions in mm."""
FROM_QUALISYS = np.diag([1.0, -1.0, -1.0])
"""Its cameras have y up and z backwards."""


def read_calibration(folder: Path) -> list[CalibratedCamera]:
    """The cameras. Raises InputError for a missing or damaged file."""
    path = folder / CALIBRATION
    try:
        return [_camera(one) for one in ElementTree.parse(path).getroot().iter("camera")]
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}", missing=True) from error
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"{path}: {error}; a calibration by Qualisys expected") from error


def _camera(element: ElementTree.Element) -> CalibratedCamera:
    def numbers(part: str, *names: str) -> list[float]:
        found = element.find(part)
        if found is None:
            raise LookupError(f"a camera without {part!r}")
        return [float(str(found.get(name))) for name in names]

    turn = np.array(numbers("transform", *(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3))))
    position = np.array(numbers("transform", "x", "y", "z")) / 1000.0
    focal = np.array(numbers("intrinsic", "focalLengthU", "focalLengthV")) / LENS_UNITS
    centre = np.array(numbers("intrinsic", "centerPointU", "centerPointV")) / LENS_UNITS
    lens = numbers(
        "intrinsic", "radialDistortion1", "radialDistortion2", "tangentalDistortion1", "tangentalDistortion2"
    )
    right, bottom = numbers("fov_video", "right", "bottom")
    pose = np.eye(4)
    pose[:3, :3] = FROM_QUALISYS @ turn.reshape(3, 3)
    pose[:3, 3] = -pose[:3, :3] @ position
    matrix = np.array([[focal[0], 0.0, centre[0]], [0.0, focal[1], centre[1]], [0.0, 0.0, 1.0]])
    name = str(element.get("serial"))
    return CalibratedCamera(name, int(right) + 1, int(bottom) + 1, matrix, np.array(lens), pose)


def moved_centre(camera: CalibratedCamera, offset_px: ArrayLike) -> CalibratedCamera:
    """The camera with its principal point moved, (2,), px."""
    matrix = camera.matrix.copy()
    matrix[:2, 2] += np.asarray(offset_px, dtype=np.float64)
    return replace(camera, matrix=matrix)


def detected(folder: Path, camera: CalibratedCamera, done: Callable[[str], None]) -> list[BodyKeyPoints]:
    """Key points of each image of a camera's video. Raises InputError."""
    capture, network = opened_video(folder / f"{camera.name}.mp4"), stored_network(offline=True)
    found: list[BodyKeyPoints] = []
    try:
        while True:
            good, image = capture.read()
            if not good:
                return found
            found.append(network.detect(np.asarray(image, dtype=np.uint8)))
            done(f"{camera.name}, image {len(found)}")
    finally:
        capture.release()
