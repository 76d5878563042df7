"""What the stages of the rule-learning application share: what is seen on the table, the rules, the state."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

from paramove.applications.application import Application
from paramove.applications.options import Place, RuleLearnerOptions
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import ApplicationStage
from paramove.objects import ObjectShape

REMIND_S = 6.0
"""The robot reports what it waits for if the hand stays for so long."""
AT_REST = frozenset({Gesture.KIND_APPEARED, Gesture.KIND_RESTED})


@dataclass(frozen=True)
class Sighting:
    """The latest event of an object.

    Attributes:
        kind: Of `Gesture.Kind`: appeared, moved, rested or vanished.
        time_s: Capture time.
        u_px, v_px: Image point.
        position: x, y in the plane's frame, m; None while there is no calibration.
        shape: Of the object; None: not known.
    """

    kind: int
    time_s: float
    u_px: float
    v_px: float
    position: Place | None
    shape: ObjectShape | None = None

    @property
    def at_rest(self) -> bool:
        """Whether the object is detected at rest."""
        return self.kind in AT_REST


class Table:
    """Stores the latest sighting of every object, of which colours there are two, and whether the hand is in view."""

    def __init__(self) -> None:
        self.objects: dict[str, Sighting] = {}
        self.twins: set[str] = set()
        self.hand_in_view = False
        self.hand_changed_s = 0.0

    def on_gesture(self, gesture: Gesture) -> None:
        """Store an event."""
        (self.twins.add if gesture.twin else self.twins.discard)(gesture.object)
        time_s = gesture.captured.ToNanoseconds() * 1e-9
        if gesture.kind in (Gesture.KIND_HAND_APPEARED, Gesture.KIND_HAND_VANISHED):
            self.hand_in_view = gesture.kind == Gesture.KIND_HAND_APPEARED
            self.hand_changed_s = time_s
            return
        shape = ObjectShape.of(gesture)
        if gesture.kind == Gesture.KIND_POINTED_AT and gesture.object in self.objects:
            self.objects[gesture.object] = replace(self.objects[gesture.object], shape=shape)
        elif gesture.object and gesture.kind != Gesture.KIND_POINTED_AT:
            position = (gesture.x, gesture.y) if gesture.located else None
            self.objects[gesture.object] = Sighting(gesture.kind, time_s, gesture.u_px, gesture.v_px, position, shape)

    def hand_away_for(self, now_s: float) -> float:
        """How long the hand has been out of view, s; 0 while it is in view."""
        return 0.0 if self.hand_in_view else now_s - self.hand_changed_s

    def standing(self, but: str = "", settled_s: float = float("inf")) -> dict[str, Place]:
        """Positions, m, of the objects at rest, without `but` and those that came to rest after `settled_s`."""
        return {
            name: sighting.position
            for name, sighting in self.objects.items()
            if sighting.at_rest and sighting.position is not None and name != but and sighting.time_s <= settled_s
        }


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
