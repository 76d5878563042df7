"""Where an arm's joints are once they rest, from what its driver says of them."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.documents.array_types import Floats

REST_NS = 300_000_000
STALE_NS = 1_000_000_000
MOST = 2.0 * np.pi
REST_TOLERANCE = np.deg2rad(0.5)


class SettledJoints:
    """Remembers the last third of a second.

    Args:
        joints: Names, in the order that is wanted.

    Attributes:
        missing: Of these names, those that the newest message did not have.
    """

    def __init__(self, joints: Sequence[str]) -> None:
        self._joints = tuple(joints)
        self._heard: deque[tuple[int, Floats]] = deque()
        self.missing: tuple[str, ...] = ()

    def hear(self, message: JointStates, now_ns: int) -> None:
        """Take in measured joints; a message in which one is missing, or no angle, counts for nothing."""
        measured = {joint.name: joint.position for joint in message.joints}
        self.missing = tuple(name for name in self._joints if name not in measured)
        angles = np.array([measured.get(name, np.nan) for name in self._joints])
        if not (np.abs(angles) <= MOST).all():  # NaN is not below either
            return
        self._heard.append((now_ns, angles))
        while len(self._heard) > 2 and now_ns - self._heard[1][0] >= REST_NS:
            self._heard.popleft()

    def settled(self, now_ns: int) -> Floats | None:
        """The newest angles [J], rad, if the joints have rested for a while and are heard; else None."""
        if not self._heard or now_ns - self._heard[-1][0] > STALE_NS or now_ns - self._heard[0][0] < REST_NS:
            return None
        if np.ptp([angles for _, angles in self._heard], axis=0).max() > REST_TOLERANCE:
            return None
        return self._heard[-1][1]
