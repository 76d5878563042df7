"""Cameras and postures for the tests."""

import numpy as np

from paramove.cameras.calibrated import CalibratedCamera
from paramove.demonstrations import RESTING_SHOULDER
from paramove.observation import ArmSizes, fitted_poses

AROUND = ((1.7, 0.0, 0.9), (1.2, -1.2, 0.8), (0.3, -1.8, 0.7), (0.9, 1.1, 1.1))
"""Places of four cameras about the table, m."""


def camera_at(place, towards, *, width_px=320, height_px=240, fovy_deg=45.0, name="camera"):
    """A camera without distortion at a place, looking at a point, m."""
    forward = np.subtract(towards, place) / np.linalg.norm(np.subtract(towards, place))
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(forward, right), forward])
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3], camera_from_world[:3, 3] = turn, -turn @ np.asarray(place)
    focal = 0.5 * height_px / np.tan(0.5 * np.deg2rad(fovy_deg))
    matrix = np.array([[focal, 0.0, 0.5 * width_px - 0.5], [0.0, focal, 0.5 * height_px - 0.5], [0.0, 0.0, 1.0]])
    return CalibratedCamera(name, width_px, height_px, matrix, np.zeros(0), camera_from_world)


def four_cameras(**options):
    """Four views of the arm and the table before it."""
    return tuple(camera_at(place, (0.0, -0.15, 0.15), name=f"camera_{i}", **options) for i, place in enumerate(AROUND))


def some_poses(count, seed=0, sizes=None):
    """Valid postures with the hand over the table or beside it, (count, 9)."""
    rng = np.random.default_rng(seed)
    shoulder = RESTING_SHOULDER + 0.02 * rng.normal(size=(count, 3))
    hand = rng.uniform([-0.1, -0.5, 0.0], [0.3, 0.2, 0.4], (count, 3))
    elbow = 0.5 * (shoulder + hand) + rng.normal(size=(count, 3)) * [0.03, 0.05, 0.03] + [-0.05, -0.08, -0.1]
    return fitted_poses(np.concatenate([shoulder, elbow, hand], axis=1), sizes or ArmSizes())


def some_bent_poses(count, seed=0, sizes=None):
    """The same with bent wrists, (count, 12)."""
    poses, arm = some_poses(count, seed, sizes), sizes or ArmSizes()
    aside = 0.2 * arm.hand * np.random.default_rng(seed + 1).normal(size=(count, 3))
    share = arm.forearm / arm.lower_arm
    wrist = (1.0 - share) * poses[:, 3:6] + share * poses[:, 6:9] + aside
    return fitted_poses(np.concatenate([poses, wrist], axis=1), arm)
