"""The emergency stop: it wins in every state, and only its release and then a new arm word end it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.safety_steps import MS
from paramove.safety.gate_io import ArmingRequest, Fault, SafetySettings, State
from tests.safety.small_arm import LIMITS, SmallArm

STOP = Fault("overload", "elbow", "too hot")


def pressed_in(state: State) -> SmallArm:
    """A gate in `state`, just before the stop is pressed."""
    arm = SmallArm()
    if state is State.DISCONNECTED:
        arm.step(measured=None)
    elif state is State.ARMED:
        arm.arm()
    elif state is State.STOPPING:
        arm.in_motion()
        arm.step(proposal=arm.proposal, stop=STOP)
    elif state is State.HOLD:
        arm.step(stop=STOP)
    elif state is State.ESTOP:
        arm.step(emergency=True)
    else:
        arm.step()
    assert arm.core.state is state
    return arm


@pytest.mark.parametrize("state", list(State))
def test_it_wins_in_every_state_and_a_word_to_arm_changes_nothing(state: State) -> None:
    arm = pressed_in(state)
    for _ in range(3):
        targets, now_state, faults = arm.arm(emergency=True, proposal=arm.proposal)
        assert now_state is State.ESTOP
        assert targets is None
        assert faults.count("emergency_stop") == 1
    for _ in range(100):
        arm.step(emergency=None)
    assert arm.core.state is State.ESTOP
    assert arm.at_rest


@pytest.mark.parametrize("state", list(State))
def test_its_release_disarms_and_moves_nothing(state: State) -> None:
    arm = pressed_in(state)
    said_while_pressed = arm.now + 5 * MS
    arm.step(emergency=True)
    for _ in range(60):
        arm.step(emergency=True)
    pose = arm.stream[-1]
    targets, now_state, _ = arm.step(emergency=False, proposal=arm.proposal)
    assert (targets, now_state) == (None, State.DISARMED)
    word = ArmingRequest(said_while_pressed, "a person", True, by_person=True)
    assert arm.step(emergency=False, word=word)[1] is State.DISARMED
    for _ in range(20):
        assert arm.step(proposal=arm.proposal)[0] is None
    np.testing.assert_array_equal(arm.stream[-1], pose)
    assert arm.arm()[1:] == (State.ARMED, ())


def test_in_motion_the_stop_begins_with_the_press_and_is_smooth() -> None:
    arm = SmallArm()
    arm.in_motion()
    before = arm.stream[: arm.played + 1]
    targets, state, faults = arm.step(emergency=True, proposal=arm.proposal)
    assert (state, faults) == (State.ESTOP, ("emergency_stop",))
    assert targets is not None
    assert targets.ramp_rows == len(targets.rows)
    assert targets.first_index <= arm.played + 2
    whole = arm.stream[: targets.first_index + 1]
    np.testing.assert_array_equal(whole[: len(before)], before)
    assert LIMITS.first_violation(targets.rows, whole, stopping=True) is None
    # Released while it still slows down: first to rest, then disarmed.
    assert not arm.at_rest
    assert arm.step(emergency=False)[1] is State.STOPPING
    for _ in range(60):
        arm.step()
    assert arm.core.state is State.DISARMED


def test_without_a_proposal_or_a_report_what_was_given_ends_in_its_own_ramp() -> None:
    for said in ({"proposal": None}, {"measured": None}):
        arm = SmallArm()
        arm.in_motion()
        arguments = {"proposal": arm.proposal, "emergency": True, **said}
        targets, state, _ = arm.step(**arguments)
        assert (targets, state) == (None, State.ESTOP)


def test_pressed_twice_or_flickering_it_stays_one_stop() -> None:
    arm = SmallArm()
    arm.in_motion()
    given = 0
    for pressed in (True, False, True, None, False, True, True, False):
        targets, state, faults = arm.step(emergency=pressed, proposal=arm.proposal)
        given += targets is not None
        assert state in (State.ESTOP, State.STOPPING)
        assert faults == ("emergency_stop",)
    assert given == 1
    for _ in range(60):
        arm.step()
    assert arm.core.state is State.DISARMED


def test_a_source_that_goes_silent_stops_the_arm_and_its_return_disarms() -> None:
    arm = SmallArm(SafetySettings(emergency_timeout_ms=500.0))
    arm.arm(emergency=False)
    for _ in range(50):
        assert arm.step()[1] is State.ARMED
    targets, state, faults = arm.step()
    assert (targets, state, faults) == (None, State.ESTOP, ("emergency_silent",))
    assert arm.step(emergency=False)[1] is State.DISARMED
    assert arm.arm(emergency=False)[1] is State.ARMED


def test_faults_found_while_pressed_are_told_too() -> None:
    arm = SmallArm()
    arm.arm()
    assert arm.step(emergency=True, stop=STOP)[2] == ("emergency_stop", "overload")
    assert arm.step(emergency=True, stop=STOP)[2] == ("emergency_stop", "overload")
    assert arm.step(emergency=False)[1] is State.DISARMED


def test_released_without_a_robot_it_is_disconnected() -> None:
    arm = SmallArm()
    arm.arm()
    arm.step(emergency=True)
    assert arm.step(emergency=False, measured=None, ms=300)[1] is State.STOPPING
    assert arm.step(measured=None, ms=300)[1:] == (State.DISCONNECTED, ("emergency_stop", "robot_silent"))
    assert arm.step()[1] is State.DISARMED
