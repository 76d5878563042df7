"""The last part of reaching and pointing movements, as a body tracker sees them of several persons (paper 5.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from paramove.demonstrations.arm import POINT_NAMES, ArmLengths
from paramove.demonstrations.movement import at_times
from paramove.demonstrations.synthetic import (
    RESTING_SHOULDER,
    SAMPLE_RATE_HZ,
    Action,
    Demonstrator,
    Timing,
    table_targets,
)
from paramove.documents import Floats, Ints

FRAMES = 24
"""Number of frames of a last part, of any duration."""
APPROACH_FRACTION, STAY_FRACTION = 0.5, 0.3
"""The last part: the last half of the approach's time, and 0.3 of that time at the target, or until the hand leaves."""
THERE_M, AWAY_M = 0.02, 0.03
"""m. Distances at which the hand is at the target, and has left its start."""
OFFSET_M = {"elbow": 0.010, "wrist": 0.003, "index": 0.003}
"""Standard deviation, along each axis, of the constant offset of a tracked point from its joint. An elbow is tracked
from outside."""
CAMERA_HZ = 15.0
NOISE_M = 0.005
"""Standard deviation of each coordinate of a tracked point. With more noise, grasping hands look like pointing."""


@dataclass(frozen=True)
class Person:
    """A person whose position and movements differ from the demonstrator's by what measuring leaves unknown.

    Attributes:
        demonstrator: with own lengths and timing.
        swivel: angle about the line from shoulder to fingertip by which the elbow is carried higher, rad.
        offset: error of the measured shoulder, (3,), m. size: the true over the measured length of the arm.
        tracking_offsets: of each tracked point from its body point, (7, 3), m.
    """

    demonstrator: Demonstrator
    swivel: float
    offset: Floats
    size: float
    tracking_offsets: Floats

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Person:
        """Proportions within 3 %, half again as slow to a quarter faster, elbows up to 11 degrees higher or lower."""
        usual, timing = ArmLengths(), Timing()
        upper, lower, hand = rng.uniform(0.97, 1.03, 3)
        lengths = ArmLengths(
            upper * usual.upper_arm, lower * usual.forearm, hand * usual.grasp, hand * usual.fingertip
        )  # fmt: skip
        timing = replace(
            timing,
            duration=timing.duration * float(rng.uniform(0.75, 1.5)),
            arrive=timing.arrive + float(rng.uniform(-0.04, 0.03)),
        )
        person = Demonstrator(lengths, timing=timing)
        scatter = np.array([OFFSET_M.get(name, 0.0) for name in POINT_NAMES])
        tracking_offsets = scatter[:, None] * rng.standard_normal((len(POINT_NAMES), 3))
        offset, size = rng.normal(0.0, 0.006, 3), float(rng.uniform(0.98, 1.02))
        return cls(person, float(rng.uniform(-0.2, 0.2)), offset, size, tracking_offsets)

    def observed(self, action: Action, target: Floats, rng: np.random.Generator) -> tuple[Floats, tuple[float, float]]:
        """One movement to `target` (3,), m, in the models' frame: body points (T, 7, 3) at 60 Hz; begin and end, s, of
        its last part."""
        from scipy.spatial.transform import Rotation  # half a second, which only this method should cost

        points = self.demonstrator.demonstrate(action, target, rng).reshape(-1, len(POINT_NAMES), 3)
        shoulder, elbow, wrist, knuckle, index = (
            POINT_NAMES.index(name) for name in ("shoulder", "elbow", "wrist", "knuckle", "index")
        )
        end_of_hand = points[:, index] if action == "pointing" else points[:, knuckle:].mean(axis=1)
        part = _last_part(end_of_hand, target)
        axis = points[:, index] - points[:, shoulder]
        turn = Rotation.from_rotvec(self.swivel * axis / np.linalg.norm(axis, axis=1, keepdims=True))
        for joint in (elbow, wrist):
            points[:, joint] = points[:, shoulder] + turn.apply(points[:, joint] - points[:, shoulder])
        return RESTING_SHOULDER + (points - RESTING_SHOULDER) * self.size + self.offset + self.tracking_offsets, part


def _last_part(hand: Floats, target: Floats) -> tuple[float, float]:
    """Begin and end, s, of the last part of a movement of the hand (T, 3) at 60 Hz to a target (3,), m."""
    reached = hand[int(np.linalg.norm(hand - target, axis=1).argmin())]
    there = np.flatnonzero(np.linalg.norm(hand - reached, axis=1) < THERE_M)
    departs = float(np.argmax(np.linalg.norm(hand - hand[0], axis=1) > AWAY_M))
    arrives, leaves = float(there[0]), float(there[-1])
    approach = arrives - departs
    begin, end = arrives - APPROACH_FRACTION * approach, min(arrives + STAY_FRACTION * approach, leaves)
    return begin / SAMPLE_RATE_HZ, end / SAMPLE_RATE_HZ


@dataclass(frozen=True)
class LastParts:
    """Last parts of movements.

    Attributes:
        sequences: points over time, each (FRAMES, 3 n), m.
        theta: coordinates (u, v) of each target on the table, (K, 2).
        groups: number of the person of each, (K,).
        duration_s: mean of how long they took.
    """

    sequences: list[Floats]
    theta: Floats
    groups: Ints
    duration_s: float


def last_parts(
    action: Action, points: Sequence[str], seed: int = 0, *, persons: int = 8, repetitions: int = 2
) -> LastParts:
    """Last parts of persons who reach for or point at 5 x 3 positions on the table; `points` are some of theirs."""
    rng = np.random.default_rng((540, seed, 0 if action == "pointing" else 1))
    targets, positions = table_targets(5, 3)
    chosen = [POINT_NAMES.index(name) for name in points]
    sequences, durations = [], []
    for _ in range(persons):
        person = Person.drawn(rng)
        for target in np.repeat(targets, repetitions, axis=0):
            moved, (begin, end) = person.observed(action, target, rng)
            times = np.arange(rng.uniform(0.0, 1.0 / CAMERA_HZ), (len(moved) - 1) / SAMPLE_RATE_HZ, 1.0 / CAMERA_HZ)
            tracked = at_times(times, np.arange(len(moved)) / SAMPLE_RATE_HZ, moved[:, chosen].reshape(len(moved), -1))
            tracked += rng.normal(0.0, NOISE_M, tracked.shape)
            sequences.append(at_times(np.linspace(begin, end, FRAMES), times, tracked))
            durations.append(end - begin)
    theta = np.tile(np.repeat(positions, repetitions, axis=0), (persons, 1))
    return LastParts(
        sequences, theta, np.repeat(np.arange(persons), len(targets) * repetitions), float(np.mean(durations))
    )
