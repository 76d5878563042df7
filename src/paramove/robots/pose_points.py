"""A servo arm as the points of a person's arm, so that models of people's movements can be of its movements too."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.robots.description import Chain

ARM_BASE = "arm_base"
"""Frame of a servo arm's base: x forward, y left, z up from the table, m."""
POINT_NAMES = ("shoulder", "elbow", "wrist", "knuckle", "index", "thumb")
FINGER_M = 0.01
"""Index and thumb are so far before the end effector, the knuckle is twice as far behind it."""
OPEN_M, CLOSED_M = 0.08, 0.02
"""From index to thumb for the open and the closed gripper, about as people's are; no gripper's own sizes."""


def arm_points(chain: Chain, angles: ArrayLike, gripper: ArrayLike) -> Floats:
    """Where the points are.

    The shoulder is the yaw axis at the height of the first pitch axis, elbow and wrist are the other two pitch axes.
    The mean of knuckle, index and thumb is the end effector.

    Args:
        chain: Of the arm.
        angles: Of its J joints, shape [..., J], rad.
        gripper: Its angle, shape [...], rad.

    Returns:
        Shape [..., 6, 3], in the order of POINT_NAMES, m, frame ARM_BASE.
    """
    arm, q = chain.kinematics, np.asarray(angles, dtype=np.float64)
    end = arm.forward(q)
    cosine, sine, nothing = np.cos(q[..., 0]), np.sin(q[..., 0]), np.zeros_like(end.pitch)
    ahead = np.stack([cosine, sine, nothing], axis=-1)
    left = np.stack([-sine, cosine, nothing], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    shoulder = np.broadcast_to([*arm.yaw_axis, arm.shoulder[2]], ahead.shape)

    def along(pitch: Floats, forward: float, upward: float) -> Floats:
        """A vector of the arm's plane, turned downward."""
        cos_pitch, sin_pitch = np.cos(pitch)[..., None], np.sin(pitch)[..., None]
        forward_part = forward * (cos_pitch * ahead - sin_pitch * up)
        return np.asarray(forward_part + upward * (sin_pitch * ahead + cos_pitch * up))

    elbow = shoulder + arm.shoulder[0] * ahead + arm.shoulder[1] * left + along(q[..., 1], *arm.upper_arm)
    wrist = elbow + along(q[..., 1] + q[..., 2], *arm.forearm)
    approach = along(end.pitch, 1.0, 0.0)
    roll = end.roll[..., None]
    across = np.cos(roll) * left + np.sin(roll) * along(end.pitch, 0.0, 1.0)
    opening = (np.asarray(gripper) - chain.gripper_closed) / (chain.gripper_open - chain.gripper_closed)
    half = 0.5 * (CLOSED_M + np.clip(opening, 0.0, 1.0) * (OPEN_M - CLOSED_M))[..., None]
    tips = end.position + FINGER_M * approach
    knuckle = end.position - 2.0 * FINGER_M * approach
    points = [shoulder, elbow, wrist, knuckle, tips - half * across, tips + half * across]
    return np.stack(points, axis=-2)
