"""The last movement of a servo arm before its torque goes off: slowly to where it may fall, if there is time for it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from paramove.documents.array_types import Floats
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory
from paramove.robots.description import RobotDescription

SLOW_SHARE = 0.5
"""Of the operating velocity."""
PEAK = 1.875
"""Highest velocity of a movement with smooth ends, of its mean."""
SHORTEST_S = 0.5
LONGEST_S = 4.0
"""With all that belongs to it: a launcher kills a driver 5 s after it was asked to end."""
MARGIN_S = 0.5
"""Until the arm has settled and every servo has heard the last word."""


def movement_to(
    description: RobotDescription, start: Floats, angles: Mapping[str, float], name: str
) -> tuple[JointTrajectory, float]:
    """A straight movement in the joints that `angles` names, rad, from the pose `start` [J], rad, and its duration, s.

    It is judged by the safety gate as any other.
    """
    places = [description.index(joint) for joint in angles]
    goal = np.array(list(angles.values()))
    slow = SLOW_SHARE * description.operating_velocity[places]
    duration_s = float(max(SHORTEST_S, (PEAK * np.abs(goal - start[places]) / slow).max(initial=0.0)))
    message = JointTrajectory(id=name, joints=list(angles))
    for time_s, point in ((0.0, start[places]), (duration_s, goal)):
        message.points.add(time_s=time_s, position_rad=point.tolist())
    return message, duration_s
