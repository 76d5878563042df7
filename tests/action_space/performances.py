"""Performances of the synthetic demonstrator, measured in world coordinates instead of images."""

from __future__ import annotations

import numpy as np

from paramove.action_space.training import arm_poses
from paramove.demonstrations import Demonstrator, table_place
from paramove.demonstrations.synthetic import SAMPLE_RATE_HZ

PERSON = Demonstrator()


def performed(places, rng, rate_hz, pause_s=0.5):
    """Times (T,) and model-frame poses (T, 9) of pointing at each of `places` (K, 2), with rests in the base pose."""
    parts = []
    for place in places:
        pose = arm_poses(PERSON.demonstrate("pointing", table_place(place), rng))
        rest = np.repeat(pose[:1], round(pause_s * SAMPLE_RATE_HZ), axis=0)
        parts += [rest, pose] if not parts else [blend(parts[-1][-1], pose[0], len(rest)), pose]
    movement = np.concatenate(parts)
    times = np.arange(0.0, (len(movement) - 1) / SAMPLE_RATE_HZ, 1.0 / rate_hz)
    columns = [np.interp(times * SAMPLE_RATE_HZ, np.arange(len(movement)), column) for column in movement.T]
    return times, np.stack(columns, axis=1)


def blend(first, last, n_frames):
    """From one base pose to the next."""
    share = np.linspace(0.0, 1.0, n_frames)[:, None]
    return (1.0 - share) * first + share * last


def gaussian(pose, deviation_m=0.04):
    """Log-likelihoods of poses where a sensor in the world sees `pose`."""
    return lambda poses: -0.5 * ((poses - pose) ** 2).sum(axis=1) / deviation_m**2
