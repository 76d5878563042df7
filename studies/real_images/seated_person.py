"""Where the camera stands and how large the person is, all from the first frame of the recording alone.

World: x forward as the person faces, y to the person's left, z up, m; the origin is on the floor below the camera.
Every number is fixed before any other frame is scored. Pixels are (x, y) of the 640 x 480 image; "surface" is the depth
image there, median over 7 x 7 px.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from paramove.action_space import Person, PersonPlacement
from paramove.cameras import CalibratedCamera
from paramove.demonstrations import unit
from paramove.documents import Floats, InputError
from paramove.observation import ArmSizes, BodyKeyPoints, fitted_poses, measured_arm

INTRINSICS = "cam_params_realsense.json"

UP_IN_CAMERA = np.array([-0.0805, -0.9456, -0.3152])
"""Normal of the floor: plane through depths of rows 300 to 478, columns 250 to 600, RANSAC to 15 mm: 2606 of 3960."""
CAMERA_HEIGHT = 0.998
"""m over that plane."""
FACING = np.radians(10.0)
"""By so much the person faces to the own left of the camera: line between the surfaces of both shoulders, (222, 70) and
(312, 70), which is 0.32 m long."""
SHOULDER_PX, SHOULDER_DEPTH = (228.0, 72.0), 2.23
"""The joint: 13 px inside the outer edge of the sleeve; surface 2.18 m and 0.05 m of flesh and jacket."""
ELBOW_PX, ELBOW_DEPTH = (213.0, 150.0), 2.19
"""Middle of the sleeve where it bends; surface 2.15 m and 0.04 m."""
FINGERTIP_PX, FINGERTIP_DEPTH = (238.0, 200.0), 1.97
"""Lower end of the hand on the knee; surface 1.956 m and 0.01 m."""
SETTING_UP = 41
"""Frames from which a person without a ruler is measured."""
SIZES = ArmSizes(
    upper_arm=0.28,  # of a person of 1.70 m (shoulder 0.92 m over the floor when seated, knee 0.55 m); the sleeve
    forearm=0.25,  # foreshortens too much in frame 0 to be measured there
    hand=0.18,
    shoulder_radius=0.065,  # the sleeve is 30 px = 0.107 m wide at (215, 110), where the upper arm is in its middle
    elbow_radius=0.052,
    wrist_radius=0.040,  # cuff 25 px = 0.083 m at (225, 170)
    hand_width=0.090,  # 31 px = 0.098 m with the fingers a little spread
    hand_thickness=0.045,
)


def camera(folder: Path) -> CalibratedCamera:
    """The camera: lens from the recording's file, without distortion, pose from the floor of frame 0.

    Raises InputError where the file is missing or holds something else.
    """
    path = folder / INTRINSICS
    try:
        lens = json.loads(path.read_text(encoding="utf-8"))
        width, height = int(lens["width"]), int(lens["height"])
        matrix = np.array(lens["intrinsic_matrix"], dtype=np.float64).reshape(3, 3).T  # stored column by column
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file; the camera's lens is read from it", missing=True) from error
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise InputError(f"{path}: {error!r}; width, height and a 3 x 3 intrinsic_matrix expected") from error
    return CalibratedCamera("camera_1", width, height, matrix, np.zeros(0), _camera_from_world())


@dataclass(frozen=True)
class Measures:
    """Of the person. sizes: of the arm. resting: shoulder, elbow, fingertip with the hand on the knee, (9,), m."""

    sizes: ArmSizes
    resting: Floats

    @property
    def placement(self) -> PersonPlacement:
        """The resting shoulder and how large the arm is."""
        return PersonPlacement.of_arm(self.resting[:3], self.sizes.length)


def by_hand(camera: CalibratedCamera) -> Measures:
    """From the numbers above."""
    return Measures(SIZES, resting_pose(camera))


def without_ruler(camera: CalibratedCamera, key_points: Sequence[BodyKeyPoints], distance: float) -> Measures:
    """From key points of the first frames, with the shoulder's distance, m, as a board held at the chest gives it."""
    arm = measured_arm(camera, key_points[:SETTING_UP], distance=distance)
    person = Person(shoulder=tuple(arm.shoulder), upper_arm=arm.upper_arm, forearm=arm.forearm, hand=arm.hand)
    return Measures(person.sizes, fitted_poses(arm.resting[None], person.sizes)[0])


def resting_pose(camera: CalibratedCamera) -> Floats:
    """The pose with the hand on the knee, (9,), m, in the world: the points of frame 0, fitted to the arm's lengths."""
    points_px = ((SHOULDER_PX, SHOULDER_DEPTH), (ELBOW_PX, ELBOW_DEPTH), (FINGERTIP_PX, FINGERTIP_DEPTH))
    points = np.concatenate([in_world(pixel, depth, camera) for pixel, depth in points_px])
    return np.asarray(fitted_poses(points[None], SIZES)[0])


def in_world(pixel: tuple[float, float], depth: float, camera: CalibratedCamera) -> Floats:
    """The position (3,), m, of a pixel at a depth, m, along the camera's axis."""
    ray = np.linalg.solve(camera.matrix, np.array([*pixel, 1.0]))
    turn, shift = camera.camera_from_world[:3, :3], camera.camera_from_world[:3, 3]
    return np.asarray(turn.T @ (depth * ray - shift))


def in_camera(points: Floats, camera: CalibratedCamera) -> Floats:
    """Points (N, 3), m, of the world in the camera's frame."""
    return np.asarray(points @ camera.camera_from_world[:3, :3].T + camera.camera_from_world[:3, 3])


def _camera_from_world() -> Floats:
    up = unit(UP_IN_CAMERA)
    towards_camera = unit(np.array([0.0, 0.0, -1.0]) + up[2] * up)
    left = np.cross(up, towards_camera)
    forward = np.cos(FACING) * towards_camera + np.sin(FACING) * left
    result = np.eye(4)
    result[:3, :3] = np.stack([forward, np.cross(up, forward), up], axis=1)
    result[:3, 3] = -CAMERA_HEIGHT * up
    return result
