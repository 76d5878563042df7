"""What becomes of a person's stop: asked, heard by the gate, at rest. Without clock and sockets."""

from __future__ import annotations

import enum
from collections.abc import Callable
from typing import Any

from paramove.bus import Received, topics
from paramove.msgs.safety_state_pb2 import SafetyState, StopRequest
from paramove.safety import PERSON_STOP

SOURCE = "page"
SHOWN_S = 3.0
"""The page shows the stopped arm so long before the run ends."""


class Progress(enum.Enum):
    """How far a stop has come."""

    NOT_ASKED = "not asked"
    ASKED = "asked"
    STOPPING = "stopping"
    STOPPED = "stopped"


class StopButton:
    """`look` at every tick and whenever somebody pressed, `hear` every message.

    The request is said again at every look until the gate has confirmed it: what is said once could be lost.

    Args:
        was_pressed: Whether somebody pressed since the last call.
        say: Says the request.
    """

    def __init__(self, was_pressed: Callable[[], bool], say: Callable[[StopRequest], None]) -> None:
        self.progress = Progress.NOT_ASKED
        self.sentence = ""
        self._was_pressed = was_pressed
        self._say = say
        self._asked_ns = 0
        self._stopped_ns: int | None = None

    def look(self, now_ns: int) -> None:
        """Says what is to be said now."""
        if self._was_pressed() and self.progress is Progress.NOT_ASKED:
            self.progress, self._asked_ns = Progress.ASKED, now_ns
        if self.progress is Progress.ASKED:
            request = StopRequest(source=SOURCE)
            request.captured.FromNanoseconds(self._asked_ns)
            self._say(request)

    def handle(self, heard: Received) -> None:
        """Of all messages the gate's: whether it has heard the stop, and whether the arm rests.

        That it was this page that asked does not matter: it may have been restarted in between.
        """
        if heard.topic.name != topics.ARM_SAFETY.name:
            return
        safety: SafetyState = heard.message
        sentences = [fault.sentence for fault in safety.faults if fault.code == PERSON_STOP]
        if not sentences:
            return
        self.sentence = sentences[0]
        if safety.state in (SafetyState.STATE_HOLD, SafetyState.STATE_ESTOP):
            self.progress = Progress.STOPPED
            self._stopped_ns = heard.published_ns if self._stopped_ns is None else self._stopped_ns
        else:
            self.progress = Progress.STOPPING

    def is_over(self, now_ns: int) -> bool:
        """Whether the arm has been at rest for long enough to be seen at rest."""
        return self._stopped_ns is not None and now_ns - self._stopped_ns >= SHOWN_S * 1e9

    def section(self) -> dict[str, Any]:
        """For the page."""
        return {"progress": self.progress.value, "sentence": self.sentence}
