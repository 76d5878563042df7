"""Jogging: each key moves one joint by a small step, as a trajectory. Without clock and sockets."""

from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryPoint, TrajectoryStatus

SHORTEST_S = 0.5
FASTEST = float(np.deg2rad(10.0))
"""Mean speed of a step, rad/s."""
POINTS = 21
OVERDUE_S = 2.0
"""Beyond the time of a step: the driver waits a second for joints that do not arrive."""
OVER = (TrajectoryStatus.STATE_SUCCEEDED, TrajectoryStatus.STATE_STOPPED, TrajectoryStatus.STATE_REJECTED)


class Jogging:
    """Call `handle_…` with the driver's messages; `step` and `choose` as keys are pressed.

    Args:
        name: Begins the ids of the trajectories, and must differ in each run of the program.
        step: Of one key, rad.

    Attributes:
        chosen: Index of the joint that is moved.
        angles: Measured, by joint, rad; empty before the driver publishes them.
        detail: Result of the last step.
    """

    def __init__(self, name: str, step: float) -> None:
        self.chosen = 0
        self.angles: dict[str, float] = {}
        self.detail = ""
        self._name, self._step = name, step
        self._count = 0
        self._goals: dict[str, float] = {}
        self._waits_for = ""
        self._overdue_ns = 0

    @property
    def joint(self) -> str:
        """Name of the joint that is moved, "" before any is known."""
        return list(self.angles)[self.chosen] if self.angles else ""

    @property
    def is_moving(self) -> bool:
        """Whether a step is under way."""
        return bool(self._waits_for)

    def choose(self, index: int) -> None:
        """Selects the joint with this index, from 0; an index that does not exist is ignored."""
        if 0 <= index < len(self.angles):
            self.chosen = index

    def handle_states(self, message: JointStates) -> None:
        """Handles the measured joint angles."""
        self.angles = {joint.name: joint.position for joint in message.joints}
        self.chosen = min(self.chosen, max(len(self.angles) - 1, 0))

    def handle_status(self, message: TrajectoryStatus) -> None:
        """Handles the driver's status of a step."""
        if message.trajectory_id != self._waits_for or message.state not in OVER:
            return
        self._waits_for = ""
        if message.state == TrajectoryStatus.STATE_SUCCEEDED:
            self.detail = "there"
        else:
            self._goals.clear()  # the joint is not at the goal of the last step
            self.detail = message.reason

    def tick(self, now_ns: int) -> None:
        """Gives up a step whose end the driver does not report, because it was restarted."""
        if self.is_moving and now_ns > self._overdue_ns:
            self._waits_for, self.detail = "", "no status of this step from the arm's driver: was it restarted?"
            self._goals.clear()

    def step(self, direction: int, now_ns: int) -> JointTrajectory | None:
        """The trajectory of one step, 1 up or -1 down; None while the last is under way or no joint is known.

        It begins at the goal of the joint's last step, so that steps add up although the joint sags, and goes from rest
        to rest with the smallest jerk.
        """
        if self.is_moving or not self.angles:
            return None
        begin = self._goals.get(self.joint, self.angles[self.joint])
        end = begin + direction * self._step
        self._goals = {self.joint: end}
        self._count += 1
        self._waits_for, self.detail = f"{self._name}-{self._count}", "moving"
        message = JointTrajectory(id=self._waits_for, joints=[self.joint])
        message.captured.FromNanoseconds(now_ns)
        phase = np.linspace(0.0, 1.0, POINTS)
        angles = begin + (end - begin) * phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2)
        duration_s = max(SHORTEST_S, self._step / FASTEST)
        self._overdue_ns = now_ns + int(1e9 * (duration_s + OVERDUE_S))
        message.points.extend(
            TrajectoryPoint(time_s=time_s, position_rad=[angle])
            for time_s, angle in zip(duration_s * phase, angles, strict=True)
        )
        return message
