"""The synthesizer's estimate of its arm between motions: from the last motion, or else from measurements."""

from __future__ import annotations

from collections import deque

import numpy as np
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from numpy.typing import ArrayLike

from paramove.documents import Floats
from paramove.motion.planned_motion import PlannedMotion
from paramove.robots import Arm

FELT_OPENING = 0.12  # a closed hand whose fingers stop at a wider opening than this holds something
GRIPPING_OPENINGS = (0.36, 0.5)  # where fingers rest on an object; at the base pose they are at 0.3, open hands wider
REST_NS = 1_000_000_000  # a grasp pauses the arm for up to 0.8 s
STALE_NS = 500_000_000
BASE_TOLERANCE = np.deg2rad([1.0, 1.0, 1.0, 1.0, 3.0, 3.0])  # the wrist's and the fingers' units are 1 to 1.5 deg
REST_TOLERANCE = np.deg2rad([0.3, 0.3, 0.3, 0.3, 1.6, 1.1])


class ArmState:
    """Pose and hand of the arm between motions.

    After a start, or after a motion was stopped, the pose is unknown; it is estimated from the measured joints as soon
    as they rest.

    Args:
        arm: Its joints and fingers.
        base_angles: Of the base pose, [6], rad: five joints and the fingers.

    Attributes:
        known: Whether the other attributes are valid.
        at_base: Whether the arm is at its base pose.
        gripper: Its position elsewhere, [3], m, shoulder frame.
        measured_angles: The angles [6] that this was estimated from; None after a motion of this process.
        opening: ξ that the hand is commanded to have.
        measured: ξ of the measured fingers.
        lost: Whether an object has slipped out of the hand.
    """

    def __init__(self, arm: Arm, base_angles: ArrayLike) -> None:
        self._arm = arm
        self._base = np.asarray(base_angles, dtype=np.float64)
        self._measurements: deque[tuple[int, Floats]] = deque()
        self._busy_until_ns = 0
        self.known = False
        self.at_base = False
        self.gripper: Floats | None = None
        self.measured_angles: Floats | None = None
        self.opening = 1.0
        self.measured = 1.0
        self.lost = False

    def handle(self, message: JointStates, now_ns: int) -> bool:
        """Updates with the measured joints; returns False, without a change, if one is missing or not finite."""
        measured = {joint.name: joint.position for joint in message.joints}
        try:
            angles = np.array([measured[name] for name in (*self._arm.joints, self._arm.fingers)])
        except KeyError:
            return False
        if not np.isfinite(angles).all():
            return False
        self.measured = self.opening_of(float(angles[5]))
        self._measurements.append((now_ns, angles))
        while len(self._measurements) > 2 and now_ns - self._measurements[1][0] >= REST_NS:
            self._measurements.popleft()
        return True

    def moved_by_others(self, now_ns: int) -> None:
        """The driver reports a motion of another process."""
        self._busy_until_ns = now_ns + REST_NS

    def forget(self) -> None:
        """The current motion was stopped at an unknown pose."""
        self.known = False
        self._measurements.clear()

    def ended(self, motion: PlannedMotion) -> None:
        """A motion has been executed: the arm is where it ends."""
        base = motion.phases[-1][0] == "retreat"
        self.known, self.at_base, self.measured_angles = True, base, None
        self.gripper = None if base else motion.gripper[-1]
        self.opening = self.opening_of(float(motion.angles[-1, 5]))

    def estimate_pose(self, now_ns: int) -> bool:
        """Estimates the pose from the measured joints if they are at the base pose or rest; whether it is known."""
        if self.known or not self._measurements or now_ns < self._busy_until_ns:
            return self.known
        latest_ns, angles = self._measurements[-1]
        if now_ns - latest_ns > STALE_NS:
            return False
        self.at_base = bool((np.abs(angles - self._base) <= BASE_TOLERANCE).all())
        if not self.at_base and not self._rests():
            return False
        self.known, self.measured_angles = True, None if self.at_base else angles
        self.gripper = None if self.at_base else self._arm.kinematics.forward(angles[:5]).gripper
        self.opening = self.opening_of(float(self._base[5] if self.at_base else angles[5]))
        if not self.at_base and GRIPPING_OPENINGS[0] < self.opening < GRIPPING_OPENINGS[1]:
            self.opening = 0.0  # an object holds the fingers open there
        return True

    def opening_of(self, fingers: float) -> float:
        """ξ of an angle of the fingers."""
        span = self._arm.fingers_open - self._arm.fingers_closed
        return float(np.clip((fingers - self._arm.fingers_closed) / span, 0.0, 1.0))

    def _rests(self) -> bool:
        if self._measurements[-1][0] - self._measurements[0][0] < REST_NS:
            return False
        angles = np.array([angles for _, angles in self._measurements])
        return bool((np.ptp(angles, axis=0) <= REST_TOLERANCE).all())
