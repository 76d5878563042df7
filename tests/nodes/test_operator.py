"""The operator's node arms once in simulation, replayed from recordings of the gate's state."""

from pathlib import Path

import pytest

from nodes import operator
from paramove.bus import START_VARIABLE, topics
from paramove.bus.recorded import RecordedBus
from paramove.bus.subscriber import Received
from paramove.msgs.safety_state_pb2 import SafetyState

SECOND = 1_000_000_000


@pytest.fixture(autouse=True)
def started_once(monkeypatch):
    monkeypatch.setenv(START_VARIABLE, "1")


def replayed(folder: Path, arms_at_start: bool, *states: SafetyState.State) -> RecordedBus:
    """The gate says a state each second."""
    heard = [
        Received(topics.ARM_SAFETY, SafetyState(state=state), number * SECOND, number * SECOND, number)
        for number, state in enumerate(states, start=1)
    ]
    bus = RecordedBus(heard, run_folder=folder)
    operator.run(bus, operator.Config(arms_at_start=arms_at_start))
    return bus


def test_arms_once_and_never_again(tmp_path: Path) -> None:
    disarmed, armed = SafetyState.STATE_DISARMED, SafetyState.STATE_ARMED
    bus = replayed(
        tmp_path, True, SafetyState.STATE_DISCONNECTED, disarmed, armed, armed, SafetyState.STATE_HOLD, disarmed
    )
    (word,) = bus.published
    assert word.topic is topics.OPERATOR_ARM_AT_START
    assert word.message.armed
    assert word.message.captured.ToNanoseconds() == word.published_ns == 2 * SECOND
    assert bus.states == [("ready", "arms once at the start")]


def test_does_not_arm_unless_told(tmp_path: Path) -> None:
    bus = replayed(tmp_path, False, SafetyState.STATE_DISARMED, SafetyState.STATE_DISARMED)
    assert bus.published == []
    assert bus.states == [("ready", "does not arm")]


@pytest.mark.parametrize("start", ["2", ""])
def test_a_new_process_in_the_same_run_does_not_arm_again(tmp_path: Path, monkeypatch, start) -> None:
    disarmed = SafetyState.STATE_DISARMED
    monkeypatch.setenv(START_VARIABLE, start)
    bus = replayed(tmp_path, True, SafetyState.STATE_DISCONNECTED, disarmed, disarmed, disarmed)
    assert bus.published == []
    (state,) = bus.states
    assert state[0] == "ready"
    assert "only a person arms" in state[1]
