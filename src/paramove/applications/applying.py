"""Stage 3: the robot puts each object away that the instructor points at (thesis 5.2.6, step 4)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from paramove.applications.stage import ApplicationState, Place, Stage, cm
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Speech

NEAR = 0.035
"""An object farther from the place is not meant, m; the objects stand at least 5 cm apart."""
CLEARER_BY = 0.015
"""The second nearest object must be so much farther away, m."""
HAND_AWAY_S = 0.3
HAND_PATIENCE_S = 6.0
SETTLED_S = 1.0
"""A person points at what has stood for so long: before, the hand has just put it there."""


class Applying(Stage):
    """States: waiting (for a pointing hand), letting_hand_leave, relocating, returning, looking, helped."""

    stage = ApplicationStage.STAGE_APPLY

    def __init__(self, app: ApplicationState) -> None:
        super().__init__(app)
        self._object = ""
        self._source: Place = (0.0, 0.0)
        self._attempt = 0
        self._began_s = 0.0
        self._failure = ""
        self._avoided: tuple[str, ...] = ()
        self._stuck: set[str] = set()

    def enter(self) -> None:
        """Ask the instructor to point."""
        self._ask()

    def on_gesture(self, gesture: Gesture) -> None:
        """Remember who is pointed at while waiting for that."""
        if gesture.kind != Gesture.KIND_POINTED_AT or self.state != "waiting":
            return
        if self.app.options.pointing == "nearness":
            if gesture.object or not gesture.located:
                self._pointed_at(gesture.object)
        elif not gesture.object and gesture.captured.ToNanoseconds() * 1e-9 > self.app.now_s - self.for_s:
            self._pointed_at_place(gesture)

    def step(self) -> ApplicationStage.Stage | None:
        """One tick."""
        steps = {
            "waiting": self._waiting,
            "letting_hand_leave": self._letting_hand_leave,
            "relocating": self._relocating,
            "returning": self._returning,
            "looking": self._looking,
            "helped": self._helped,
        }
        return steps[self.state]()

    def _ask(self) -> None:
        self.app.tell("Please point at the object that I shall put away.", Speech.REQUEST_POINT_AT_OBJECT)
        self.go("waiting")

    def _waiting(self) -> None:
        if self.for_s > self.app.options.ask_again_s:
            self._ask()

    def _pointed_at(self, name: str) -> None:
        place = self.app.table.standing().get(name)
        if name not in self.app.rules or place is None:
            self.app.tell(f"You point at {name or 'something'}, but I do not know where it stands or belongs.")
            return
        self._object, self._source, self._attempt = name, place, 0
        self.app.tell(f"You point at {name} at {cm(place)}: it belongs to the opening at {cm(self.app.rules[name])}.")
        self.go("letting_hand_leave")

    def _pointed_at_place(self, gesture: Gesture) -> None:
        """The object at rest there. Beside the table, and while it is being arranged, nobody points at anything."""
        app = self.app
        if not gesture.located or gesture.frame != app.options.frame:
            app.tell(
                f"You point at a place in the frame {gesture.frame!r}; I only know places in {app.options.frame!r}."
            )
            return
        settled = app.table.standing(settled_s=gesture.captured.ToNanoseconds() * 1e-9 - SETTLED_S)
        found = object_at((gesture.x, gesture.y), settled)
        if found.name:
            self._pointed_at(found.name)
        elif app.options.surface.contains((gesture.x, gesture.y)) and set(app.rules) - app.done <= set(settled):
            app.tell(f"{found.doubt} Please point again.", Speech.REQUEST_POINT_AT_OBJECT)
            self.go("waiting")

    def _letting_hand_leave(self) -> None:
        away = self.app.table.hand_away_for(self.app.now_s) > HAND_AWAY_S
        if away or self.for_s > HAND_PATIENCE_S:
            self._relocate()

    def _relocate(self) -> None:
        self._attempt += 1
        self._began_s, self._failure = self.app.now_s, ""
        app = self.app
        standing = app.table.standing(but=self._object)
        self._avoided = tuple(standing)
        app.goal_client.start(
            RelocationGoal.KIND_RELOCATE,
            app.now_s,
            self._object,
            source=app.goals.position(self._source),
            target=app.goals.position(app.rules[self._object]),
            avoid=standing.values(),
            attempt=self._attempt,
        )
        self.go("relocating")

    def _relocating(self) -> None:
        outcome = self.app.goal_client.outcome
        if outcome is None:
            return
        if outcome.state == RelocationStatus.STATE_REFUSED:
            self._refused(outcome)
        elif outcome.state == RelocationStatus.STATE_FAILED:
            self._failure = outcome.reason or "it failed"
            self.app.goal_client.start(RelocationGoal.KIND_REST, self.app.now_s)
            self.go("returning")
        else:
            self.go("looking")

    def _refused(self, outcome: RelocationStatus) -> None:
        """No way round a standing object: that one first. Only where each stands in the other's way is help needed."""
        self._stuck.add(self._object)
        in_the_way = (self._avoided[number] for number in outcome.in_the_way if number < len(self._avoided))
        other = next((name for name in in_the_way if name not in self._stuck | self.app.done), "")
        if other:
            sentence = f"{other} stands in the way of {self._object}. Please point at {other} first."
            self.app.tell(sentence, Speech.REQUEST_POINT_AT_OBJECT, other)
            self.go("waiting")
        else:
            self._ask_for_help(f"I cannot reach {self._object} at {cm(self._source)}: {outcome.reason}.")

    def _returning(self) -> None:
        """The arm may have been left anywhere: bring it to its base pose before looking."""
        if self.app.goal_client.outcome is not None:
            self.go("looking")

    def _looking(self) -> ApplicationStage.Stage | None:
        """The arm has left: is the object gone, or does it stand or lie somewhere?"""
        if self.for_s < self.app.options.settle_s:
            return None
        seen = self.app.table.objects.get(self._object)
        if not self._failure and seen is not None and seen.kind == Gesture.KIND_VANISHED:
            return self._put_away()
        if seen is not None and seen.at_rest and seen.place is not None:
            unseen = not self._failure and seen.time_s < self._began_s
            if unseen and self.for_s < 2 * self.app.options.settle_s:
                return None  # not seen since: the view is not settled yet
            self._try_again(seen.place)
            return None
        if self.for_s > 3 * self.app.options.settle_s:
            self._ask_for_help(f"I have lost sight of {self._object}.")
        return None

    def _try_again(self, place: Place) -> None:
        reason = self._failure
        if self._attempt >= self.app.options.attempts:
            self._ask_for_help(f"I tried {self._attempt} times to put {self._object} away: {reason or 'it stayed'}.")
            return
        self._source = place
        self.app.tell(f"{self._object} is at {cm(place)}{': ' + reason if reason else ''}. I try again.")
        self._relocate()

    def _ask_for_help(self, sentence: str) -> None:
        self.app.tell(f"{sentence} Please put it to another place.", Speech.REQUEST_HELP, self._object)
        self.go("helped")

    def _helped(self) -> None:
        seen = self.app.table.objects.get(self._object)
        came = seen is not None and seen.at_rest and seen.time_s > self.app.now_s - self.for_s
        if came and self.app.table.hand_away_for(self.app.now_s) > HAND_AWAY_S:
            self._stuck.clear()
            self._ask()
        elif self.for_s > self.app.options.ask_again_s:
            self._ask_for_help(f"I still need help with {self._object}.")

    def _put_away(self) -> ApplicationStage.Stage | None:
        self.app.done.add(self._object)
        self._stuck.clear()
        self.app.tell(f"{self._object} is put away.")
        if set(self.app.options.objects) <= self.app.done:
            self.app.tell("All objects are put away. Thank you!", Speech.REQUEST_THANK_YOU)
            return ApplicationStage.STAGE_DONE
        self._ask()
        return None


@dataclass(frozen=True)
class PointedObject:
    """Either the name of the object or the doubt why it cannot be told, a sentence; the other is empty."""

    name: str = ""
    doubt: str = ""


def object_at(place: Place, standing: Mapping[str, Place]) -> PointedObject:
    """The object that is meant with a place, m, of those that stand at places on the same plane."""
    ordered = sorted(standing, key=lambda name: (math.dist(standing[name], place), name))
    distances = [math.dist(standing[name], place) for name in ordered]
    if not ordered or not distances[0] <= NEAR:  # NaN is not near either
        return PointedObject(doubt=f"You point at {cm(place)}, but I see nothing that stands near there.")
    if len(ordered) > 1 and distances[1] - distances[0] < CLEARER_BY:
        return PointedObject(doubt=f"You point at {cm(place)}: that can be {ordered[0]} or {ordered[1]}.")
    return PointedObject(name=ordered[0])
