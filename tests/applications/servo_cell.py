"""A list of tasks, the synthesizer of a servo arm, and a driver that plays any trajectory in three ticks."""

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
from paramove.motion.synthesizer import Synthesizer
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryStatus
from paramove.msgs.relocation_pb2 import RelocationGoal
from paramove.msgs.rule_pb2 import Speech
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState
from tests.motion.servo_reaching import reaching

PERIOD_NS = 66_666_667
HELD_OPENING = 0.2
STEPS = (ReachStep(reach=(0.15, 0.05, 0.1)), ReachStep(pick=(0.15, -0.05, 0.016), place=(0.12, 0.08, 0.016)))
PLAYED = (TrajectoryStatus.STATE_ACCEPTED, TrajectoryStatus.STATE_EXECUTING, TrajectoryStatus.STATE_SUCCEEDED)


class ServoCell:
    """Time goes on with `tick`.

    Attributes:
        answers: States that the driver reports of a trajectory, one a tick; none if it does not respond.
        reason, code: Its reason and code for them.
        graspable: Whether the gripper stops on an object when it closes.
        sent, goals, speech: All that was published.
        events: What the tasks received, and the ticks.
    """

    def __init__(
        self, name: str = "open_manipulator_x", steps: Sequence[ReachStep] = STEPS, start: np.ndarray | None = None
    ) -> None:
        self.plan = reaching(name)
        self.synthesizer = Synthesizer(self.plan)
        self.task = ReachTask(steps, "reach-0")
        self.answers: Sequence[TrajectoryStatus.State] = PLAYED
        self.reason = self.code = ""
        self.graspable = True
        self.angles = self.plan.base_angles.copy() if start is None else start
        self.safety = SafetyState(state=SafetyState.STATE_ARMED)
        self.events: list[Received | Tick] = []
        self.sent: list[JointTrajectory] = []
        self.goals: list[RelocationGoal] = []
        self.speech: list[Speech] = []
        self._waiting: list[TrajectoryStatus] = []
        self._number = 0

    def disarm(self, state: SafetyState.State, detail: str) -> None:
        self.safety = SafetyState(state=state, faults=[SafetyFault(code="x", joint="joint2", detail=detail)])

    def tick(self, count: int = 1) -> ServoCell:
        for _ in range(count):
            self._number += 1
            now_ns = self._number * PERIOD_NS
            self._receive(topics.ARM_SAFETY, self.safety, self.task.on_safety)
            self.synthesizer.on_joint_states(self._measured())
            if self._waiting:
                self.synthesizer.on_trajectory_status(self._waiting.pop(0))
            planned = self.synthesizer.tick(now_ns)
            for status in planned.statuses:
                self._receive(topics.RELOCATION_STATUS, status, self.task.on_goal_status)
            for message in planned.trajectories:
                self._play(message)
            self.events.append(Tick(self._number, now_ns))
            output = self.task.tick(now_ns)
            self.speech += output.speech
            self.goals += output.goals
            for goal in output.goals:
                self.synthesizer.on_goal(goal)
        return self

    def run(self, maximum: int = 600) -> ServoCell:
        """Until the tasks are done or have failed."""
        while not (self.task.finished or self.task.failure):
            assert self._number < maximum, self.task.detail
            self.tick()
        return self

    def _measured(self) -> JointStates:
        angles, arm = self.angles.copy(), self.plan.arm
        if self.graspable and arm.opening_of(float(angles[-1])) < 0.01:
            angles[-1] = arm.angle_of(HELD_OPENING)
        return JointStates(
            joints=[JointState(name=name, position=angle) for name, angle in zip(arm.joints, angles, strict=True)]
        )

    def _play(self, message: JointTrajectory) -> None:
        copy = JointTrajectory()
        copy.CopyFrom(message)
        self.sent.append(copy)
        for state in self.answers:
            status = TrajectoryStatus(trajectory_id=message.id, state=state, reason=self.reason, code=self.code)
            status.time_s = message.points[-1].time_s if state == TrajectoryStatus.STATE_SUCCEEDED else 0.0
            self._waiting.append(status)
        if TrajectoryStatus.STATE_SUCCEEDED in self.answers:
            self.angles = np.array(message.points[-1].position_rad)

    def _receive(self, topic: topics.Topic, message: Any, handle: Any) -> None:
        now_ns = self._number * PERIOD_NS
        copy = type(message).FromString(message.SerializeToString())
        self.events.append(Received(topic, copy, now_ns, now_ns, self._number))
        handle(copy)
