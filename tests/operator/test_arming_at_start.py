"""The operator arms once in simulation and never a real robot."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from nodes.operator import Config
from paramove.msgs.safety_state_pb2 import SafetyState
from paramove.operator.arming_at_start import Operator

SECOND = 1_000_000_000


def said(state: SafetyState.State) -> SafetyState:
    return SafetyState(state=state)


def test_arms_once_when_the_gate_is_disarmed() -> None:
    operator = Operator(arms_at_start=True)
    assert operator.update(said(SafetyState.STATE_DISCONNECTED), 0) is None
    request = operator.update(said(SafetyState.STATE_DISARMED), SECOND)
    assert request is not None
    assert request.armed
    assert (request.source, request.reason) == ("operator node", "start of a simulated run")
    assert request.captured.ToNanoseconds() == SECOND
    assert operator.update(said(SafetyState.STATE_DISARMED), SECOND + SECOND // 15) is None
    assert not request.by_person
    assert operator.update(said(SafetyState.STATE_DISARMED), 2 * SECOND) is not None  # the word was lost
    for state in (SafetyState.STATE_ARMED, SafetyState.STATE_HOLD, SafetyState.STATE_DISARMED):
        assert operator.update(said(state), 9 * SECOND) is None


def test_a_gate_found_armed_or_in_hold_is_left_alone() -> None:
    for state in (SafetyState.STATE_ARMED, SafetyState.STATE_HOLD, SafetyState.STATE_ESTOP):
        assert Operator(arms_at_start=True).update(said(state), 0) is None


def test_without_leave_it_never_arms() -> None:
    assert Operator(arms_at_start=False).update(said(SafetyState.STATE_DISARMED), 0) is None


@pytest.mark.parametrize("state", ["STOPPING", "HOLD", "ESTOP"])
def test_after_anything_but_waiting_it_never_arms_even_if_it_had_asked_for_nothing_yet(state: str) -> None:
    operator = Operator(arms_at_start=True)
    assert operator.update(said(SafetyState.STATE_DISCONNECTED), 0) is None
    assert operator.update(said(getattr(SafetyState, f"STATE_{state}")), SECOND) is None
    for later in range(2, 9):
        assert operator.update(said(SafetyState.STATE_DISARMED), later * SECOND) is None


def test_started_anew_it_arms_no_more() -> None:
    operator = Operator(arms_at_start=True, restarted=True)
    assert operator.update(said(SafetyState.STATE_DISARMED), 0) is None
    assert operator.detail.startswith("does not arm: it was started before in this run")
    assert Operator(arms_at_start=False, restarted=True).detail == "does not arm"


def test_a_real_robot_is_for_a_person_to_arm() -> None:
    assert not Config.model_validate({"arms_at_start": True}).real
    with pytest.raises(ValidationError, match="a person must"):
        Config.model_validate({"arms_at_start": True, "real": True})
