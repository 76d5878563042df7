"""Images of an arm drawn as a bright shape, for cameras around a table; and what a run needs beside them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from paramove.action_space.training import table_action_demonstrations, train_action
from paramove.cameras.calibrated import CalibratedCamera, write_cameras
from paramove.observation.arm_body import ArmSizes
from paramove.observation.arm_observer import ArmObserver
from tests.action_space.performances import performed

WIDTH, HEIGHT = 160, 120
MIDDLE = np.array([0.0, -0.15, 0.15])
PLACES = ((0.3, -1.8, 0.85), (1.15, -0.5, 1.6))
RATE_HZ = 15.0


def camera(number: int) -> CalibratedCamera:
    """camera_1 or camera_2, looking at the person's arm."""
    position = np.array(PLACES[number - 1])
    z = (MIDDLE - position) / np.linalg.norm(MIDDLE - position)
    x = np.cross(z, (0.0, 0.0, 1.0))
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(z, x), z])
    pose[:3, 3] = -pose[:3, :3] @ position
    matrix = np.array([[170.0, 0.0, (WIDTH - 1) / 2], [0.0, 170.0, (HEIGHT - 1) / 2], [0.0, 0.0, 1.0]])
    return CalibratedCamera(f"camera_{number}", WIDTH, HEIGHT, matrix, np.zeros(0), pose)


def write_setup(folder: Path, cameras: int = 1) -> dict[str, object]:
    """Calibration and a small model in a folder; the parameters of a tracker that uses them."""
    write_cameras(folder / "cameras.yaml", [camera(number) for number in range(1, cameras + 1)])
    shown = table_action_demonstrations("pointing", columns=3, rows=3, repetitions=2)
    train_action(shown, n_states=30).save(folder / "pointing.npz")
    return {"cameras": folder / "cameras.yaml", "actions": (str(folder / "pointing.npz"),), "particles": 150}


def drawn(poses: np.ndarray, seen_by: CalibratedCamera) -> Iterator[np.ndarray]:
    """BGR images of poses (T, 9), with a little noise."""
    observer = ArmObserver(ArmSizes(), [seen_by], threads=1)
    noise = np.random.default_rng(3)
    for pose in poses:
        image = np.full((HEIGHT, WIDTH, 3), 60, np.uint8)
        cv2.fillPoly(image, [observer.outline(pose, 0).round().astype(np.int32)], (190, 200, 210))
        yield cv2.add(image, noise.integers(0, 6, image.shape, dtype=np.uint8))


def pointing(place: tuple[float, float] = (0.4, 0.6)) -> tuple[np.ndarray, np.ndarray]:
    """Times (T,) and poses (T, 9) of pointing once at a place (u, v)."""
    return performed([place], np.random.default_rng(11), RATE_HZ)
