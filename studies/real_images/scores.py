"""How far the estimated hand is from the reference, in the image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats, InputError, Ints, read_arrays
from paramove.observation import fitted_poses
from studies.real_images.replay import ReplayedEstimate
from studies.real_images.seated_person import SIZES

REFERENCE = "hand_reference.npz"
GOAL_PX = 25.0
RANGES = {"frames 6-9": (6, 9), "frames 32-50": (32, 50)}
"""First and last frame: the arm points to its right, and slides across the body and up."""
FAR_PX = 50.0


@dataclass(frozen=True)
class Distances:
    """Of one replay, for each frame that was tracked.

    Attributes:
        frames: numbers, (T,). middle, tip: distance of the middle of the hand, and of the tip of the index finger,
            from the reference, (T,), px.
        lost: frames in which the tracker reported the arm as lost, (T,).
    """

    frames: Ints
    middle: Floats
    tip: Floats
    lost: NDArray[np.bool_]

    def numbers(self) -> dict[str, Any]:
        """Medians of the ranges and of all frames, and in how many frames of each the hand is far off."""
        numbers: dict[str, Any] = {}
        for name, (first, last) in {**RANGES, "all frames": (0, int(self.frames.max(initial=0)))}.items():
            rows = (self.frames >= first) & (self.frames <= last)
            missing = last - first + 1 - int(rows.sum())
            padding = np.full(missing, np.inf)  # a frame without an estimate is far off
            middle, tip = np.append(self.middle[rows], padding), np.append(self.tip[rows], padding)
            numbers[name] = {
                "median_px": _finite(np.median(middle)),
                "median_of_tip_px": _finite(np.median(tip)),
                "frames": last - first + 1,
                "far_frames": int((middle > FAR_PX).sum()),
                "frames_said_to_be_lost": int(self.lost[rows].sum()),
            }
        return numbers


def read_reference(folder: Path) -> Floats:
    """Middle of the hand's skin in each frame, (T, 2), px. Raises InputError."""
    path = folder / REFERENCE
    try:
        positions = np.asarray(read_arrays(path, "reference of where the hand is seen")["uv"], dtype=np.float64)
    except (ValueError, KeyError, TypeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: {error}; an array uv (frames, 2) expected") from error
    if positions.ndim != 2 or positions.shape[1] != 2:
        raise InputError(f"{path}: uv of shape {positions.shape} found, (frames, 2) expected")
    return positions


def middle_of_hand(poses: ArrayLike) -> Floats:
    """Half-way between wrist and tip of the index finger of poses (M, 9), m; (M, 3), m.

    The reference is the middle of the visible skin, not the fingertip.
    """
    fitted = fitted_poses(np.atleast_2d(np.asarray(poses, dtype=np.float64)), SIZES)
    fraction = (SIZES.forearm + 0.5 * SIZES.hand) / SIZES.lower_arm
    return np.asarray(fitted[:, 3:6] + fraction * (fitted[:, 6:9] - fitted[:, 3:6]))


def distances(estimates: Sequence[ReplayedEstimate], reference: Floats, camera: CalibratedCamera) -> Distances:
    """Of the estimated hand from the reference. Raises InputError where they are not of the same frames."""
    frames = np.array([one.frame for one in estimates], dtype=np.int64)
    if len(frames) == 0 or frames.max() >= len(reference):
        raise InputError(f"{len(reference)} frames have a reference, frames {frames.tolist()} were tracked")
    poses = np.array([one.pose for one in estimates])
    middle = np.linalg.norm(camera.project(middle_of_hand(poses)) - reference[frames], axis=1)
    tip = np.linalg.norm(camera.project(poses[:, 6:9]) - reference[frames], axis=1)
    return Distances(frames, middle, tip, np.array([one.lost for one in estimates]))


def is_met(runs: Sequence[dict[str, Any]]) -> bool:
    """Whether each run, one for each seed, meets the goal in both ranges."""
    medians = [run[name]["median_px"] for run in runs for name in RANGES]
    return bool(medians) and all(median is not None and median <= GOAL_PX for median in medians)


def _finite(value: np.floating[Any]) -> float | None:
    return round(float(value), 1) if np.isfinite(value) else None
