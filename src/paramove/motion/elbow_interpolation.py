"""Elbows between the demonstrated ones: interpolated as parts of an arm, not as points on their own.

The mean of the elbows of differently directed arms lies inside all of them: a shorter arm, turned about the line from
shoulder to gripper (thesis 5.2.7 finds up to 25 mm). Here lengths are interpolated as lengths, and the direction in
which the elbow leaves that line is carried to the new line by the smallest rotation before it is averaged.
"""

from __future__ import annotations

import numpy as np

from paramove.documents.array_types import Floats

_TINY = 1e-9
_LEAST_RADIUS = 1e-6  # m; keeps the elbow's side known where the arm is straight


def interpolated_elbow(weights: Floats, elbow: Floats, gripper: Floats) -> Floats:
    """Elbows of M weighted means of C arm poses each, in the frame of the shoulder.

    Where one pose has weight 1 the result is that pose's elbow. Weights sum to one; outside a grid some are negative.

    Args:
        weights: [M, C].
        elbow: Elbows of the arm poses, [M, C, ..., 3], m.
        gripper: Their grippers, the same shape; that of the result is their weighted mean.

    Returns:
        [M, ..., 3], m.
    """
    line = _mean(weights, gripper)
    upper_arm = _mean(weights, _length(elbow))
    forearm = _mean(weights, _length(gripper - elbow))
    distance = np.maximum(_length(line), _TINY)
    along_line = line / distance
    own_line = _unit(gripper)
    side = _unit(elbow - _dot(elbow, own_line) * own_line)  # (5.12), (5.13) of each pose
    carried = _mean(weights, carried_over(side, own_line, along_line[:, None]))
    carried = _unit(carried - _dot(carried, along_line) * along_line)
    middle = (upper_arm**2 + distance**2 - forearm**2) / (2.0 * distance)  # a cos β of (5.8)
    middle = np.clip(middle, -upper_arm, upper_arm)
    radius = np.sqrt(np.maximum(upper_arm**2 - middle**2, _LEAST_RADIUS**2))
    return np.asarray(middle * along_line + radius * carried)


def carried_over(vectors: Floats, start: Floats, end: Floats) -> Floats:
    """`vectors` turned by the smallest rotation that takes unit vectors `start` to `end`. All [..., 3]."""
    axis = np.cross(start, end)
    cosine = _dot(start, end)
    return np.asarray(
        cosine * vectors + np.cross(axis, vectors) + axis * _dot(axis, vectors) / np.maximum(1.0 + cosine, _TINY)
    )


def _mean(weights: Floats, values: Floats) -> Floats:
    return np.asarray(np.einsum("mc,mc...->m...", weights, values))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.sum(a * b, axis=-1, keepdims=True))


def _length(v: Floats) -> Floats:
    return np.asarray(np.linalg.norm(v, axis=-1, keepdims=True))


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.maximum(_length(v), _TINY))
