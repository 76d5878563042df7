"""A person's stop: the arm comes to rest along its path and stays there, whatever the gate was doing."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.safety_state_pb2 import SafetyState, StopRequest
from paramove.safety.gate_io import PERSON_STOP, State
from tests.robots.streaming.fake_robot import Rig, armed

GOAL = {"right_shoulder_pitch": 40.0, "right_elbow": -70.0}
PRESSED = StopRequest(source="page")
SENTENCE = "stopped from the page by a person"


def faults(rig: Rig) -> list[tuple[str, str]]:
    assert rig.output is not None
    return [(fault.code, fault.detail) for fault in rig.output.safety.faults]


def test_the_tick_after_the_stop_begins_to_stop_and_the_arm_then_holds() -> None:
    rig = armed()
    rig.send("one", GOAL, duration_s=2.0)
    for _ in range(8):
        rig.tick()
    rig.driver.on_stop(PRESSED)
    output = rig.tick()
    assert output is not None
    assert output.safety.state == SafetyState.STATE_STOPPING
    assert output.stream is not None
    assert output.stream.stop_ramp_frames == len(output.stream.frames)  # nothing but the ramp
    for _ in range(20):
        rig.tick()
    assert rig.driver.state is State.HOLD
    assert faults(rig) == [(PERSON_STOP, SENTENCE)]
    assert rig.statuses[-1].state == TrajectoryStatus.STATE_STOPPED
    assert rig.statuses[-1].reason == SENTENCE
    resting = rig.robot.reader.target.copy()
    rig.send("two", GOAL)
    rig.tick()
    assert rig.statuses[-1].state == TrajectoryStatus.STATE_REJECTED
    np.testing.assert_array_equal(rig.robot.reader.target, resting)


def test_pressed_again_it_changes_nothing() -> None:
    rig = armed()
    rig.send("one", GOAL, duration_s=2.0)
    for _ in range(8):
        rig.tick()
    for _ in range(30):
        rig.driver.on_stop(PRESSED)
        rig.tick()
    assert rig.driver.state is State.HOLD
    assert faults(rig) == [(PERSON_STOP, SENTENCE)]


def test_a_stop_from_before_the_driver_began_is_no_reason_for_how_it_stands() -> None:
    rig = Rig(no_program="")
    rig.tick()
    rig.driver.on_stop(PRESSED, resent=True)
    rig.arm(by_person=False)
    assert rig.driver.state is State.DISARMED
    assert [code for code, _ in faults(rig)] == ["arming_program"]  # it was stopped all the same
    rig.arm()
    assert rig.driver.state is State.ARMED
    rig.driver.on_stop(PRESSED)
    rig.tick()
    assert faults(rig) == [(PERSON_STOP, SENTENCE)]


def test_a_stop_that_is_sent_again_stops_an_arm_that_may_move() -> None:
    """In doubt it is a new one: its publisher may have been found after it was published."""
    rig = armed()
    rig.driver.on_stop(PRESSED, resent=True)
    rig.tick()
    assert rig.driver.state is State.HOLD
    assert faults(rig) == [(PERSON_STOP, SENTENCE)]


@pytest.mark.parametrize("later", [False, True])
def test_pressed_before_it_is_armed_only_a_later_arm_word_arms(later: bool) -> None:
    rig = Rig()
    rig.tick()
    rig.driver.on_stop(PRESSED)
    if later:
        rig.tick()
        assert rig.driver.state is State.HOLD
    rig.arm()  # with `later` False, in the same period: the stop wins
    assert rig.driver.state is (State.ARMED if later else State.HOLD)


def test_a_stop_wins_against_a_disarm_word() -> None:
    rig = armed()
    rig.send("one", GOAL, duration_s=2.0)
    for _ in range(8):
        rig.tick()
    rig.driver.on_stop(PRESSED)
    rig.arm(armed=False)
    for _ in range(20):
        rig.tick()
    assert rig.driver.state is State.HOLD


def test_pressed_while_the_robot_is_silent_it_is_kept() -> None:
    rig = Rig()
    rig.driver.on_stop(PRESSED)
    rig.driver.tick(rig.now_ns)
    assert rig.driver.state is State.DISCONNECTED
    rig.tick()
    assert rig.driver.state is State.HOLD
    assert faults(rig) == [(PERSON_STOP, SENTENCE)]
