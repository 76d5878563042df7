"""Motions along straight lines of joint angles: from the arm's measured pose to the start of a planned motion.

No movement was learned for this. It is used only after an interruption, when the arm rests somewhere on a path.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.motion.planned_motion import PlannedMotion
from paramove.motion.timing import minimum_jerk
from paramove.robots import ArmKinematics

LIMIT_FRACTION = 0.5  # of the operating velocity and acceleration: people do not expect this motion
MIN_DURATION_S = 0.5
JOINED_WITHIN = np.deg2rad(0.01)


def joint_motion(
    start: ArrayLike,
    end: ArrayLike,
    kinematics: ArmKinematics,
    velocity: Floats,
    acceleration: Floats,
    phase: str,
    period: float = 0.005,
    holding: bool = False,
) -> PlannedMotion:
    """All joints together from `start` to `end`, from rest to rest.

    Args:
        start, end: Arm joints and fingers, [6], rad.
        kinematics: Of the arm.
        velocity, acceleration: Largest of each joint, [6], rad/s and rad/s².
        phase: Name of the motion's only phase.
        period: Of the samples, s.
        holding: Whether an object is held.
    """
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    distance = np.abs(b - a)
    # Peaks of the minimum-jerk profile: velocity 15/8 d/T, acceleration 10/√3 d/T².
    by_velocity = 1.875 * distance / (LIMIT_FRACTION * velocity)
    by_acceleration = np.sqrt(5.7735 * distance / (LIMIT_FRACTION * acceleration))
    duration = max(MIN_DURATION_S, float(by_velocity.max()), float(by_acceleration.max()))
    n = int(np.ceil(duration / period))
    angles = a + minimum_jerk(np.arange(n + 1) / n)[:, None] * (b - a)
    gripper = kinematics.forward(angles[:, :5]).gripper
    times: Floats = period * np.arange(n + 1, dtype=np.float64)
    return PlannedMotion(times, angles, gripper, np.full(n + 1, holding), ((phase, 0.0),), 0.0)


def joined(first: PlannedMotion, then: PlannedMotion) -> PlannedMotion:
    """One motion after the other; the second begins at rest where the first ends.

    Raises:
        ValueError: It begins elsewhere.
    """
    if np.abs(first.angles[-1] - then.angles[0]).max() > JOINED_WITHIN:
        raise ValueError("the second motion begins where the first does not end")
    later = first.times[-1]
    return PlannedMotion(
        times=np.concatenate([first.times, later + then.times[1:]]),
        angles=np.concatenate([first.angles, then.angles[1:]]),
        gripper=np.concatenate([first.gripper, then.gripper[1:]]),
        holding=np.concatenate([first.holding, then.holding[1:]]),
        phases=(*first.phases, *((name, later + start) for name, start in then.phases)),
        elbow_turn=max(first.elbow_turn, then.elbow_turn),
    )
