"""The key that arms an arm: from a press to a word that the safety gate can hear, or to a sentence why it cannot."""

from __future__ import annotations

from paramove.msgs.safety_state_pb2 import SafetyState

WAITS_S = 1.0
"""For a gate that cannot hear the word yet: so long a person who pressed a key still looks."""
ANSWER_S = 2.0
"""The driver looks at all servos before it answers."""
HEARING = (SafetyState.STATE_DISARMED, SafetyState.STATE_HOLD)


class ArmingKey:
    """`press`, `hear` what the gate says, and `tick` often: it is true once a press, when the word is to be said.

    Attributes:
        sentence: What became of the last press, or why the gate has stopped the arm.
    """

    def __init__(self) -> None:
        self.sentence = ""
        self._gate = SafetyState()
        self._stopped_ns = 0
        self._pressed_s: float | None = None
        self._said_s: float | None = None
        self._faults_before = ""

    @property
    def state(self) -> str:
        """Of the gate, in small letters; "" before it was heard."""
        name: str = SafetyState.State.Name(self._gate.state)
        return "" if self._gate.state == SafetyState.STATE_UNSPECIFIED else name.removeprefix("STATE_").lower()

    def press(self, now_s: float) -> None:
        """A person wants the arm armed."""
        self._pressed_s, self._said_s = now_s, None

    def handle(self, gate: SafetyState) -> None:
        """The gate's state; where it has just stopped the arm, that is told."""
        if gate.captured.ToNanoseconds() < self._stopped_ns:
            return
        before, self._gate = self._gate.state, gate
        if gate.state == SafetyState.STATE_ARMED and self._said_s is not None:
            self.sentence, self._said_s = "armed", None
        elif self._said_s is not None and self._faults not in ("", self._faults_before):
            self.refuse(self._faults)
        elif before != gate.state and self._faults and self._said_s is None:
            self.sentence = self._faults

    def tick(self, now_s: float) -> bool:
        """Whether the word to arm is to be said now."""
        if self._said_s is not None and now_s - self._said_s > ANSWER_S:
            self.refuse(self._faults or f"no answer within {ANSWER_S:g} s; press a again")
        if self._pressed_s is None:
            return False
        if self._gate.state in HEARING:
            self._pressed_s, self._said_s = None, now_s
            self._faults_before, self.sentence = self._faults, "looking at the servos"
            return True
        self.sentence = "the arm still stops: it is armed once it rests"
        if self._gate.state == SafetyState.STATE_ARMED:
            self.sentence, self._pressed_s = "armed already", None
        elif self._gate.state != SafetyState.STATE_STOPPING:
            self.refuse(self._faults or "the safety gate is not heard")
        elif now_s - self._pressed_s > WAITS_S:
            self.refuse(f"the arm has not come to rest within {WAITS_S:g} s; press a again once it does")
        return False

    def stopped(self, answer: SafetyState) -> None:
        """The gate has answered a stop of this person: what it published before counts no more."""
        self._gate, self._stopped_ns = answer, answer.captured.ToNanoseconds()

    def cancel(self) -> None:
        """What was pressed before counts no more: somebody wants the arm to stop."""
        self._pressed_s = self._said_s = None

    def refuse(self, why: str) -> None:
        """It is not armed, for this reason; the press is over."""
        self.sentence = f"not armed: {why}"
        self.cancel()

    @property
    def _faults(self) -> str:
        return "; ".join(fault.sentence for fault in self._gate.faults)
