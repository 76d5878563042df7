"""What the stages of the rule-learning application share."""

from __future__ import annotations

from abc import ABC, abstractmethod

from paramove.applications.application import Application
from paramove.applications.options import Place, RuleLearnerOptions
from paramove.applications.table import Table
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import ApplicationStage

REMIND_S = 6.0
"""The robot reports what it waits for if the hand stays for so long."""


class ApplicationState(Application):
    """State that all stages use.

    Attributes:
        rules: Object -> position of its opening.
        lay: Objects that a person wants to lie: they lay when their rules were shown, or still do when asked about it.
        done: Objects that have been put away.
    """

    def __init__(self, options: RuleLearnerOptions, run_name: str, begun_s: float) -> None:
        super().__init__(options, run_name, begun_s)
        self.options = options
        self.table = Table()
        self.rules: dict[str, Place] = {}
        self.lay: set[str] = set()
        self.done: set[str] = set()


class Stage(ABC):
    """A stage: `enter`, then `step` once a tick until it gives the next stage's name.

    Attributes:
        stage: As published in `ApplicationStage`.
    """

    stage: ApplicationStage.Stage = ApplicationStage.STAGE_UNSPECIFIED

    def __init__(self, app: ApplicationState) -> None:
        self.app = app

    @abstractmethod
    def enter(self) -> None:
        """Begin the stage."""

    @abstractmethod
    def step(self) -> ApplicationStage.Stage | None:
        """One tick; the next stage or None to stay."""

    @abstractmethod
    def on_gesture(self, gesture: Gesture) -> None:
        """Something happened on the table (the table itself knows already)."""

    def hand_has_left(self, away_s: float) -> bool:
        """Whether no hand has been in view for so long. A person whose hand stays is asked again and again."""
        app = self.app
        if app.for_s > REMIND_S and app.table.hand_in_view:
            app.speak("I wait, as I see a hand. Please take it, or what looks like it, out of my view.")
            app.go(app.state)
        return app.table.hand_away_for(app.now_s) > away_s


def cm(place: Place) -> str:
    """A position as text, in centimetres."""
    return f"({place[0] * 100:.1f}, {place[1] * 100:.1f}) cm".replace("-", "−")
