"""How far the estimated hand is from the reference, in the image and in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats, InputError, Ints, read_arrays
from paramove.observation import BodyKeyPoints
from studies.real_images import seated_person
from studies.real_images.replay import ReplayedEstimate
from studies.real_images.seated_person import SIZES

REFERENCE = "hand_reference.npz"
DEPTH_IMAGES = "depth"
RANGES = {"frames 6-9": (6, 9), "frames 32-50": (32, 50), "frames 43-49": (43, 49)}
"""First and last frame: the arm points to its right; it slides across the body and up; within that it swings past the
line of sight."""
FAR_PX = 50.0
PATCH_PX = 3
FLESH_M = 0.05
"""The joint of the shoulder lies so far behind the surface of the sleeve."""


@dataclass(frozen=True)
class Reference:
    """What is compared with.

    Attributes:
        pixels: Middle of the hand's skin in each frame, detected by its colour, (T, 2), px.
        hand: The same in space, on the surface, (T, 3), m, in the camera's frame.
        shoulder: The network's shoulder in the depth image, behind the sleeve, (T, 3), m, likewise; NaN without depth.
    """

    pixels: Floats
    hand: Floats
    shoulder: Floats


@dataclass(frozen=True)
class Distances:
    """Of one replay, for each frame that was tracked.

    Attributes:
        frames: Numbers, (T,).
        pixels: Distance of the middle of the hand from the reference, (T,), px.
        hand, from_shoulder: The same in space, of its position and of its position from the shoulder, (T,), m.
        direction: Angle between the directions from shoulder to hand, (T,), rad.
        lost: Frames in which the tracker reported the arm as lost, (T,).
    """

    frames: Ints
    pixels: Floats
    hand: Floats
    from_shoulder: Floats
    direction: Floats
    lost: NDArray[np.bool_]

    def numbers(self, all_frames: int) -> dict[str, Any]:
        """Medians in each range and in all frames, and how many frames of each are far off or lost."""
        numbers: dict[str, Any] = {}
        for name, (first, last) in {**RANGES, "all frames": (0, all_frames - 1)}.items():
            rows = (self.frames >= first) & (self.frames <= last)
            missing = np.full(last - first + 1 - int(rows.sum()), np.inf)  # a frame without an estimate is far off
            pixels, hand, relative, direction = (
                np.append(one[rows], missing) for one in (self.pixels, self.hand, self.from_shoulder, self.direction)
            )
            numbers[name] = {
                "median_px": _finite(np.median(pixels)),
                "far_frames": int((pixels > FAR_PX).sum()),
                "lost_frames": int(self.lost[rows].sum()) + len(missing),
                "hand_cm": _finite(100.0 * np.median(hand)),
                "from_shoulder_cm": _finite(100.0 * np.median(relative)),
                "direction_deg": _finite(np.degrees(np.median(direction))),
            }
        return numbers


def read_reference(folder: Path, camera: CalibratedCamera, key_points: Sequence[BodyKeyPoints]) -> Reference:
    """Of a recording; the shoulder by the key points of each frame. Raises InputError."""
    path = folder / REFERENCE
    try:
        arrays = read_arrays(path, "reference positions of the hand")
        pixels, hand = (np.asarray(arrays[name], dtype=np.float64) for name in ("uv", "xyz_m"))
    except (ValueError, KeyError, TypeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: {error}; arrays uv (frames, 2) and xyz_m (frames, 3) expected") from error
    if pixels.ndim != 2 or pixels.shape[1] != 2 or hand.shape != (len(pixels), 3):
        raise InputError(
            f"{path}: uv of shape {pixels.shape} and xyz_m {hand.shape} found, (frames, 2) and (frames, 3) expected"
        )
    shoulders = [_shoulder(folder, camera, frame, points) for frame, points in enumerate(key_points[: len(pixels)])]
    return Reference(pixels, hand, np.array([*shoulders, *np.full((len(pixels) - len(shoulders), 3), np.nan)]))


def _shoulder(folder: Path, camera: CalibratedCamera, frame: int, points: BodyKeyPoints) -> Floats:
    depth = cv2.imread(str(folder / DEPTH_IMAGES / f"{frame:05d}.png"), cv2.IMREAD_UNCHANGED)
    at = points.positions[0, 0]
    if depth is None or not np.isfinite(at).all():
        return np.full(3, np.nan)
    x, y = at.astype(int)
    patch = depth[max(y - PATCH_PX, 0) : y + PATCH_PX + 1, max(x - PATCH_PX, 0) : x + PATCH_PX + 1]
    if not patch.any():
        return np.full(3, np.nan)
    ray = np.linalg.solve(camera.matrix, np.array([*at, 1.0]))
    return np.asarray((np.median(patch[patch > 0]) / 1000.0 + FLESH_M) * ray)


def middle_of_hand(poses: ArrayLike) -> Floats:
    """Half-way between wrist and tip of the index finger of poses (M, 9), m; (M, 3), m.

    The reference is the middle of the visible skin, not the fingertip.
    """
    points = np.atleast_2d(np.asarray(poses, dtype=np.float64))
    fraction = (SIZES.forearm + 0.5 * SIZES.hand) / SIZES.lower_arm
    return np.asarray(points[:, 3:6] + fraction * (points[:, 6:9] - points[:, 3:6]))


def distances(estimates: Sequence[ReplayedEstimate], reference: Reference, camera: CalibratedCamera) -> Distances:
    """Of the estimated hand from the reference. Raises InputError where they are not of the same frames."""
    frames = np.array([one.frame for one in estimates], dtype=np.int64)
    if len(frames) == 0 or frames.max() >= len(reference.pixels):
        raise InputError(f"{len(reference.pixels)} frames have a reference, frames {frames.tolist()} were tracked")
    poses = np.array([one.pose for one in estimates])
    middle = middle_of_hand(poses)
    hand, shoulder = (seated_person.in_camera(points, camera) for points in (middle, poses[:, :3]))
    arm, true_arm = hand - shoulder, (reference.hand - reference.shoulder)[frames]
    lengths = np.linalg.norm(arm, axis=1) * np.linalg.norm(true_arm, axis=1)
    return Distances(
        frames,
        pixels=np.linalg.norm(camera.project(middle) - reference.pixels[frames], axis=1),
        hand=np.linalg.norm(hand - reference.hand[frames], axis=1),
        from_shoulder=np.linalg.norm(arm - true_arm, axis=1),
        direction=np.arccos(np.clip((arm * true_arm).sum(axis=1) / lengths, -1.0, 1.0)),
        lost=np.array([one.lost for one in estimates]),
    )


def network_alone(key_points: Sequence[BodyKeyPoints], reference: Reference) -> Distances:
    """Of the middle of the hand as the network detects it, which is not in space."""
    frames = np.arange(min(len(key_points), len(reference.pixels)))
    pixels = np.array([points.positions[0, 3] for points in key_points[: len(frames)]])
    lost = ~np.isfinite(pixels).all(axis=1)
    off = np.where(lost, np.inf, np.linalg.norm(pixels - reference.pixels[frames], axis=1))
    nowhere = np.full(len(frames), np.inf)
    return Distances(frames, off, nowhere, nowhere, nowhere, lost)


def _finite(value: np.floating[Any]) -> float | None:
    return round(float(value), 1) if np.isfinite(value) else None
