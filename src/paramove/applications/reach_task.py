"""A list of positions to reach and objects to relocate, executed by a servo arm one after the other."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Self

import numpy as np
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from pydantic import AfterValidator, BaseModel, ConfigDict, model_validator

from paramove.applications.arm_watch import ArmWatch
from paramove.documents import Floats, InputError
from paramove.motion import FARTHEST_M, PlannedMotion, ServoArmReaching, metres, motion_message
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryStatus
from paramove.msgs.rule_pb2 import Speech
from paramove.msgs.safety_state_pb2 import SafetyState
from paramove.robots import OutOfReachError

REST_NS = 300_000_000
STALE_NS = 1_000_000_000
MAX_ANGLE = 2.0 * np.pi
REST_TOLERANCE = np.deg2rad(0.5)
_log = logging.getLogger(__name__)

RESEND_NS = 400_000_000
STATUS_TIMEOUT_NS = 10_000_000_000
REPORT_UNARMED_AFTER_NS = 1_000_000_000
"""How long an arm may be unarmed before that is reported: where a node arms it, no report is needed."""
STALE_TRIES = 3
_STOPPED = {TrajectoryStatus.STATE_STOPPED: "stopped", TrajectoryStatus.STATE_REJECTED: "refused"}


def _near(position: tuple[float, float, float]) -> tuple[float, float, float]:
    if max(map(abs, position)) > FARTHEST_M:
        raise ValueError(f"expected x, y, z in m, each from -{FARTHEST_M:g} to {FARTHEST_M:g}")
    return position


Point = Annotated[tuple[float, float, float], AfterValidator(_near)]


class ReachStep(BaseModel):
    """`reach` a position, or `pick` an object up and `place` it; frame of the arm's base, m."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    reach: Point | None = None
    pick: Point | None = None
    place: Point | None = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        given = [name for name in ("reach", "pick", "place") if getattr(self, name) is not None]
        if given not in (["reach"], ["pick", "place"]):
            raise ValueError(
                "expected {reach: [x, y, z]} or {pick: [x, y, z], place: [x, y, z]}, "
                f"found {' and '.join(given) or 'nothing'}"
            )
        return self

    @property
    def detail(self) -> str:
        """The step as text."""
        if self.reach is not None:
            return f"reach for {metres(np.array(self.reach))}"
        return f"pick up at {metres(np.array(self.pick))} and place at {metres(np.array(self.place))}"

    def planned(self, reaching: ServoArmReaching, start: Floats) -> PlannedMotion:
        """The motion from a pose. Raises OutOfReachError."""
        if self.reach is not None:
            return reaching.reach(self.reach, start)
        assert self.pick is not None
        assert self.place is not None
        return reaching.pick_and_place(self.pick, self.place, start)


@dataclass
class ReachOutput:
    """Messages of a tick."""

    trajectories: list[JointTrajectory] = field(default_factory=list)
    speech: list[Speech] = field(default_factory=list)


@dataclass
class _Running:
    motion: PlannedMotion
    message: JointTrajectory
    sent_ns: int
    received_ns: int
    acknowledged: bool = False
    stale: int = 0


class ReachTask:
    """Pass received messages to the `on_…` methods, then call `tick`. Begins when the arm is armed and rests.

    Args:
        reaching: Plans the motions.
        steps: What to do; at the end the arm goes back to its base pose.
        run_name: Prefix of the trajectories' ids; unique to the process.

    Raises:
        InputError: A step cannot be executed; the message has the step, the reason and what would work.

    Attributes:
        detail: What it does, as text.
        failure: Why it cannot go on; empty while it can.
        finished: Whether all is done.
    """

    def __init__(self, reaching: ServoArmReaching, steps: Sequence[ReachStep], run_name: str) -> None:
        if not steps:
            raise InputError("no tasks: expected a list such as [{reach: [0.2, 0.0, 0.1]}], found none")
        self._reaching, self._steps, self._run_name = reaching, tuple(steps), run_name
        self._joints = SettledJoints(reaching.joints)
        self._watch = ArmWatch(0.0)
        self._armed = False
        self._done = 0
        self._sent = 0
        self._at: Floats | None = None
        self._running: _Running | None = None
        self._output = ReachOutput()
        self._now_ns = 0
        self._unarmed = self.detail = "waiting for the arm's driver"
        self._unarmed_since_ns, self._unarmed_reported = 0, ""
        self.failure = ""
        self.finished = False
        self._rehearse()

    def on_joint_states(self, message: JointStates) -> None:
        """Store the measured joints."""
        self._joints.handle(message, self._now_ns)

    def on_safety(self, message: SafetyState) -> None:
        """Store the safety gate's state."""
        self._armed = message.state == SafetyState.STATE_ARMED
        self._watch.on_safety(message, self._now_ns * 1e-9)
        why = "".join(f"; {fault.detail}" for fault in message.faults)
        self._unarmed = f"waiting until a person arms the arm (paramove arm enable){why}"

    def on_trajectory_status(self, status: TrajectoryStatus) -> None:
        """Follow the driver's status of the current motion."""
        running = self._running
        if running is None or status.trajectory_id != running.message.id:
            return
        running.received_ns = self._now_ns
        rejected = status.state == TrajectoryStatus.STATE_REJECTED
        if rejected and status.code == "stale" and running.stale < STALE_TRIES:
            running.stale += 1  # it was too old when the driver received it: publish it again with the current time
            running.acknowledged, running.sent_ns = False, self._now_ns - RESEND_NS
            return
        running.acknowledged = True
        if status.state == TrajectoryStatus.STATE_SUCCEEDED:
            self._ended(running.motion)
        elif status.state in _STOPPED:
            self._fail(f"the arm's driver {_STOPPED[status.state]} the motion: {status.reason or 'it gives no reason'}")

    def tick(self, now_ns: int) -> ReachOutput:
        """One tick; returns the messages to publish."""
        self._now_ns = now_ns
        running = self._running
        if self.finished or self.failure:
            pass
        elif self._watch.lost:
            self._fail(self._watch.detail)
        elif running is None:
            self._begin()
        elif now_ns - running.received_ns > STATUS_TIMEOUT_NS:
            self._fail(f"no status of the motion from the arm's driver for {STATUS_TIMEOUT_NS * 1e-9:.0f} s")
        elif not running.acknowledged and now_ns - running.sent_ns >= RESEND_NS:
            running.message.captured.FromNanoseconds(now_ns)
            running.sent_ns = now_ns
            self._output.trajectories.append(running.message)
        output, self._output = self._output, ReachOutput()
        return output

    @property
    def _what(self) -> str:
        """The current step as text."""
        if self._done >= len(self._steps):
            return "going back to the base pose"
        return f"task {self._done + 1} of {len(self._steps)}, {self._steps[self._done].detail}"

    def _rehearse(self) -> None:
        """Plan all steps once: a step that cannot be executed is reported before the arm moves."""
        at = self._reaching.base_angles
        for step in self._steps:
            try:
                at = step.planned(self._reaching, at).angles[-1]
            except OutOfReachError as error:
                raise InputError(f"{self._what}: {error}") from error
            self._done += 1
        self._done = 0

    def _begin(self) -> None:
        if self._joints.missing:
            absent = ", ".join(self._joints.missing)
            self._fail(f"the arm has no joint {absent}: give the reacher the same `robot` as the arm's driver")
            return
        if not self._armed:
            self._wait()
            return
        if self._at is None:
            self._at = self._joints.settled(self._now_ns)
            if self._at is None:
                self.detail = "waiting until the arm rests"
                return
        away = np.maximum(self._reaching.lower - self._at, self._at - self._reaching.upper)
        if away.max() > self._reaching.start_tolerance:
            joint = self._reaching.joints[int(away.argmax())]
            degrees = np.rad2deg(away.max())
            self._fail(f"joint {joint} stands {degrees:.1f} deg outside its range; disarm, move it by hand, arm again")
            return
        self._plan(self._at)

    def _wait(self) -> None:
        """For a driver and an armed arm."""
        if self.detail != self._unarmed or not self._unarmed_since_ns:
            self.detail, self._unarmed_since_ns = self._unarmed, self._now_ns
        elif (
            self._now_ns - self._unarmed_since_ns > REPORT_UNARMED_AFTER_NS and self._unarmed_reported != self._unarmed
        ):
            self._unarmed_reported = self._unarmed
            self._speak(self._unarmed)

    def _plan(self, start: Floats) -> None:
        going_home = self._done >= len(self._steps)
        try:
            motion = (
                self._reaching.home(start) if going_home else self._steps[self._done].planned(self._reaching, start)
            )
        except OutOfReachError as error:
            self._fail(str(error))
            return
        self._sent += 1
        message = motion_message(f"{self._run_name}/{self._sent}", self._reaching.joints, motion, self._now_ns)
        # Planning takes a while: the next tick publishes it, with its own time.
        self._running = _Running(motion, message, self._now_ns - RESEND_NS, self._now_ns)
        self._speak(f"{self._what}: {motion.times[-1]:.0f} s")

    def _ended(self, motion: PlannedMotion) -> None:
        self._running, self._at = None, motion.angles[-1]
        self._done += 1
        at_base = bool(np.abs(self._at - self._reaching.base_angles).max() < 1e-6)
        if self._done > len(self._steps) or (self._done == len(self._steps) and at_base):
            self.finished = True
            self._speak(f"all {len(self._steps)} tasks are done")

    def _fail(self, why: str) -> None:
        self._running = None
        self.failure = f"{self._what}: {why}"
        self._speak(self.failure, Speech.REQUEST_HELP)

    def _speak(self, detail: str, request: Speech.Request = Speech.REQUEST_UNSPECIFIED) -> None:
        speech = Speech(request=request, text=detail)
        speech.captured.FromNanoseconds(self._now_ns)
        self._output.speech.append(speech)
        self.detail = detail
        _log.info("%.1f s: %s", self._now_ns * 1e-9, detail)


class SettledJoints:
    """An arm's joint angles once they rest, from its driver's reports of the last third of a second.

    Args:
        joints: Names, in the order of the angles returned.

    Attributes:
        missing: Of these names, those that the latest message did not have.
    """

    def __init__(self, joints: Sequence[str]) -> None:
        self._joints = tuple(joints)
        self._received: deque[tuple[int, Floats]] = deque()
        self.missing: tuple[str, ...] = ()

    def handle(self, message: JointStates, now_ns: int) -> None:
        """Store measured joints; a message with a missing joint or an invalid angle is ignored."""
        measured = {joint.name: joint.position for joint in message.joints}
        self.missing = tuple(name for name in self._joints if name not in measured)
        angles = np.array([measured.get(name, np.nan) for name in self._joints])
        if not (np.abs(angles) <= MAX_ANGLE).all():  # NaN is not below either
            return
        self._received.append((now_ns, angles))
        while len(self._received) > 2 and now_ns - self._received[1][0] >= REST_NS:
            self._received.popleft()

    def settled(self, now_ns: int) -> Floats | None:
        """The latest angles [J], rad, if the joints have rested for a while and the data is recent; else None."""
        if not self._received or now_ns - self._received[-1][0] > STALE_NS or now_ns - self._received[0][0] < REST_NS:
            return None
        if np.ptp([angles for _, angles in self._received], axis=0).max() > REST_TOLERANCE:
            return None
        return self._received[-1][1]
