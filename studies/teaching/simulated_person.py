"""A simulated person who touches positions on a table, and the key points that a pose network would detect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike

from paramove.action_space import arm_poses
from paramove.cameras import CalibratedCamera
from paramove.demonstrations import SAMPLE_RATE_HZ, Demonstrator, Variation
from paramove.documents import Floats
from paramove.observation import ArmSizes, BodyKeyPoints, KeyPointOptions

CROP_M = 1.85
"""Side of the network's crop at the person's distance, m, as on real pictures of a seated person."""
CROP_PX = 256
NOISE_PX = np.array([2.4, 3.0, 2.7, 1.65])
"""Deviation of shoulder, elbow, wrist, hand, px of the crop (the hand by the hand's network)."""
CORRELATED_S = 0.2
"""Errors of images that follow each other are alike: time constant of their correlation."""
RATE_HZ = 15.0
REST_S, HOLD_S = 1.0, 1.0
SIZES = ArmSizes()
STILL = Variation(**dict.fromkeys((field.name for field in fields(Variation)), 0.0))
"""Of the mean movement."""


def movement(target: ArrayLike, rng: np.random.Generator) -> Floats:
    """Poses (T, 9) at `RATE_HZ`: a rest, to the target, held there, back, a rest."""
    pose = arm_poses(Demonstrator().demonstrate("pointing", np.asarray(target, dtype=np.float64), rng))
    return _with_rests(pose, np.asarray(target, dtype=np.float64))


def mean_path(target: ArrayLike, count: int) -> Floats:
    """The fingertip's path out to the target of the person without variation, (count, 3), m, equally spaced in time."""
    still = Demonstrator(variation=STILL)
    pose = arm_poses(still.demonstrate("pointing", np.asarray(target, dtype=np.float64), np.random.default_rng(0)))
    out = pose[: _arrival(pose, np.asarray(target, dtype=np.float64)) + 1, 6:9]
    at = np.linspace(0.0, len(out) - 1.0, count)
    return np.stack([np.interp(at, np.arange(len(out)), column) for column in out.T], axis=1)


def _arrival(pose: Floats, target: Floats) -> int:
    return int(np.linalg.norm(pose[:, 6:9] - target, axis=1).argmin())


def _with_rests(pose: Floats, target: Floats) -> Floats:
    arrived = _arrival(pose, target)
    out = pose[: arrived + 1]
    rest, hold = (
        np.repeat(row[None], round(s * SAMPLE_RATE_HZ), axis=0) for row, s in ((out[0], REST_S), (out[-1], HOLD_S))
    )
    whole = np.concatenate([rest, out, hold, out[::-1], rest])
    at = np.arange(0.0, len(whole) - 1.0, SAMPLE_RATE_HZ / RATE_HZ)
    return np.stack([np.interp(at, np.arange(len(whole)), column) for column in whole.T], axis=1)


def key_points(
    poses: Floats, camera: CalibratedCamera, rng: np.random.Generator, options: KeyPointOptions | None = None
) -> list[BodyKeyPoints]:
    """Of poses (T, 9) at `RATE_HZ`: correlated noise, outliers, exchanged sides, and depths with a constant error."""
    options = options or KeyPointOptions()
    shoulder, elbow, tip = poses[:, :3], poses[:, 3:6], poses[:, 6:9]
    wrist = elbow + SIZES.forearm / SIZES.lower_arm * (tip - elbow)
    right = np.stack([shoulder, elbow, wrist, 0.5 * (wrist + tip)], axis=1)
    left = right + np.array([0.0, 0.36, 0.0])
    left[:, 1:] = left[:1, :1] + np.array([[0.0, 0.02, -0.26], [0.03, 0.02, -0.50], [0.05, 0.02, -0.58]])
    arms = np.stack([right, left], axis=1)  # (T, 2, 4, 3)
    ahead = arms @ camera.camera_from_world[2, :3] + camera.camera_from_world[2, 3]
    scale = CROP_M * camera.matrix[0, 0] / float(np.median(ahead)) / CROP_PX
    deviations = np.tile(NOISE_PX * scale, (2, 1))
    noise = _correlated(rng, (*arms.shape[:3], 2)) * deviations[None, :, :, None]
    outliers = rng.random(arms.shape[:3]) < options.outlier
    noise[outliers] += rng.normal(0.0, 30.0 * scale, (int(outliers.sum()), 2))
    pixels = camera.project(arms) + noise
    behind = (
        ahead - ahead[..., :1] + rng.normal(0.0, np.where(np.isfinite(options.depths), options.depths, 0.0), (2, 4))
    )
    swapped = rng.random(len(poses)) < options.exchanged
    found = [
        BodyKeyPoints(px, deviations, depth, np.ones((2, 4)), 1.0) for px, depth in zip(pixels, behind, strict=True)
    ]
    return [one.exchanged() if swap else one for one, swap in zip(found, swapped, strict=True)]


def _correlated(rng: np.random.Generator, shape: Sequence[int]) -> Floats:
    """Unit noise along the first axis, correlated over `CORRELATED_S`."""
    remaining, white = float(np.exp(-1.0 / (RATE_HZ * CORRELATED_S))), rng.standard_normal(shape)
    for frame in range(1, len(white)):
        white[frame] = remaining * white[frame - 1] + np.sqrt(1.0 - remaining**2) * white[frame]
    return white
