"""A person beside a servo arm: says words to it, and hears what it says."""

import select
import time

from paramove.bus import topics
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryStatus
from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState
from paramove.robots.dynamixel.arm.driven_arm import DrivenArm

PATIENT_S = 120.0


class Person:
    """What the arm said is kept: the newest `safety` and `motors`, all `statuses`, all `angles` [N, J] in rad."""

    def __init__(self, arm: DrivenArm) -> None:
        self.arm = arm
        self.safety, self.motors, self.statuses, self.angles = SafetyState(), None, [], []

    def hears_until(self, what) -> None:
        """Raises TimeoutError if it never comes true."""
        until_s = time.monotonic() + PATIENT_S
        while not what():
            if time.monotonic() > until_s:
                raise TimeoutError(f"{self.safety} {self.statuses[-1:]} {self.arm.trouble}")
            select.select([self.arm.readable], [], [], 0.1)
            for topic, message, _ in self.arm.said():
                if topic is topics.ARM_SAFETY:
                    self.safety = message
                elif topic is topics.ARM_TRAJECTORY_STATUS:
                    self.statuses.append(message)
                elif topic is topics.ARM_MOTORS:
                    self.motors = message
                elif topic is topics.ARM_JOINT_STATES_FAST:
                    self.angles.append([joint.position for joint in message.joints])

    def waits_for(self, state: str) -> None:
        self.hears_until(lambda: self.safety.state == getattr(SafetyState, f"STATE_{state}"))

    def arms(self) -> None:
        self.arm.on_arm_request(ArmRequest(source="person", armed=True, by_person=True), time.monotonic_ns())

    def arms_and_waits(self) -> None:
        """Says the word again whenever it was judged too late: other programs may keep the arm waiting."""
        self.waits_for("DISARMED")
        self.arms()
        self.hears_until(self._is_armed)

    def _is_armed(self) -> bool:
        if any(fault.code in ("arming_stale", "arming_slow") for fault in self.safety.faults):
            self.safety = SafetyState()  # what was told once is answered once
            self.arms()
        return self.safety.state == SafetyState.STATE_ARMED

    def publish(self, name: str, joints, points) -> None:
        """A trajectory of pairs of time, s, and angles, rad."""
        message = JointTrajectory(id=name, joints=list(joints))
        for time_s, angles in points:
            message.points.add(time_s=time_s, position_rad=list(angles))
        self.arm.on_trajectory(message, time.monotonic_ns())

    def is_told(self, state: str) -> TrajectoryStatus:
        wanted = getattr(TrajectoryStatus, f"STATE_{state}")
        self.hears_until(lambda: any(one.state == wanted for one in self.statuses))
        return next(one for one in self.statuses if one.state == wanted)

    def codes(self) -> list[tuple[str, str]]:
        return [(fault.code, fault.joint) for fault in self.safety.faults]
