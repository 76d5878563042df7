"""What applications share: they command an arm once a person has armed it, speak, and publish their stage."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod

from paramove.applications.conversation import GoalClient, OutgoingMessages
from paramove.applications.options import ApplicationOptions
from paramove.msgs.relocation_pb2 import RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Speech
from paramove.msgs.safety_state_pb2 import SafetyState

STAGE_PERIOD_S = 1.0
UNARMED_S = 2.0
"""A program arms an emulated arm within this time; then a person is needed."""
_AT_WORK = (SafetyState.STATE_ARMED, SafetyState.STATE_STOPPING)


_log = logging.getLogger(__name__)


class Application(ABC):
    """Pass received messages to the `on_…` methods, then call `tick`.

    Args:
        options: Positions and timeouts.
        run_name: Prefix of the goals' ids; unique to the process, as a goal id is executed only once.
        begun_s: When the run began, by the clock of `tick`; for texts.

    Attributes:
        stage: As published in `ApplicationStage`.
        state: Name of the state it is in, for people.
        detail: Text of the last speech message.
    """

    def __init__(self, options: ApplicationOptions, run_name: str, begun_s: float = 0.0) -> None:
        self.goal_client = GoalClient(options.frame, options.grasp_z, run_name)
        self.outgoing = OutgoingMessages()
        self.begun_s = begun_s
        self.now_s = 0.0
        self.stage = ApplicationStage.STAGE_UNSPECIFIED
        self.state = ""
        self.detail = ""
        self._since_s = 0.0
        self._watch = ArmWatch(options.arming_timeout_s)
        self._published = ("", float("-inf"))

    @property
    def failure(self) -> str:
        """Why the application cannot go on; empty while it can."""
        return self._watch.detail if self._watch.given_up(self.now_s) else ""

    @property
    def finished(self) -> bool:
        """Whether all is done."""
        return self.stage == ApplicationStage.STAGE_DONE

    @property
    def for_s(self) -> float:
        """How long this state has lasted, s."""
        return self.now_s - self._since_s

    @abstractmethod
    def begin(self) -> None:
        """The first tick."""

    @abstractmethod
    def step(self) -> None:
        """Any other tick with an armed arm, until it has finished."""

    def on_goal_status(self, status: RelocationStatus) -> None:
        """The arm reports the status of a goal."""
        self.goal_client.on_status(status)

    def on_safety(self, state: SafetyState) -> None:
        """The safety gate reports its state."""
        armed = not self._watch.lost
        self._watch.on_safety(state, self.now_s)
        if armed and self._watch.lost:
            self.speak(f"I cannot go on: {self._watch.detail}.")

    def tick(self, now_s: float) -> OutgoingMessages:
        """One tick; returns the messages to publish."""
        self.now_s = now_s
        if not self.state:
            self.begin()
        elif arming := self._watch.first_arming(now_s):
            if self.detail != arming:
                self.speak(arming)
        elif not self.finished and not self._watch.lost:
            self.step()
        self.goal_client.step(now_s, self.outgoing)
        self._publish_stage()
        outgoing, self.outgoing = self.outgoing, OutgoingMessages()
        return outgoing

    def go(self, state: str) -> None:
        """Change the state."""
        self.state, self._since_s = state, self.now_s

    def speak(self, detail: str, request: Speech.Request = Speech.REQUEST_UNSPECIFIED, name: str = "") -> None:
        """Say something to the person, with or without a request."""
        self.outgoing.speak(self.now_s, detail, request, name)
        self.detail = detail
        _log.info("%.1f s: %s", self.now_s - self.begun_s, detail)

    def _publish_stage(self) -> None:
        """Publish the stage once a second and on every change."""
        state = f"{self.state} {self.detail} {self.finished}"
        if state == self._published[0] and self.now_s - self._published[1] < STAGE_PERIOD_S:
            return
        self._published = (state, self.now_s)
        message = ApplicationStage(
            stage=self.stage,
            step=self.state,
            detail=self.detail,
            grasps=self.goal_client.grasps,
            retries=self.goal_client.retries,
        )
        message.captured.FromNanoseconds(round(self.now_s * 1e9))
        self.outgoing.stages.append(message)


class ArmWatch:
    """Follows the safety gate's state. Until the arm was armed for the first time, it reports no loss.

    Args:
        timeout_s: How long a person may take to arm again.
    """

    def __init__(self, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._was_armed = False
        self._lost_s: float | None = None
        self._waits_s: float | None = None
        self._state = SafetyState.STATE_UNSPECIFIED
        self._why = ""

    def on_safety(self, message: SafetyState, now_s: float) -> None:
        """Store the gate's state."""
        self._state = message.state
        self._was_armed |= message.state == SafetyState.STATE_ARMED
        if self._was_armed:
            self._waits_s = None
        elif self._waits_s is None:
            self._waits_s = now_s
        why = "; ".join(fault.detail for fault in message.faults)
        if not self._was_armed or message.state in _AT_WORK:
            self._lost_s, self._why = None, why
        elif self._lost_s is None:
            self._lost_s, self._why = now_s, why
        else:
            self._why = why or self._why

    @property
    def lost(self) -> bool:
        """Whether the arm was armed and is not any more."""
        return self._lost_s is not None

    def first_arming(self, now_s: float) -> str:
        """The request to a person who has not armed the arm yet; empty where none is needed."""
        if self._waits_s is None or now_s - self._waits_s < UNARMED_S:
            return ""
        return f"Please arm the arm, in a terminal: paramove arm enable{f' ({self._why})' if self._why else ''}."

    @property
    def detail(self) -> str:
        """What happened, why, and what to do."""
        state = SafetyState.State.Name(self._state).removeprefix("STATE_").lower()
        why = f": {self._why}" if self._why else ""
        return f"the arm is no longer armed ({state}){why}; only a person arms it again"

    def given_up(self, now_s: float) -> bool:
        """Whether the timeout expired before a person armed it again."""
        return self._lost_s is not None and now_s - self._lost_s >= self._timeout_s
