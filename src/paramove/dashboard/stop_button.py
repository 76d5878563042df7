"""Progress of a person's stop: requested, received by the gate, at rest. Without clock and sockets."""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import Any

from paramove.bus import Received
from paramove.msgs.safety_state_pb2 import SafetyState, StopRequest
from paramove.safety import PERSON_STOP

SOURCE = "page"
DISPLAY_S = 3.0
"""The page shows the stopped arm so long before the run ends."""


class Progress(enum.Enum):
    """How far a stop has come."""

    NOT_REQUESTED = "not asked"
    REQUESTED = "asked"
    STOPPING = "stopping"
    STOPPED = "stopped"


class StopButton:
    """Call `look` at every tick and whenever the button was pressed, and `handle` with every message.

    The request is published at every `look` until the gate has confirmed it, because one message could be lost.

    Args:
        was_pressed: Whether the button was pressed since the last call.
        publish: Publishes the request.
    """

    def __init__(self, was_pressed: Callable[[], bool], publish: Callable[[StopRequest], None]) -> None:
        self.progress = Progress.NOT_REQUESTED
        self.detail = ""
        self._was_pressed = was_pressed
        self._publish = publish
        self._requested_ns = 0
        self._gates: dict[str, SafetyState] = {}
        self._stopped_ns: int | None = None

    def look(self, now_ns: int) -> None:
        """Publishes the request if the button was pressed and the gate has not confirmed it."""
        if self._was_pressed() and self.progress is Progress.NOT_REQUESTED:
            self.progress, self._requested_ns = Progress.REQUESTED, now_ns
        if self.progress is Progress.REQUESTED:
            request = StopRequest(source=SOURCE)
            request.captured.FromNanoseconds(self._requested_ns)
            self._publish(request)

    def handle(self, received: Received) -> None:
        """Handles the gates' states: whether each has received the stop, and whether its arm rests.

        A stop from another page counts, too: this one may have been restarted in between.
        """
        if received.topic.type is not SafetyState:
            return
        self._gates[received.topic.name] = received.message
        stops = [[fault.detail for fault in gate.faults if fault.code == PERSON_STOP] for gate in self._gates.values()]
        if not all(stops):
            return
        self.detail = stops[0][0]
        if all(gate.state in (SafetyState.STATE_HOLD, SafetyState.STATE_ESTOP) for gate in self._gates.values()):
            self.progress = Progress.STOPPED
            self._stopped_ns = received.published_ns if self._stopped_ns is None else self._stopped_ns
        else:
            self.progress = Progress.STOPPING

    def is_over(self, now_ns: int) -> bool:
        """Whether the page has shown the arm at rest for long enough."""
        return self._stopped_ns is not None and now_ns - self._stopped_ns >= DISPLAY_S * 1e9

    def section(self) -> dict[str, Any]:
        """For the page."""
        return {"progress": self.progress.value, "sentence": self.detail}
