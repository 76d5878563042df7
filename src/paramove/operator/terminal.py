"""A person's requests from outside of a run, to arm, to disarm or to stop, and the safety gate's answers."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from pathlib import Path

import zmq

from paramove.bus import BusVisitor, Subscriber, TopicTakenError, inspection, publish_now, topics
from paramove.msgs.safety_state_pb2 import ArmRequest, SafetyState, StopRequest
from paramove.safety import PERSON_STOP

POLL_PERIOD_S = 0.02
"""Also from one publication of a stop to the next."""
TERMINAL = "terminal"
"""Source of the request."""


def request_arming(folder: Path, armed: bool, timeout_s: float, namespace: str = "") -> SafetyState | None:
    """Publishes one request to arm or disarm and waits for the gate's answer.

    It is not repeated: a repetition could arm an arm that a fault has just stopped.

    Args:
        folder: Of the run's bus.
        armed: Whether to arm.
        timeout_s: To wait for the gate, and again for its answer.
        namespace: Of the arm.

    Returns:
        The gate's latest state: armed or not as requested, or with the faults for which it rejects; that from
        before the request if it changes nothing. None if there is no gate.

    Raises:
        TopicTakenError: Another program publishes the topic, such as the operator of a simulated run.
        BusFolderError: The folder cannot be used.
    """
    with BusVisitor(folder, "request_arming") as bus:
        requests, states = (topics.topic_in(namespace, one) for one in (topics.OPERATOR_ARM, topics.ARM_SAFETY))
        publisher, gate = bus.publisher(requests), bus.subscriber(states)
        before = _until(gate, timeout_s, lambda state: True)
        if before is None or obeyed(before, armed):
            return before
        publish_now(publisher, ArmRequest(source=TERMINAL, armed=armed, reason="enabled", by_person=True))

        def is_answer(state: SafetyState) -> bool:
            return obeyed(state, armed) or (armed and _faults(state) not in ([], _faults(before)))

        return _until(gate, timeout_s, is_answer, publisher.serve) or before


def obeyed(state: SafetyState, armed: bool) -> bool:
    """Whether the gate is in the requested state."""
    is_armed = state.state == SafetyState.STATE_ARMED
    return is_armed if armed else state.state == SafetyState.STATE_DISARMED


def stop_arms(folder: Path, source: str, timeout_s: float) -> dict[str, SafetyState | None]:
    """Publishes a stop on all free topics of stops, until every gate has latched it or the timeout has passed.

    Args:
        folder: Of the run's bus.
        source: Where the person pressed, or "program NAME", for the message of the fault that the gate latches.
        timeout_s: To wait for the gates' answers.

    Returns:
        By the arm's namespace the answer of its gate, None if there was none; of a run in which no gate is found, that
        none has answered.

    Raises:
        TopicTakenError: Other programs publish all topics of stops, such as the live page and another terminal.
        BusFolderError: The folder cannot be used.
    """
    request = StopRequest(source=source)
    request.captured.FromNanoseconds(time.monotonic_ns())
    with BusVisitor(folder, "estop") as bus:
        publishers = []
        for topic in topics.PERSONS_STOPS:
            with contextlib.suppress(TopicTakenError):
                publishers.append(bus.publisher(topic))
        if not publishers:
            raise TopicTakenError(
                f"other programs already publish {' and '.join(topic.name for topic in topics.PERSONS_STOPS)}"
            )

        def publish() -> None:
            for publisher in publishers:
                publisher.publish(request, time.monotonic_ns(), time.monotonic_ns())  # a driver heeds what is new

        publish()  # before anything else is looked for
        end_s = time.monotonic() + timeout_s
        answers: dict[str, SafetyState | None] = {}
        for namespace, topic in (inspection.gates(folder) or {"": topics.ARM_SAFETY}).items():
            left_s = max(end_s - time.monotonic(), POLL_PERIOD_S)
            state = _until(bus.subscriber(topic), left_s, _is_stopped, publish)
            answers[namespace] = state if state is not None and _is_stopped(state) else None
    return answers


def _is_stopped(state: SafetyState) -> bool:
    return any(fault.code == PERSON_STOP for fault in state.faults)


def _faults(state: SafetyState) -> list[str]:
    return [fault.detail for fault in state.faults]


def _until(
    gate: Subscriber,
    timeout_s: float,
    is_it: Callable[[SafetyState], bool],
    meanwhile: Callable[[], None] = lambda: None,
) -> SafetyState | None:
    """The first state for which `is_it`, otherwise the latest received; None if none was."""
    end_s = time.monotonic() + timeout_s
    latest: SafetyState | None = None
    while time.monotonic() < end_s:
        meanwhile()
        gate.revive()
        gate.socket.poll(int(1e3 * POLL_PERIOD_S), zmq.POLLIN)
        while (received := gate.receive()) is not None:
            state: SafetyState = received.message
            if is_it(state):
                return state
            latest = state
    return latest
