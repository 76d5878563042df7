"""A person's stop from outside of a run: published until the safety gate has answered."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

import zmq

from paramove.bus import BusVisitor, TopicTakenError, topics
from paramove.msgs.safety_state_pb2 import SafetyState, StopRequest
from paramove.safety import PERSON_STOP

PUBLISH_PERIOD_S = 0.02


def stop_arm(folder: Path, source: str, timeout_s: float) -> SafetyState | None:
    """Publishes a stop on all free topics of stops, until the gate has latched it or the timeout has passed.

    Args:
        folder: Of the run's bus.
        source: Where the person pressed, for the message of the fault that the gate latches.
        timeout_s: To wait for the gate's answer.

    Returns:
        The gate's answer, None if there was none.

    Raises:
        TopicTakenError: Other programs publish all topics of stops, such as the live page and another terminal.
        BusFolderError: The folder cannot be used.
    """
    end_s = time.monotonic() + timeout_s
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
        gate = bus.subscriber(topics.ARM_SAFETY)
        while time.monotonic() < end_s:
            for publisher in publishers:
                publisher.publish(request, time.monotonic_ns(), time.monotonic_ns())  # a driver heeds what is new
            gate.revive()
            gate.socket.poll(int(1e3 * PUBLISH_PERIOD_S), zmq.POLLIN)
            while (received := gate.receive()) is not None:
                answer: SafetyState = received.message
                if any(fault.code == PERSON_STOP for fault in answer.faults):
                    return answer
    return None
