"""The pose of a calibrated camera in the table frame, from images in which the board lies on the table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from paramove.cameras.calibrated import CalibratedCamera
from paramove.cameras.calibration import CalibrationError, Lens
from paramove.cameras.charuco_board import Board, BoardView
from paramove.documents import Floats

MIN_NOISE_PX = 0.05
"""Minimum standard deviation of detected corners, also where few corners suggest less."""
MAX_MOTION_PX = 2.0
"""Maximum motion of a corner between two images of the table; more means that board or camera was moved."""
CLEARER = 1.3
"""The mirrored pose of a plane (Collins and Bartoli 2014) must fit worse by this factor, or be about the same pose."""
SAME_TILT_DEG = 3.0
DISTANCES = (0.1, 8.0)
"""m; distances outside indicate a wrong size of the squares rather than a camera at a table."""


@dataclass(frozen=True)
class Placement:
    """Pose of one camera.

    Attributes:
        camera: With lens and pose.
        error_px: Root mean square reprojection error of the table board's corners.
        position_sd: Standard deviation of the camera's position, m, from the corners' noise and the lens.
        turn_sd_deg: Of its direction.
    """

    camera: CalibratedCamera
    error_px: float
    position_sd: float
    turn_sd_deg: float


def place_camera(lens: Lens, views: Sequence[BoardView], board: Board) -> Placement:
    """Pose of a camera from one or several views of the board on the table; neither may move in between.

    Raises CalibrationError: no view, another resolution, a board that was moved, an ambiguous tilt, a distance
    that no camera at a table has.
    """
    _check_views(lens, views)
    on_table = np.vstack([board.corners()[view.corner_ids] for view in views])
    in_image = np.vstack([view.points for view in views])
    rotation, shift = _best_pose(lens, on_table, in_image)
    projected, jacobian = cv2.projectPoints(on_table, rotation, shift, lens.matrix, lens.distortion)
    error_px = float(np.sqrt(np.mean(np.sum((projected.reshape(-1, 2) - in_image) ** 2, axis=1))))
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3] = cv2.Rodrigues(rotation)[0]
    camera_from_world[:3, 3] = shift.ravel()
    camera = CalibratedCamera(lens.name, *lens.size, lens.matrix, lens.distortion, camera_from_world)
    distance = float(np.linalg.norm(camera.position - on_table.mean(axis=0)))
    if not DISTANCES[0] < distance < DISTANCES[1]:
        raise CalibrationError(
            f"{lens.name}: the camera would be {distance:.2f} m from the board; {DISTANCES[0]:g} to {DISTANCES[1]:g} m "
            f"expected: is a square really {board.square * 1000:g} mm wide? Measure it and give it by --square"
        )
    noise = max(error_px / np.sqrt(2.0), MIN_NOISE_PX)
    turn_sd, position_sd = _deviations(np.asarray(jacobian[:, :6], dtype=np.float64), rotation, shift, noise)
    position_sd = float(np.hypot(position_sd, distance * lens.focal_sd_px / lens.matrix[0, 0]))
    turn_sd = float(np.hypot(turn_sd, np.rad2deg(lens.centre_sd_px / lens.matrix[0, 0])))
    return Placement(camera, error_px, position_sd, turn_sd)


def board_depth(camera: CalibratedCamera, view: BoardView, board: Board) -> float:
    """Depth of the middle of a board that is held before a calibrated camera, m along its axis."""
    corners = board.corners()[view.corner_ids]
    _, rotation, shift = cv2.solvePnP(corners, view.points, camera.matrix, camera.distortion)
    middle = cv2.Rodrigues(rotation)[0] @ board.corners().mean(axis=0) + shift.ravel()
    return float(middle[2])


def _check_views(lens: Lens, views: Sequence[BoardView]) -> None:
    if not views:
        raise CalibrationError(
            f"{lens.name}: the board on the table was not found: lay it down as its text describes, wholly in the "
            "camera's view, and take an image of it (in a folder: a name that begins with 'table')"
        )
    for view in views:
        if view.size != lens.size:
            raise CalibrationError(
                f"{lens.name}: different resolutions: {view.name} has {view.size[0]} x {view.size[1]} px, "
                f"the lens was calibrated with {lens.size[0]} x {lens.size[1]} px"
            )
        both, here, there = np.intersect1d(view.corner_ids, views[0].corner_ids, return_indices=True)
        motion = np.linalg.norm(view.points[here] - views[0].points[there], axis=1) if len(both) else np.zeros(1)
        if float(np.median(motion)) > MAX_MOTION_PX:
            raise CalibrationError(
                f"{lens.name}: between {views[0].name} and {view.name} the board on the table or the camera moved by "
                f"{float(np.median(motion)):.0f} px: take all images of the table from the same position"
            )


def _best_pose(lens: Lens, on_table: Floats, in_image: Floats) -> tuple[Any, Any]:
    """Rotation vector and translation of the better of the two possible poses of a plane, refined."""
    level = on_table - [0.0, 0.0, on_table[0, 2]]
    count, rotations, shifts, _ = cv2.solvePnPGeneric(
        level, in_image, lens.matrix, lens.distortion, flags=cv2.SOLVEPNP_IPPE
    )
    candidates = []
    for rotation, shift in zip(rotations[:count], shifts[:count], strict=True):
        lifted = shift - cv2.Rodrigues(rotation)[0] @ np.array([[0.0], [0.0], [on_table[0, 2]]])
        pose = cv2.solvePnPRefineLM(on_table, in_image, lens.matrix, lens.distortion, rotation, lifted)
        projected, _ = cv2.projectPoints(on_table, *pose, lens.matrix, lens.distortion)
        candidates.append((float(np.sqrt(np.mean((projected.reshape(-1, 2) - in_image) ** 2))), pose))
    candidates.sort(key=lambda one: one[0])
    if len(candidates) > 1:
        (best, pose), (other, mirrored) = candidates[:2]
        between = cv2.Rodrigues(pose[0])[0] @ cv2.Rodrigues(mirrored[0])[0].T
        angle = np.rad2deg(np.linalg.norm(cv2.Rodrigues(between)[0]))
        if other < CLEARER * max(best, MIN_NOISE_PX) and angle > SAME_TILT_DEG:
            raise CalibrationError(
                f"{lens.name}: the board on the table looks too small to determine its tilt (two poses {angle:.0f} deg "
                "apart fit equally): move the camera nearer, use a larger board or a higher resolution"
            )
    return candidates[0][1]


def _deviations(jacobian: Floats, rotation: Any, shift: Any, noise_px: float) -> tuple[float, float]:
    """Standard deviations of the direction, deg, and of the position, m, from d(pixels)/d(rotation, translation)."""
    covariance = noise_px**2 * np.linalg.inv(jacobian.T @ jacobian)
    position_by_pose = np.empty((3, 6))
    step = 1e-6
    for column in range(6):
        moved = np.concatenate([rotation.ravel(), shift.ravel()])
        moved[column] += step
        position_by_pose[:, column] = (
            _position(moved) - _position(np.concatenate([rotation.ravel(), shift.ravel()]))
        ) / step
    position_covariance = position_by_pose @ covariance @ position_by_pose.T
    return float(np.rad2deg(np.sqrt(np.trace(covariance[:3, :3])))), float(np.sqrt(np.trace(position_covariance)))


def _position(pose: Floats) -> Floats:
    return np.asarray(-cv2.Rodrigues(pose[:3])[0].T @ pose[3:], dtype=np.float64)
