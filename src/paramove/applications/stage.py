"""What the stages of the rule-learning application share."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from dataclasses import dataclass, field

from paramove.applications.conversation import GoalClient, Goals, OutgoingMessages
from paramove.applications.options import Place, RuleLearnerOptions
from paramove.applications.table import Table
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import ApplicationStage, Speech

REMIND_S = 6.0
"""The robot reports what it waits for if the hand stays for so long."""

_log = logging.getLogger(__name__)


@dataclass
class ApplicationState:
    """State that all stages use.

    Attributes:
        begun_s: When the run began, by the same clock as all times.
        rules: Object -> position of its opening.
        lay: Objects that a person wants to lie: they lay when their rules were shown, or still do when asked about it.
        done: Objects that have been put away.
    """

    options: RuleLearnerOptions
    goal_client: GoalClient
    goals: Goals
    begun_s: float = 0.0
    table: Table = field(default_factory=Table)
    outgoing: OutgoingMessages = field(default_factory=OutgoingMessages)
    now_s: float = 0.0
    rules: dict[str, Place] = field(default_factory=dict)
    lay: set[str] = field(default_factory=set)
    done: set[str] = field(default_factory=set)
    detail: str = ""

    def speak(self, detail: str, request: Speech.Request = Speech.REQUEST_UNSPECIFIED, name: str = "") -> None:
        """Send a speech message to the instructor, with or without a request."""
        speech = Speech(request=request, object=name, text=detail)
        speech.captured.FromNanoseconds(round(self.now_s * 1e9))
        self.outgoing.speech.append(speech)
        self.detail = detail
        _log.info("%.1f s: %s", self.now_s - self.begun_s, detail)


class Stage(ABC):
    """A stage: `enter`, then `step` once a tick until it gives the next stage's name.

    Attributes:
        stage: As published in `ApplicationStage`.
        state: Name of the state it is in, for people.
    """

    stage: ApplicationStage.Stage = ApplicationStage.STAGE_UNSPECIFIED

    def __init__(self, app: ApplicationState) -> None:
        self.app = app
        self.state = ""
        self._since_s = 0.0

    @abstractmethod
    def enter(self) -> None:
        """Begin the stage."""

    @abstractmethod
    def step(self) -> ApplicationStage.Stage | None:
        """One tick; the next stage or None to stay."""

    @abstractmethod
    def on_gesture(self, gesture: Gesture) -> None:
        """Something happened on the table (the table itself knows already)."""

    def go(self, state: str) -> None:
        """Change the state."""
        self.state, self._since_s = state, self.app.now_s

    def hand_has_left(self, away_s: float) -> bool:
        """Whether no hand has been in view for so long. A person whose hand stays is asked again and again."""
        if self.for_s > REMIND_S and self.app.table.hand_in_view:
            self.app.speak("I wait, as I see a hand. Please take it, or what looks like it, out of my view.")
            self.go(self.state)
        return self.app.table.hand_away_for(self.app.now_s) > away_s

    @property
    def for_s(self) -> float:
        """How long this state has lasted, s."""
        return self.app.now_s - self._since_s


def cm(place: Place) -> str:
    """A position as text, in centimetres."""
    return f"({place[0] * 100:.1f}, {place[1] * 100:.1f}) cm".replace("-", "−")
