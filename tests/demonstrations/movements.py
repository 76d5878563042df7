"""Movements and sets for tests, with numbers that are known."""

import numpy as np

from paramove.demonstrations.demonstration_set import DemonstrationSet
from paramove.demonstrations.movement import Movement

POINTS = ("sternum", "shoulder", "elbow", "wrist", "index")
TARGET = ("target_x", "target_y", "target_z")
RATE_HZ = 50.0


def arm(hand):
    """Points of a right arm whose index is at `hand` (T, 3), m, in a body frame at the shoulder. Shape (T, 5, 3)."""
    shoulder = np.zeros_like(hand)
    sternum = shoulder + np.array([0.0, 0.2, -0.05])
    wrist = hand - [0.1, 0.0, 0.0]
    elbow = 0.5 * wrist - [0.0, 0.05, 0.15]
    return np.stack([sternum, shoulder, elbow, wrist, hand], axis=1)


def reach(target, seconds=1.0, rest=0.4):
    """Rest, a smooth way to the target, rest; shapes (T,), (T, 5, 3)."""
    time = np.arange(round((seconds + 2 * rest) * RATE_HZ) + 1) / RATE_HZ
    share = np.clip((time - rest) / seconds, 0.0, 1.0)
    smooth = share**3 * (10 - 15 * share + 6 * share**2)
    start = np.array([0.1, 0.0, -0.4])
    return time, arm(start + smooth[:, None] * (np.asarray(target) - start))


def movement(target=(0.4, 0.1, -0.1), **labels):
    time, positions = reach(target)
    about = {"action": "reaching", "subject": "P1", "frame": "body", "parameter_names": TARGET} | labels
    return Movement(time, positions, POINTS, theta=np.array(target, dtype=np.float64), **about)


def a_set(subjects=("P1", "P2"), repetitions=2):
    """Movements to three targets by each person; a recording per person."""
    targets = [(0.3, -0.1, -0.1), (0.4, 0.0, -0.2), (0.35, 0.15, -0.15)]
    return DemonstrationSet(
        tuple(
            movement(target, subject=subject, repetition=number, recording=f"{subject}.mcap")
            for target in targets
            for number in range(repetitions)
            for subject in subjects
        ),
        "for tests",
    )
