"""The operator in simulation: arms the gate once at the start of a run, as a person does on a real robot."""

from __future__ import annotations

from pathlib import Path

from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState

REAL_ROBOT = (
    "the operator node does not arm a real robot: a person must, who sees the robot and can reach its motor power "
    "switch; leave this node out or start with the sim overlay"
)
ARMED_BEFORE = "an operator of this run has armed before; once the arm is disarmed only a person arms it again"
TRIES_APART_NS = 1_000_000_000


class Operator:
    """Says one arm word once the gate is disarmed, again each second until it is armed, and never after that.

    Waiting for the gate's own word makes the order in which the nodes start irrelevant.

    Args:
        arms_at_start: False: it never arms.
        memory: A file that is made with the first arm word. If it exists already, an earlier process of this run has
            armed, and this one does not: what is disarmed now was disarmed by a fault or by a person.
    """

    def __init__(self, arms_at_start: bool, memory: Path | None = None) -> None:
        self._memory = memory
        self._to_arm = arms_at_start and not (memory is not None and memory.exists())
        self.sentence = "arms once at the start" if arms_at_start else "does not arm"
        if arms_at_start and not self._to_arm:
            self.sentence = f"does not arm: {ARMED_BEFORE}"
        self._said_ns: int | None = None

    def update(self, safety: SafetyState, now_ns: int) -> ArmRequest | None:
        """Hear the gate's state; returns the word to say, if any."""
        if safety.state == SafetyState.STATE_ARMED:
            self._to_arm = False
        if not self._to_arm or safety.state != SafetyState.STATE_DISARMED:
            return None
        if self._said_ns is not None and now_ns - self._said_ns < TRIES_APART_NS:
            return None
        self._said_ns = now_ns
        if self._memory is not None:
            self._memory.touch()
        request = ArmRequest(source="operator node", armed=True, reason="start of a simulated run")
        request.captured.FromNanoseconds(now_ns)
        return request
