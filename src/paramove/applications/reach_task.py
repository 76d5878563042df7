"""A list of positions to reach and objects to relocate, executed by a servo arm one after the other."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Annotated, Self

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, model_validator

from paramove.applications.application import ArmWatch
from paramove.applications.conversation import GoalClient, OutgoingMessages, position_at
from paramove.documents import InputError
from paramove.motion import FARTHEST_M, metres
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import Speech
from paramove.msgs.safety_state_pb2 import SafetyState
from paramove.robots import ARM_BASE

_log = logging.getLogger(__name__)

REPORT_UNARMED_AFTER_S = 1.0
"""How long an arm may be unarmed before that is reported: where a node arms it, no report is needed."""


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

    def start(self, client: GoalClient, now_s: float, plan_only: bool) -> None:
        """Set it as the goal of a client."""
        if self.reach is not None:
            client.start(RelocationGoal.KIND_OFFER_HAND, now_s, source=position_at(self.reach), plan_only=plan_only)
            return
        assert self.pick is not None
        assert self.place is not None
        ends = position_at(self.pick), position_at(self.place)
        client.start(RelocationGoal.KIND_RELOCATE, now_s, "", *ends, plan_only=plan_only)


class ReachTask:
    """Pass received messages to the `on_…` methods, then call `tick`. Begins when the arm is armed.

    All steps are planned before the first is executed; at the end the arm goes back to its base pose.

    Args:
        steps: What to do.
        run_name: Prefix of the goals' ids; unique to the process.

    Raises:
        InputError: There are no steps.

    Attributes:
        detail: What it does, as text.
        failure: Why it cannot go on; empty while it can.
        finished: Whether all is done.
    """

    def __init__(self, steps: Sequence[ReachStep], run_name: str) -> None:
        if not steps:
            raise InputError("no tasks: expected a list such as [{reach: [0.2, 0.0, 0.1]}], found none")
        self._steps = tuple(steps)
        self._client = GoalClient(ARM_BASE, 0.0, run_name)
        self._watch = ArmWatch(0.0)
        self._armed = self._planned = self._started = False
        self._done = 0
        self._output = OutgoingMessages()
        self._now_s = 0.0
        self._unarmed = "waiting for the arm's driver"
        self._unarmed_since_s, self._unarmed_reported = 0.0, ""
        self.detail = "planning the tasks"
        self.failure = ""
        self.finished = False

    def on_goal_status(self, status: RelocationStatus) -> None:
        """Follow the status of the current goal."""
        self._client.on_status(status)

    def on_safety(self, message: SafetyState) -> None:
        """Store the safety gate's state."""
        self._armed = message.state == SafetyState.STATE_ARMED
        self._watch.on_safety(message, self._now_s)
        why = "".join(f"; {fault.detail}" for fault in message.faults)
        self._unarmed = f"waiting until a person arms the arm (paramove arm enable){why}"

    def tick(self, now_ns: int) -> OutgoingMessages:
        """One tick; returns the messages to publish."""
        self._now_s = now_ns * 1e-9
        if not (self.finished or self.failure):
            self._go_on()
        self._client.step(self._now_s, self._output)
        output, self._output = self._output, OutgoingMessages()
        return output

    @property
    def _what(self) -> str:
        """The current step as text."""
        if self._done >= len(self._steps):
            return "going back to the base pose"
        return f"task {self._done + 1} of {len(self._steps)}, {self._steps[self._done].detail}"

    def _go_on(self) -> None:
        if self._watch.lost:
            self._fail(self._watch.detail)
            return
        if self._client.running:
            return
        outcome = self._client.outcome
        if self._started and outcome is not None:
            self._started = False
            if not self._client.succeeded:
                self._fail(outcome.reason)
                return
            self._done += 1
        if not self._planned and self._done < len(self._steps):
            self._start_step(plan_only=True)
        elif not self._planned:
            self._planned, self._done = True, 0
        elif self._done > len(self._steps):
            self.finished = True
            self._speak(f"all {len(self._steps)} tasks are done")
        elif not self._armed:
            self._wait()
        else:
            self._start_step(plan_only=False)

    def _start_step(self, plan_only: bool) -> None:
        self._started = True
        if self._done < len(self._steps):
            self._steps[self._done].start(self._client, self._now_s, plan_only)
        else:
            self._client.start(RelocationGoal.KIND_REST, self._now_s)
        if not plan_only:
            self._speak(self._what)

    def _wait(self) -> None:
        """For a driver and an armed arm."""
        if self.detail != self._unarmed:
            self.detail, self._unarmed_since_s = self._unarmed, self._now_s
        elif self._now_s - self._unarmed_since_s > REPORT_UNARMED_AFTER_S and self._unarmed_reported != self._unarmed:
            self._unarmed_reported = self._unarmed
            self._speak(self._unarmed)

    def _fail(self, why: str) -> None:
        self.failure = f"{self._what}: {why}"
        self._speak(self.failure, Speech.REQUEST_HELP)

    def _speak(self, detail: str, request: Speech.Request = Speech.REQUEST_UNSPECIFIED) -> None:
        self._output.speak(self._now_s, detail, request)
        self.detail = detail
        _log.info("%.1f s: %s", self._now_s, detail)
