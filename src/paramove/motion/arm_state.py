"""The synthesizer's estimate of its arm between motions: from the last motion, or else from measurements."""

from __future__ import annotations

from collections import deque

import numpy as np
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.documents import Floats
from paramove.motion.gripper_arm import GripperArm
from paramove.motion.plans import PlannedMotion, RestPose

REST_NS = 1_000_000_000  # a grasp pauses the arm for up to 0.8 s
STALE_NS = 500_000_000
MAX_ANGLE = 2.0 * np.pi
BASE_TOLERANCE, COARSE_TOLERANCE = np.deg2rad([1.0, 3.0])
COARSE = np.deg2rad(0.9)  # a joint with larger units, as HOAP-3's wrist and fingers have
REST_TOLERANCE, REST_TOLERANCE_BEYOND_UNIT = np.deg2rad([0.3, 0.1])


class ArmState:
    """Pose and gripper of the arm between motions.

    After a start, or after a motion was stopped, the pose is unknown; it is estimated from the measured joints as soon
    as they rest.

    Args:
        arm: Its joints and gripper.

    Attributes:
        known: Whether the other attributes are valid.
        pose: Where the arm rests; None at its base pose.
        opening: ξ that the gripper is commanded to have.
        measured: ξ of the measured gripper.
        lost: Whether an object has slipped out of the gripper.
        missing: Names of the arm's joints that the latest message, which had others, did not have.
    """

    def __init__(self, arm: GripperArm) -> None:
        self._arm = arm
        self._base_tolerance = np.where(arm.resolution > COARSE, COARSE_TOLERANCE, BASE_TOLERANCE)
        self._rest_tolerance = np.maximum(REST_TOLERANCE, arm.resolution + REST_TOLERANCE_BEYOND_UNIT)
        self._measurements: deque[tuple[int, Floats]] = deque()
        self._busy_until_ns = 0
        self.known = False
        self.pose: RestPose | None = None
        self.opening = 1.0
        self.measured = 1.0
        self.lost = False
        self.missing: tuple[str, ...] = ()

    @property
    def felt(self) -> str:
        """What was measured where nothing was felt, and what would count as something."""
        return f"the gripper stopped at an opening of {self.measured:.3f}, felt_opening is {self._arm.felt_opening:g}"

    def handle(self, message: JointStates, now_ns: int) -> bool:
        """Updates with the measured joints; returns False, without a change, if one is missing or not finite."""
        measured = {joint.name: joint.position for joint in message.joints}
        self.missing = tuple(name for name in self._arm.joints if measured and name not in measured)
        angles = np.array([measured.get(name, np.nan) for name in self._arm.joints])
        if not (np.abs(angles) <= MAX_ANGLE).all():  # NaN is not below either
            return False
        self.measured = self._arm.opening_of(float(angles[-1]))
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
        self.known, self.pose = True, None if motion.phases[-1][0] == "retreat" else motion.end
        self.opening = self._arm.opening_of(float(motion.angles[-1, -1]))

    def estimate_pose(self, now_ns: int) -> bool:
        """Estimates the pose from the measured joints if they are at the base pose or rest; whether it is known."""
        if self.known or not self._measurements or now_ns < self._busy_until_ns:
            return self.known
        latest_ns, angles = self._measurements[-1]
        if now_ns - latest_ns > STALE_NS:
            return False
        at_base = bool((np.abs(angles - self._arm.base_angles) <= self._base_tolerance).all())
        if not at_base and not self._rests():
            return False
        self.known = True
        self.pose = None if at_base else RestPose(angles, self._arm.position(angles), measured=True)
        self.opening = self._arm.opening_of(float(self._arm.base_angles[-1] if at_base else angles[-1]))
        low, high = self._arm.holding_openings
        if not at_base and low < self.opening < high:
            self.opening = 0.0  # an object holds the gripper open there
        return True

    def _rests(self) -> bool:
        if self._measurements[-1][0] - self._measurements[0][0] < REST_NS:
            return False
        angles = np.array([angles for _, angles in self._measurements])
        return bool((np.ptp(angles, axis=0) <= self._rest_tolerance).all())
