"""A person's word to arm or disarm from outside of a run, and the safety gate's answer to it."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import zmq

from paramove.bus import BusVisitor, Subscriber, publish_now, topics
from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState

LOOKS_EVERY_S = 0.02
TERMINAL = "terminal"
"""Source of the word."""


def arm_by_word(folder: Path, armed: bool, timeout_s: float) -> SafetyState | None:
    """Say a word to arm or disarm, once, and hear what the gate makes of it.

    The word is said once: said again, it could arm an arm that a fault has just stopped.

    Args:
        folder: Of the run's bus.
        armed: Whether to arm.
        timeout_s: To wait for the gate, and again for its answer.

    Returns:
        The gate's latest state: armed or not as was asked for, or with the faults for which it refuses; that from
        before the word if it changes nothing. None if there is no gate.

    Raises:
        TopicTakenError: Another program says the word, such as the operator of a simulated run.
        BusFolderError: The folder cannot be used.
    """
    with BusVisitor(folder, "arm_by_word") as bus:
        publisher, gate = bus.publisher(topics.OPERATOR_ARM), bus.subscriber(topics.ARM_SAFETY)
        before = _until(gate, timeout_s, lambda state: True)
        if before is None or obeyed(before, armed):
            return before
        publish_now(publisher, ArmRequest(source=TERMINAL, armed=armed, reason="enabled", by_person=True))

        def is_answer(state: SafetyState) -> bool:
            return obeyed(state, armed) or (armed and _faults(state) not in ([], _faults(before)))

        return _until(gate, timeout_s, is_answer, publisher.serve) or before


def obeyed(state: SafetyState, armed: bool) -> bool:
    """Whether the gate is as the word wants it."""
    is_armed = state.state == SafetyState.STATE_ARMED
    return is_armed if armed else state.state == SafetyState.STATE_DISARMED


def _faults(state: SafetyState) -> list[str]:
    return [fault.sentence for fault in state.faults]


def _until(
    gate: Subscriber,
    timeout_s: float,
    is_it: Callable[[SafetyState], bool],
    meanwhile: Callable[[], None] = lambda: None,
) -> SafetyState | None:
    """The first state for which `is_it`, else the latest that is heard; None if none is."""
    end_s = time.monotonic() + timeout_s
    latest: SafetyState | None = None
    while time.monotonic() < end_s:
        meanwhile()
        gate.revive()
        gate.socket.poll(int(1e3 * LOOKS_EVERY_S), zmq.POLLIN)
        while (heard := gate.receive()) is not None:
            state: SafetyState = heard.message
            if is_it(state):
                return state
            latest = state
    return latest
