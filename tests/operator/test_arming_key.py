"""A press of the key that arms is heard by the gate, or tells at once why it is not."""

import pytest

from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState
from paramove.operator.arming_key import ANSWER_TIMEOUT_S, PRESS_VALID_S, ArmingKey


def gate(state, *sentences):
    faults = [SafetyFault(code=detail, detail=detail) for detail in sentences]
    return SafetyState(state=getattr(SafetyState, f"STATE_{state}"), faults=faults)


def hearing(state, *sentences):
    key = ArmingKey()
    key.handle(gate(state, *sentences))
    return key


@pytest.mark.parametrize("state", ["DISARMED", "HOLD"])
def test_a_gate_that_hears_is_told_once_and_its_answer_is_shown(state):
    key = hearing(state, "stopped by a person")
    key.press(1.0)
    assert [key.tick(1.0), key.tick(1.1)] == [True, False]
    key.handle(gate(state, "stopped by a person"))
    assert key.detail == "checking the servos"
    key.handle(gate("ARMED"))
    assert (key.detail, key.state, key.tick(9.0)) == ("armed", "armed", False)


def test_pressed_while_the_arm_stops_it_is_heard_once_the_arm_rests():
    key = hearing("STOPPING", "stopped by a person")
    key.press(1.0)
    assert not key.tick(1.0)
    assert key.detail == "the arm is still stopping: it is armed once it rests"
    key.handle(gate("HOLD", "stopped by a person"))
    assert key.tick(1.0 + PRESS_VALID_S)


def test_nobody_is_armed_by_a_key_that_was_pressed_long_ago():
    key = hearing("STOPPING", "stopped by a person")
    key.press(1.0)
    assert not key.tick(1.1 + PRESS_VALID_S)
    assert key.detail == "not armed: the arm has not come to rest within 1 s; press a again once it does"
    key.handle(gate("HOLD", "stopped by a person"))
    assert not key.tick(2.5)


def test_a_stop_that_is_pressed_afterwards_counts_more():
    key = hearing("STOPPING")
    key.press(1.0)
    key.cancel()
    key.handle(gate("HOLD"))
    assert not key.tick(1.1)


def test_a_key_after_a_stop_arms_although_the_gate_was_last_heard_armed():
    """What the gate published before the stop comes in only after its answer, or is the last that is known."""
    key, before, answer = hearing("ARMED"), gate("ARMED"), gate("STOPPING", "stopped by a person")
    before.captured.FromNanoseconds(1)
    answer.captured.FromNanoseconds(2)
    key.cancel()
    key.stopped(answer)
    key.handle(before)
    key.press(1.0)
    assert not key.tick(1.0)
    rests = gate("HOLD", "stopped by a person")
    rests.captured.FromNanoseconds(3)
    key.handle(rests)
    assert key.tick(1.1)


@pytest.mark.parametrize(
    ("state", "sentences", "told"),
    [
        ("DISCONNECTED", ["the port went away"], "not armed: the port went away"),
        ("ESTOP", ["the emergency stop is pressed"], "not armed: the emergency stop is pressed"),
        ("UNSPECIFIED", [], "not armed: no data from the safety gate"),
        ("ARMED", [], "already armed"),
    ],
)
def test_a_gate_that_does_not_hear_is_told_at_once(state, sentences, told):
    key = hearing(state, *sentences)
    key.press(1.0)
    assert not key.tick(1.0)
    assert key.detail == told


def test_a_refusal_is_told_with_every_reason():
    key = hearing("HOLD", "stopped by a person")
    key.press(1.0)
    assert key.tick(1.0)
    key.handle(gate("HOLD", "servo 12 is silent", "servo 13 is hot"))
    assert key.detail == "not armed: servo 12 is silent; servo 13 is hot"


@pytest.mark.parametrize(
    ("sentences", "told"),
    [(["servo 12 is silent"], "not armed: servo 12 is silent"), ([], "not armed: no answer within 2 s; press a again")],
)
def test_the_same_refusal_again_and_no_answer_at_all_are_told_after_a_while(sentences, told):
    key = hearing("DISARMED", *sentences)
    key.press(1.0)
    assert key.tick(1.0)
    key.handle(gate("DISARMED", *sentences))
    key.tick(1.1 + ANSWER_TIMEOUT_S)
    assert key.detail == told


def test_why_the_gate_has_stopped_the_arm_is_told_without_a_key():
    key = hearing("ARMED")
    key.handle(gate("HOLD", "servo 12 is hot"))
    assert key.detail == "servo 12 is hot"
