"""The key that arms an arm: from a press to an arming request, or to the reason why the arm cannot be armed."""

from __future__ import annotations

from paramove.msgs.safety_state_pb2 import SafetyState

PRESS_VALID_S = 1.0
"""How long a press stays valid while the gate cannot accept a request: the person is still looking at the arm."""
ANSWER_TIMEOUT_S = 2.0
"""The driver checks all servos before it answers."""
ACCEPTING = (SafetyState.STATE_DISARMED, SafetyState.STATE_HOLD)


class ArmingKey:
    """Call `press`, `handle` with the gate's states, and `tick` often: it is true when the request is to be sent.

    Attributes:
        detail: Result of the last press, or why the gate has stopped the arm.
    """

    def __init__(self) -> None:
        self.detail = ""
        self._gate = SafetyState()
        self._stopped_ns = 0
        self._pressed_s: float | None = None
        self._requested_s: float | None = None
        self._faults_before = ""

    @property
    def state(self) -> str:
        """Of the gate, in small letters; "" before the first state."""
        name: str = SafetyState.State.Name(self._gate.state)
        return "" if self._gate.state == SafetyState.STATE_UNSPECIFIED else name.removeprefix("STATE_").lower()

    def press(self, now_s: float) -> None:
        """A person requests arming."""
        self._pressed_s, self._requested_s = now_s, None

    def handle(self, gate: SafetyState) -> None:
        """Handles the gate's state; `sentence` reports a stop."""
        if gate.captured.ToNanoseconds() < self._stopped_ns:
            return
        before, self._gate = self._gate.state, gate
        if gate.state == SafetyState.STATE_ARMED and self._requested_s is not None:
            self.detail, self._requested_s = "armed", None
        elif self._requested_s is not None and self._faults not in ("", self._faults_before):
            self.reject(self._faults)
        elif before != gate.state and self._faults and self._requested_s is None:
            self.detail = self._faults

    def tick(self, now_s: float) -> bool:
        """Whether to send the arming request now."""
        if self._requested_s is not None and now_s - self._requested_s > ANSWER_TIMEOUT_S:
            self.reject(self._faults or f"no answer within {ANSWER_TIMEOUT_S:g} s; press a again")
        if self._pressed_s is None:
            return False
        if self._gate.state in ACCEPTING:
            self._pressed_s, self._requested_s = None, now_s
            self._faults_before, self.detail = self._faults, "checking the servos"
            return True
        self.detail = "the arm is still stopping: it is armed once it rests"
        if self._gate.state == SafetyState.STATE_ARMED:
            self.detail, self._pressed_s = "already armed", None
        elif self._gate.state != SafetyState.STATE_STOPPING:
            self.reject(self._faults or "no data from the safety gate")
        elif now_s - self._pressed_s > PRESS_VALID_S:
            self.reject(f"the arm has not come to rest within {PRESS_VALID_S:g} s; press a again once it does")
        return False

    def stopped(self, answer: SafetyState) -> None:
        """Handles the gate's answer to this person's stop: earlier states are ignored from now on."""
        self._gate, self._stopped_ns = answer, answer.captured.ToNanoseconds()

    def cancel(self) -> None:
        """Cancels a press, because a stop was requested."""
        self._pressed_s = self._requested_s = None

    def reject(self, why: str) -> None:
        """Reports why the arm is not armed, and cancels the press."""
        self.detail = f"not armed: {why}"
        self.cancel()

    @property
    def _faults(self) -> str:
        return "; ".join(fault.detail for fault in self._gate.faults)
