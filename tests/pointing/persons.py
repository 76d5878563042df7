"""Arm poses of a person who points, reaches and does other things, as a body tracker tells them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from paramove.demonstrations import POINT_NAMES, SAMPLE_RATE_HZ, table_place
from paramove.demonstrations.movement_ends import Person
from paramove.msgs.arm_pose_pb2 import ArmPose

NAMES = ("elbow", "wrist", "index")
RATE_HZ = 15.0
NOISE_M = 0.004


def joined(movements: list[np.ndarray], rest_s: float = 1.0) -> np.ndarray:
    """Body points (T, 7, 3) at 60 Hz: a rest before, between and after the movements."""
    count = round(rest_s * SAMPLE_RATE_HZ)
    parts = [np.repeat(movements[0][:1], count, axis=0)]
    for number, movement in enumerate(movements):
        after = movements[number + 1][0] if number + 1 < len(movements) else movement[-1]
        share = np.linspace(0.0, 1.0, count)[:, None, None]
        parts += [movement, movement[-1] + share * (after - movement[-1])]
    return np.concatenate(parts)


def performed(action: str, places: list[tuple[float, float]], seed: int = 0) -> np.ndarray:
    """A person who does this at places (u, v) of the table one after the other. (T, 7, 3)."""
    rng = np.random.default_rng((71, seed))
    person = Person.drawn(rng)
    return joined([person.observed(action, table_place(place), rng)[0] for place in places])


def poses(body: np.ndarray, rate_hz: float = RATE_HZ, noise: float = NOISE_M, seed: int = 0) -> Iterator[ArmPose]:
    """What a body tracker says of body points (T, 7, 3) at 60 Hz."""
    rng = np.random.default_rng(seed)
    times, known = (
        np.arange(0.0, (len(body) - 1) / SAMPLE_RATE_HZ, 1.0 / rate_hz),
        np.arange(len(body)) / SAMPLE_RATE_HZ,
    )
    for time_s in times:
        pose = ArmPose(frame="table")
        pose.captured.FromNanoseconds(round(time_s * 1e9) + 1)
        for name in NAMES:
            path = body[:, POINT_NAMES.index(name)]
            x, y, z = (float(np.interp(time_s, known, column) + rng.normal(0.0, noise)) for column in path.T)
            pose.points.add(name=name, x=x, y=y, z=z)
        yield pose
