"""Whether the robot's arm is armed: an application can execute no goal while it is not."""

from __future__ import annotations

from paramove.msgs.safety_state_pb2 import SafetyState

UNARMED_S = 2.0
"""A program arms an emulated arm within this time; then a person is needed."""
_AT_WORK = (SafetyState.STATE_ARMED, SafetyState.STATE_STOPPING)


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
