"""A model of pointing anywhere from a hand on the knee, trained on movements made by code.

Poses are in the models' frame and size (`paramove.demonstrations.synthetic`), where the person's arm is 0.705 m long.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from paramove.action_space import ActionModel, PersonPlacement, cached_action
from paramove.demonstrations import (
    FRAME,
    RESTING_SHOULDER,
    SAMPLE_RATE_HZ,
    Demonstrations,
    elbow_positions,
    swivel_towards,
    unit,
)
from paramove.documents import Floats
from paramove.hmm import minimum_jerk
from paramove.observation import POSE_POINTS, ArmSizes
from paramove.phmm import CubicPHMM, MovementDescription

NAME = "pointing_seated"
LEFTMOST, AZIMUTH_SPAN = np.radians(65.0), np.radians(160.0)
DOWNMOST, ELEVATION_SPAN = np.radians(-45.0), np.radians(105.0)
"""Directions of theta (u, v) in [0, 1]: from across the body to behind the right side, from below upwards, rad."""
COLUMNS, ROWS, REPETITIONS = 7, 5, 2
OUT_S, HOLD_S, BACK_S = 0.9, 2.0, 0.9
REACHES = (0.75, 0.985)
"""Fractions of the arm's length at which a fingertip points: nearly all of 405 movements of three other persons."""
SHOULDER_ALONG, SHOULDER_UP = 0.03, 0.04
"""m: the shoulder goes so far in the direction, and upwards with a raised arm."""
OUTWARD = 0.6
"""rad, swivel of the elbow of a pointing arm."""
REST_NOISE, SHOULDER_NOISE, SWIVEL_NOISE, DIRECTION_NOISE, SENSOR_NOISE = 0.015, 0.015, 0.3, 0.03, 0.001


def direction_place(theta: ArrayLike, distance: float = 2.0) -> Floats:
    """The position (..., 3), m, so far from the resting shoulder in the direction theta (..., 2)."""
    u, v = np.moveaxis(np.asarray(theta, dtype=np.float64), -1, 0)
    azimuth, elevation = LEFTMOST - AZIMUTH_SPAN * u, DOWNMOST + ELEVATION_SPAN * v
    flat = np.cos(elevation)
    line = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=-1)
    return np.asarray(RESTING_SHOULDER + distance * line)


def pointing_action(sizes: ArmSizes, at_rest: ArrayLike, placement: PersonPlacement,
                    folder: Path | None = None) -> ActionModel:  # fmt: skip
    """The trained action, cached for the user.

    Args:
        sizes: of the person's arm, m. at_rest: (9,), the pose with the hand on the knee, m, in the world.
        placement: of the person.
    """
    rest = placement.in_model(np.asarray(at_rest, dtype=np.float64))
    arm = sizes.scaled(1.0 / placement.scale)
    numbers = np.round([*rest, arm.upper_arm, arm.lower_arm], 4).tolist()
    source = f"seated pointing, made by code, {numbers}"
    return cached_action(
        NAME, source, lambda: demonstrations(arm, rest), kind=CubicPHMM, folder=folder, target=direction_place
    )


def demonstrations(arm: ArmSizes, rest: Floats, seed: int = 0) -> Demonstrations:
    """From the knee to a grid of directions and back, theta (u, v)."""
    rng = np.random.default_rng(seed)
    grid = [(u, v) for u in np.linspace(0.0, 1.0, COLUMNS) for v in np.linspace(0.0, 1.0, ROWS)]
    theta = np.repeat(np.array(grid), REPETITIONS, axis=0)
    sequences = [movement(target, arm, rest, rng) for target in theta]
    description = MovementDescription(
        NAME, POSE_POINTS, "m", FRAME, ("u", "v"), OUT_S + HOLD_S + BACK_S, rate_hz=SAMPLE_RATE_HZ
    )
    return Demonstrations(sequences, theta, description)


def movement(theta: Floats, arm: ArmSizes, rest: Floats, rng: np.random.Generator) -> Floats:
    """One movement, poses (T, 9) at 60 Hz: out, held, back. The hand goes about the shoulder as its distance grows."""
    total = OUT_S + HOLD_S + BACK_S
    times = np.arange(round(total * SAMPLE_RATE_HZ) + 1) / SAMPLE_RATE_HZ
    fraction = (minimum_jerk(times, 0.0, OUT_S) - minimum_jerk(times, OUT_S + HOLD_S, total))[:, None]
    begun = rest[6:] - rest[:3] + REST_NOISE * rng.standard_normal(3)
    meant = unit(direction_place(theta) - RESTING_SHOULDER)
    towards = unit(meant + DIRECTION_NOISE * rng.standard_normal(3))
    reach = arm.length * rng.uniform(*REACHES)
    line = unit((1.0 - fraction) * unit(begun) + fraction * towards)
    distance = (1.0 - fraction) * np.linalg.norm(begun) + fraction * reach
    moved = SHOULDER_ALONG * towards + np.array([0.0, 0.0, SHOULDER_UP * max(0.0, 0.5 + towards[2])])
    shoulder = rest[:3] + SHOULDER_NOISE * rng.standard_normal(3) + fraction * moved
    hand = shoulder + distance * line
    resting = swivel_towards(rest[3:6], rest[:3], rest[6:])
    swivel = (1.0 - fraction[:, 0]) * resting + fraction[:, 0] * OUTWARD + SWIVEL_NOISE * rng.standard_normal()
    elbow = elbow_positions(shoulder, hand, arm.upper_arm, np.full(len(times), arm.lower_arm), swivel)
    poses = np.concatenate([shoulder, elbow, hand], axis=1)
    return np.asarray(poses + SENSOR_NOISE * rng.standard_normal(poses.shape))
