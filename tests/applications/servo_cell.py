"""A driver that plays any trajectory in three ticks, around a list of tasks; stores what was received and published."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.applications.reach_task import ReachStep, ReachTask
from paramove.bus import topics
from paramove.bus.subscriber import Received
from paramove.bus.ticks import Tick
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryStatus
from paramove.msgs.rule_pb2 import Speech
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState
from tests.motion.servo_reaching import reaching

PERIOD_NS = 66_666_667
STEPS = (ReachStep(reach=(0.15, 0.05, 0.1)), ReachStep(pick=(0.15, -0.05, 0.016), place=(0.12, 0.08, 0.016)))
PLAYED = (TrajectoryStatus.STATE_ACCEPTED, TrajectoryStatus.STATE_EXECUTING, TrajectoryStatus.STATE_SUCCEEDED)


class ServoCell:
    """Time goes on with `tick`.

    Attributes:
        answers: States that the driver says of a trajectory, one a tick; none if it does not respond.
        reason, code: It gives with them.
        events, sent, speech: All that was received and published.
    """

    def __init__(
        self, name: str = "open_manipulator_x", steps: Sequence[ReachStep] = STEPS, start: np.ndarray | None = None
    ) -> None:
        self.plan = reaching(name)
        self.task = ReachTask(self.plan, steps, "reach-0")
        self.answers: Sequence[TrajectoryStatus.State] = PLAYED
        self.reason = self.code = ""
        self.angles = self.plan.base_angles.copy() if start is None else start
        self.safety = SafetyState(state=SafetyState.STATE_ARMED)
        self.events: list[Received | Tick] = []
        self.sent: list[JointTrajectory] = []
        self.speech: list[Speech] = []
        self._waiting: list[TrajectoryStatus] = []
        self._answered: set[str] = set()
        self._number = 0

    def disarm(self, state: SafetyState.State, detail: str) -> None:
        self.safety = SafetyState(state=state, faults=[SafetyFault(code="x", joint="joint2", detail=detail)])

    def tick(self, count: int = 1) -> ServoCell:
        for _ in range(count):
            self._number += 1
            self._hear(topics.ARM_SAFETY, self.safety, self.task.on_safety)
            states = [JointState(name=n, position=q) for n, q in zip(self.plan.joints, self.angles, strict=True)]
            self._hear(topics.ARM_JOINT_STATES, JointStates(joints=states), self.task.on_joint_states)
            if self._waiting:
                self._hear(topics.ARM_TRAJECTORY_STATUS, self._waiting.pop(0), self.task.on_trajectory_status)
            self.events.append(Tick(self._number, self._number * PERIOD_NS))
            output = self.task.tick(self._number * PERIOD_NS)
            self.speech += output.speech
            for message in output.trajectories:
                self._play(message)
        return self

    def run(self, maximum: int = 400) -> ServoCell:
        """Until the tasks are done or have failed."""
        while not (self.task.finished or self.task.failure):
            assert self._number < maximum, self.task.detail
            self.tick()
        return self

    def _play(self, message: JointTrajectory) -> None:
        copy = JointTrajectory()
        copy.CopyFrom(message)
        self.sent.append(copy)
        for state in self.answers:
            status = TrajectoryStatus(trajectory_id=message.id, state=state, reason=self.reason, code=self.code)
            self._waiting.append(status)
        if TrajectoryStatus.STATE_SUCCEEDED in self.answers:
            self.angles = np.array(message.points[-1].position_rad)

    def _hear(self, topic: topics.Topic, message: Any, handle: Any) -> None:
        now_ns = self._number * PERIOD_NS
        self.events.append(Received(topic, message, now_ns, now_ns, self._number))
        handle(message)
