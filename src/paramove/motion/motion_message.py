"""A planned motion as the message that the arm's driver plays."""

from __future__ import annotations

from collections.abc import Sequence

from paramove.motion.planned_motion import PlannedMotion
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryPhase, TrajectoryPoint


def motion_message(name: str, joints: Sequence[str], motion: PlannedMotion, now_ns: int) -> JointTrajectory:
    """The trajectory called `name` of these joints, in the order of the motion's angles."""
    message = JointTrajectory(id=name, joints=joints)
    message.captured.FromNanoseconds(now_ns)
    message.points.extend(
        TrajectoryPoint(time_s=t, position_rad=q) for t, q in zip(motion.times, motion.angles, strict=True)
    )
    message.phases.extend(TrajectoryPhase(name=name, start_s=start) for name, start in motion.phases)
    return message
