"""The operator in simulation: arms the gate once at the start of a run, as a person does on a real robot."""

from __future__ import annotations

from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState

REAL_ROBOT = (
    "the operator node does not arm a real robot: a person must, who sees the robot and can reach its motor power "
    "switch; leave this node out or start with the sim overlay"
)
TRIES_APART_NS = 1_000_000_000


class Operator:
    """Says one arm word once the gate is disarmed, again each second until it is armed, and never after that.

    Waiting for the gate's own word makes the order in which the nodes start irrelevant.

    Args:
        arms_at_start: False: it never arms.
    """

    def __init__(self, arms_at_start: bool) -> None:
        self._to_arm = arms_at_start
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
        request = ArmRequest(source="operator node", armed=True, reason="start of a simulated run")
        request.captured.FromNanoseconds(now_ns)
        return request
