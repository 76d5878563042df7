"""The stop button: said until confirmed, and honest about how far the stop has come."""

from __future__ import annotations

import pytest

from paramove.bus import topics
from paramove.bus.subscriber import Received
from paramove.dashboard.stop_button import Progress, StopButton
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState, StopRequest
from paramove.safety.gate_io import PERSON_STOP

SECOND = 1_000_000_000
SENTENCE = "stopped from the page by a person"


class Rig:
    """A button, a finger and what was said."""

    def __init__(self) -> None:
        self.pressed = False
        self.said: list[StopRequest] = []
        self.button = StopButton(self.take, self.said.append)

    def take(self) -> bool:
        pressed, self.pressed = self.pressed, False
        return pressed

    def gate(self, state: SafetyState.State, code: str | None, at_ns: int) -> None:
        faults = [SafetyFault(code=code, detail=SENTENCE)] if code else []
        self.button.handle(Received(topics.ARM_SAFETY, SafetyState(state=state, faults=faults), at_ns, at_ns, 1))


def test_not_pressed_says_nothing() -> None:
    rig = Rig()
    for _ in range(10):
        rig.button.look(SECOND)
    rig.gate(SafetyState.STATE_HOLD, "jump", SECOND)
    assert rig.said == []
    assert rig.button.progress is Progress.NOT_REQUESTED
    assert not rig.button.is_over(100 * SECOND)


def test_is_said_at_once_and_again_until_the_gate_confirms() -> None:
    rig = Rig()
    rig.pressed = True
    rig.button.look(7 * SECOND)
    assert [request.captured.ToNanoseconds() for request in rig.said] == [7 * SECOND]
    assert rig.said[0].source == "page"
    rig.gate(SafetyState.STATE_ARMED, None, 7 * SECOND)
    rig.button.look(8 * SECOND)
    assert len(rig.said) == 2
    assert rig.said[1] == rig.said[0]
    rig.gate(SafetyState.STATE_STOPPING, PERSON_STOP, 8 * SECOND)
    rig.pressed = True
    rig.button.look(9 * SECOND)
    assert len(rig.said) == 2
    assert rig.button.section() == {"progress": "stopping", "sentence": SENTENCE}


def test_another_fault_is_no_confirmation() -> None:
    rig = Rig()
    rig.pressed = True
    rig.button.look(SECOND)
    rig.gate(SafetyState.STATE_HOLD, "jump", SECOND)
    assert rig.button.progress is Progress.REQUESTED


@pytest.mark.parametrize("state", [SafetyState.STATE_HOLD, SafetyState.STATE_ESTOP])
def test_the_run_ends_a_while_after_the_arm_rests(state: SafetyState.State) -> None:
    rig = Rig()
    rig.pressed = True
    rig.button.look(SECOND)
    rig.gate(state, PERSON_STOP, 2 * SECOND)
    rig.gate(state, PERSON_STOP, 4 * SECOND)
    assert rig.button.progress is Progress.STOPPED
    assert not rig.button.is_over(4 * SECOND)
    assert rig.button.is_over(5 * SECOND)


def test_a_page_that_was_restarted_knows_of_the_stop_by_the_gate() -> None:
    rig = Rig()
    rig.gate(SafetyState.STATE_HOLD, PERSON_STOP, SECOND)
    assert rig.button.progress is Progress.STOPPED
    assert rig.said == []


def test_a_stop_of_two_arms_is_over_when_both_are_at_rest() -> None:
    rig = Rig()
    left, right = (topics.topic_in(name, topics.ARM_SAFETY) for name in ("left", "right"))

    def gate(topic: topics.Topic, state: SafetyState.State, code: str | None) -> None:
        faults = [SafetyFault(code=code, detail=SENTENCE)] if code else []
        rig.button.handle(Received(topic, SafetyState(state=state, faults=faults), SECOND, SECOND, 1))

    gate(left, SafetyState.STATE_ARMED, None)
    gate(right, SafetyState.STATE_ARMED, None)
    rig.pressed = True
    rig.button.look(SECOND)
    gate(left, SafetyState.STATE_HOLD, PERSON_STOP)
    rig.button.look(SECOND)
    assert len(rig.said) == 2, "the right arm has not confirmed it"
    assert rig.button.progress is Progress.REQUESTED
    gate(right, SafetyState.STATE_STOPPING, PERSON_STOP)
    assert rig.button.progress is Progress.STOPPING
    gate(right, SafetyState.STATE_HOLD, PERSON_STOP)
    assert rig.button.progress is Progress.STOPPED
