"""Stage 3: the robot puts each object away that the instructor points at (thesis 5.2.6, step 4)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from paramove.applications.learning import GONE_FOR_GOOD_S
from paramove.applications.options import Place, cm
from paramove.applications.stage import AT_REST, ApplicationState, Stage
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Speech

NEAR = 0.035
"""Maximum distance of the object from the target, m; the objects stand at least 5 cm apart."""
CLEARER_BY = 0.015
"""The second nearest object must be so much farther away, m."""
HAND_AWAY_S = 0.3
INTO_OPENING = 0.02
"""Maximum distance from its opening, m, of an object that vanishes into it."""
OVER_OPENING = 0.012
"""Maximum distance from its opening, m, of an object that should have sunk into it."""
HELPED_IN_VAIN = 2
"""So many objects in a row that no attempt brought away: then the calibration is no longer right."""
SETTLED_S = 1.0
"""An object must have stood this long to be pointed at: before, the hand has just put it there."""


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
        self._moved: set[str] = set()
        self._to_move = ""
        self._in_vain = 0
        self._told_twins: set[str] = set()
        self._stood: set[str] = set()

    def enter(self) -> None:
        """Ask the instructor to point."""
        self._ask()

    def on_gesture(self, gesture: Gesture) -> None:
        """Store the target while waiting for one."""
        if gesture.kind in AT_REST:
            self._stood.add(gesture.object)
        if gesture.kind != Gesture.KIND_POINTED_AT or self.app.state != "waiting":
            return
        if self.app.options.pointing == "nearness":
            if gesture.object or not gesture.located:
                self._pointed_at(gesture.object)
        elif not gesture.object and gesture.captured.ToNanoseconds() * 1e-9 > self.app.now_s - self.app.for_s:
            self._pointed_at_position(gesture)

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
        return steps[self.app.state]()

    def _ask(self) -> None:
        self.app.speak("Please point at the object that I shall put away.", Speech.REQUEST_POINT_AT_OBJECT)
        self.app.go("waiting")

    def _waiting(self) -> ApplicationStage.Stage | None:
        for name in sorted(self._stood - self.app.done):
            if self._was_put_in(name):
                self._object = name
                return self._put_away()
        twins = set(self.app.table.standing()) & self.app.table.twins
        if twins - self._told_twins:
            self._ask_to_leave_one(min(twins - self._told_twins))
        self._told_twins &= twins
        if self.app.for_s > self.app.options.ask_again_s:
            self._ask()
        return None

    def _was_put_in(self, name: str) -> bool:
        """Whether somebody has put it into its opening."""
        sighting, place = self.app.table.objects[name], self.app.rules.get(name)
        if sighting.kind != Gesture.KIND_VANISHED or sighting.position is None or place is None:
            return False
        gone = self.app.now_s - sighting.time_s > GONE_FOR_GOOD_S and not self.app.table.hand_in_view
        return gone and math.dist(sighting.position, place) < INTO_OPENING

    def _pointed_at(self, name: str) -> None:
        place = self.app.table.standing().get(name)
        if name not in self.app.rules or place is None:
            self.app.speak(f"You point at {name or 'something'}, but I do not know where it stands or belongs.")
            return
        self._object, self._source, self._attempt = name, place, 0
        if name in self.app.table.twins:
            self._ask_to_leave_one(name)
            return
        self.app.speak(f"You point at {name} at {cm(place)}: it belongs to the opening at {cm(self.app.rules[name])}.")
        self.app.go("letting_hand_leave")

    def _ask_to_leave_one(self, name: str) -> None:
        self._object = name
        self._told_twins.add(name)
        self._ask_for_help(f"I see more than one {name} object.", please="Please leave one of them, and point again")
        self.app.go("waiting")  # the one that is left may not move

    def _pointed_at_position(self, gesture: Gesture) -> None:
        """Take the object at rest there. Targets off the table, or while objects are being arranged, are ignored."""
        app = self.app
        if not gesture.located or gesture.frame != app.options.frame:
            app.speak(
                f"You point at a place in the frame {gesture.frame!r}; I only know places in {app.options.frame!r}."
            )
            return
        settled = app.table.standing(settled_s=gesture.captured.ToNanoseconds() * 1e-9 - SETTLED_S)
        result = object_at((gesture.x, gesture.y), settled)
        if result.name:
            self._pointed_at(result.name)
        elif app.options.on_surface((gesture.x, gesture.y)) and set(app.rules) - app.done <= set(settled):
            app.speak(f"{result.doubt} Please point again.", Speech.REQUEST_POINT_AT_OBJECT)
            self.app.go("waiting")

    def _letting_hand_leave(self) -> None:
        if self.hand_has_left(HAND_AWAY_S):
            self._relocate()

    def _relocate(self) -> None:
        app, shape = self.app, self.app.table.objects[self._object].shape
        if shape is not None and shape.length and self._object not in app.lay:
            app.lay.add(self._object)  # asked once: where it still lies, it is to be taken as it lies
            self._ask_for_help(f"{self._object} has fallen over.", please="Please stand it up")
            return
        self._attempt += 1
        self._began_s, self._failure = app.now_s, ""
        standing = app.table.standing(but=self._object)
        self._avoided = tuple(standing)
        app.goal_client.start(
            RelocationGoal.KIND_RELOCATE,
            app.now_s,
            self._object,
            source=app.goal_client.position(self._source),
            target=app.goal_client.position(app.rules[self._object]),
            avoid=standing.values(),
            attempt=self._attempt,
            shape=shape,
        )
        self.app.go("relocating")

    def _relocating(self) -> None:
        outcome = self.app.goal_client.outcome
        if outcome is None:
            return
        if outcome.state == RelocationStatus.STATE_REJECTED:
            self._rejected(outcome)
        elif outcome.state == RelocationStatus.STATE_FAILED:
            self._failure = outcome.reason or "it failed"
            self.app.goal_client.start(RelocationGoal.KIND_REST, self.app.now_s)
            self.app.go("returning")
        else:
            self.app.go("looking")

    def _rejected(self, outcome: RelocationStatus) -> None:
        """No path around a standing object: that one first. Ask for help only if each blocks the other.

        A person who moves the same object each time may never resolve that: the next time, one in its way is moved.
        """
        if outcome.misfit:
            detail = f"I cannot take {self._object}: {outcome.reason}."
            self._ask_for_help(detail, please="Please stand another one there")
            return
        self._stuck.add(self._object)
        in_the_way = [self._avoided[number] for number in outcome.in_the_way if number < len(self._avoided)]
        other = next((name for name in in_the_way if name not in self._stuck | self.app.done), "")
        if other:
            detail = f"{other} stands in the way of {self._object}. Please point at {other} first."
            self.app.speak(detail, Speech.REQUEST_POINT_AT_OBJECT, other)
            self.app.go("waiting")
        else:
            to_move = next((name for name in (self._object, *in_the_way) if name not in self._moved), "")
            if not to_move:  # all were moved once
                self._moved.clear()
            detail = f"I cannot reach {self._object} at {cm(self._source)}: {outcome.reason}."
            self._ask_for_help(detail, to_move or self._object)

    def _returning(self) -> None:
        """The arm may have been left anywhere: bring it to its base pose before looking."""
        if self.app.goal_client.outcome is not None:
            self.app.go("looking")

    def _looking(self) -> ApplicationStage.Stage | None:
        """The arm has left: is the object gone, or does it stand or lie somewhere?"""
        if self.app.for_s < self.app.options.settle_s:
            return None
        sighting = self.app.table.objects.get(self._object)
        if not self._failure and sighting is not None and sighting.kind == Gesture.KIND_VANISHED:
            return self._put_away()
        if sighting is not None and sighting.at_rest and sighting.position is not None:
            outdated = not self._failure and sighting.time_s < self._began_s
            if outdated and self.app.for_s < 2 * self.app.options.settle_s:
                return None  # not detected since: the view is not settled yet
            return self._try_again(sighting.position)
        if self.app.for_s > 3 * self.app.options.settle_s:
            return self._tried_in_vain(f"I have lost sight of {self._object}.")
        return None

    def _try_again(self, place: Place) -> ApplicationStage.Stage | None:
        app, reason = self.app, self._failure
        if self._attempt > 1 and not reason and math.dist(place, app.rules[self._object]) < OVER_OPENING:
            detail = f"{self._object} stands at {cm(place)}, where it belongs, and does not go in."
            self._ask_for_help(detail, please="Please uncover the opening and put it to another place")
            return None
        if self._attempt < app.options.attempts:
            self._source = place
            app.speak(f"{self._object} is at {cm(place)}{': ' + reason if reason else ''}. I try again.")
            self._relocate()
            return None
        detail = f"I tried {self._attempt} times to put {self._object} away: {reason or 'it stayed'}."
        return self._tried_in_vain(detail)

    def _tried_in_vain(self, detail: str) -> ApplicationStage.Stage | None:
        self._in_vain += 1
        if self._in_vain < HELPED_IN_VAIN:
            self._ask_for_help(detail)
            return None
        self.app.speak(
            f"{detail} Was the camera moved, or my base? I calibrate again, and then need to see the rules again."
        )
        self.app.rules.clear()
        self.app.done.clear()
        return ApplicationStage.STAGE_CALIBRATE

    def _ask_for_help(self, detail: str, to_move: str = "", please: str = "") -> None:
        self._to_move = to_move or self._object
        self._moved.add(self._to_move)
        what = "it" if self._to_move == self._object else self._to_move
        please = please or f"Please put {what} to another place"
        self.app.speak(f"{detail} {please}.", Speech.REQUEST_HELP, self._to_move)
        self.app.go("helped")

    def _helped(self) -> None:
        sighting = self.app.table.objects.get(self._to_move)
        came = sighting is not None and sighting.at_rest and sighting.time_s > self.app.now_s - self.app.for_s
        if came and self.app.table.hand_away_for(self.app.now_s) > HAND_AWAY_S:
            self._stuck.clear()
            self._ask()
        elif self.app.for_s > self.app.options.ask_again_s:
            self._ask_for_help(f"I still need help with {self._to_move}.", self._to_move)

    def _put_away(self) -> ApplicationStage.Stage | None:
        self.app.done.add(self._object)
        self._in_vain = 0
        self._stuck.clear()
        self._moved.clear()
        self.app.speak(f"{self._object} is put away.")
        if set(self.app.options.objects) <= self.app.done:
            self.app.speak("All objects are put away. Thank you!", Speech.REQUEST_THANK_YOU)
            return ApplicationStage.STAGE_DONE
        self._ask()
        return None


@dataclass(frozen=True)
class PointedObject:
    """Either the object's name or a message why it is not clear; the other is empty."""

    name: str = ""
    doubt: str = ""


def object_at(place: Place, standing: Mapping[str, Place]) -> PointedObject:
    """The object that a target, m, refers to, of those that stand on the same plane."""
    ordered = sorted(standing, key=lambda name: (math.dist(standing[name], place), name))
    distances = [math.dist(standing[name], place) for name in ordered]
    if not ordered or not distances[0] <= NEAR:  # NaN is not near either
        return PointedObject(doubt=f"You point at {cm(place)}, but I see nothing that stands near there.")
    if len(ordered) > 1 and distances[1] - distances[0] < CLEARER_BY:
        return PointedObject(doubt=f"You point at {cm(place)}: that can be {ordered[0]} or {ordered[1]}.")
    return PointedObject(name=ordered[0])
