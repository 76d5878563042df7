"""What the synthesizer knows of its arm between motions: as the last motion left it, or else as it is measured."""

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

    A process that has just begun, or whose last motion was stopped, does not know where its arm is; it finds out by the
    measured joints as soon as they rest.

    Args:
        arm: Its joints and fingers.
        base_angles: Of the base pose, [6], rad: five joints and the fingers.

    Attributes:
        known: Whether the rest is of worth.
        at_base: Whether the arm is at its base pose.
        gripper: Where it waits elsewhere, [3], m, shoulder frame.
        found: The measured angles [6] that this was taken from; None where a motion of this process led here.
        opening: ξ that the hand is commanded to have.
        measured: ξ of the measured fingers.
        lost: Whether an object has slipped out of the hand.
    """

    def __init__(self, arm: Arm, base_angles: ArrayLike) -> None:
        self._arm = arm
        self._base = np.asarray(base_angles, dtype=np.float64)
        self._heard: deque[tuple[int, Floats]] = deque()
        self._busy_until_ns = 0
        self.known = False
        self.at_base = False
        self.gripper: Floats | None = None
        self.found: Floats | None = None
        self.opening = 1.0
        self.measured = 1.0
        self.lost = False

    def handle(self, message: JointStates, now_ns: int) -> bool:
        """Take in the measured joints; returns False, and keeps what is known, if one is missing or not finite."""
        measured = {joint.name: joint.position for joint in message.joints}
        try:
            angles = np.array([measured[name] for name in (*self._arm.joints, self._arm.fingers)])
        except KeyError:
            return False
        if not np.isfinite(angles).all():
            return False
        self.measured = self.opening_of(float(angles[5]))
        self._heard.append((now_ns, angles))
        while len(self._heard) > 2 and now_ns - self._heard[1][0] >= REST_NS:
            self._heard.popleft()
        return True

    def moved_by_others(self, now_ns: int) -> None:
        """The driver tells of a motion that is none of this process's."""
        self._busy_until_ns = now_ns + REST_NS

    def forget(self) -> None:
        """The motion under way was stopped somewhere."""
        self.known = False
        self._heard.clear()

    def ended(self, motion: PlannedMotion) -> None:
        """A motion has been executed: the arm is where it ends."""
        base = motion.phases[-1][0] == "retreat"
        self.known, self.at_base, self.found = True, base, None
        self.gripper = None if base else motion.gripper[-1]
        self.opening = self.opening_of(float(motion.angles[-1, 5]))

    def find_out(self, now_ns: int) -> bool:
        """Take the pose from the measured joints if they tell it: at the base pose, or at rest. Whether it is known."""
        if self.known or not self._heard or now_ns < self._busy_until_ns:
            return self.known
        latest_ns, angles = self._heard[-1]
        if now_ns - latest_ns > STALE_NS:
            return False
        self.at_base = bool((np.abs(angles - self._base) <= BASE_TOLERANCE).all())
        if not self.at_base and not self._rests():
            return False
        self.known, self.found = True, None if self.at_base else angles
        self.gripper = None if self.at_base else self._arm.kinematics.forward(angles[:5]).gripper
        self.opening = self.opening_of(float(self._base[5] if self.at_base else angles[5]))
        if not self.at_base and GRIPPING_OPENINGS[0] < self.opening < GRIPPING_OPENINGS[1]:
            self.opening = 0.0  # fingers that rest there are held open by what they hold
        return True

    def opening_of(self, fingers: float) -> float:
        """ξ of an angle of the fingers."""
        span = self._arm.fingers_open - self._arm.fingers_closed
        return float(np.clip((fingers - self._arm.fingers_closed) / span, 0.0, 1.0))

    def _rests(self) -> bool:
        if self._heard[-1][0] - self._heard[0][0] < REST_NS:
            return False
        angles = np.array([angles for _, angles in self._heard])
        return bool((np.ptp(angles, axis=0) <= REST_TOLERANCE).all())
