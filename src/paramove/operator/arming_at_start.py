"""The operator of an emulated robot: arms the gate once at the start of a run, as a person does on a real robot."""

from __future__ import annotations

from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState

REAL_ROBOT = (
    "the operator node does not arm a real robot: a person must, who sees the robot and can reach its motor power "
    "switch; leave this node out or start with the sim overlay"
)
BEFORE_ARMED = (SafetyState.STATE_UNSPECIFIED, SafetyState.STATE_DISCONNECTED, SafetyState.STATE_DISARMED)
RETRY_PERIOD_NS = 1_000_000_000


class Operator:
    """Publishes one arming request once the gate is disarmed, again each second until it is armed for the first time.

    Waiting for the gate's own state makes the order in which the nodes start irrelevant. It ends with any other
    state of the gate, such as a stop: then only a person arms. The gate rejects it in that case, too, and wherever it
    is not verified that the robot is emulated.

    Args:
        arms_at_start: Whether it arms at all.
        restarted: Whether an earlier process of this run was the operator: this one does not arm.
    """

    def __init__(self, arms_at_start: bool, restarted: bool = False) -> None:
        self._to_arm = arms_at_start and not restarted
        self.detail = "arms once at the start" if arms_at_start else "does not arm"
        if arms_at_start and restarted:
            self.detail = "does not arm: it was started before in this run, so only a person arms"
        self._requested_ns: int | None = None

    def update(self, safety: SafetyState, now_ns: int) -> ArmRequest | None:
        """The request to publish in this state of the gate, if any."""
        self._to_arm &= safety.state in BEFORE_ARMED
        if not self._to_arm or safety.state != SafetyState.STATE_DISARMED:
            return None
        if self._requested_ns is not None and now_ns - self._requested_ns < RETRY_PERIOD_NS:
            return None
        self._requested_ns = now_ns
        request = ArmRequest(source="operator node", armed=True, reason="start of a simulated run")
        request.captured.FromNanoseconds(now_ns)
        return request
