"""A table, an arm and an instructor made of messages, tick by tick, around a rule learner."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Sequence

from paramove.applications.options import RuleLearnerOptions
from paramove.applications.rule_learner import RuleLearner
from paramove.bus import topics
from paramove.bus.subscriber import Received
from paramove.bus.ticks import Tick
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Rules, Speech
from tests.applications.launched import rule_learner

TICK_NS = 66_666_667
MOTION_S = 4.0
WIDTH = 0.021
CORNERS = ((0.135, -0.10), (0.135, 0.076), (0.19, 0.076), (0.19, -0.10))
OPENINGS = {"yellow": (0.135, -0.038), "green": (0.135, -0.095), "blue": (0.135, 0.019)}
PLACES = {"yellow": (0.170, 0.05), "green": (0.180, -0.08), "blue": (0.175, -0.02)}
OPTIONS = rule_learner()
SUCCEEDED, FAILED, REJECTED = (
    RelocationStatus.STATE_SUCCEEDED,
    RelocationStatus.STATE_FAILED,
    RelocationStatus.STATE_REJECTED,
)
Place = tuple[float, float]


class Story:
    """What happens follows from `arm` and `instructor`, which a test may replace.

    Attributes:
        events: Everything that the learner received, and the ticks.
        goals: Every goal as often as it was sent.
        outcomes: Outcomes of the next relocations in stage 3: (state, reason, where the object is then; None: in its
            opening). When they are used up, all go well.
        in_the_way: Of the next refusals: places in the goal's `avoid`.
        misfit: Whether what is refused is of an unfit size.
        twins: Colours of which there are two objects.
        lie: Colours of the objects that lie.
        deaf: How many goals the arm does not hear.
        answers: Request -> what the instructor does then.
    """

    def __init__(self, run_name: str = "run", options: RuleLearnerOptions = OPTIONS) -> None:
        self.learner = RuleLearner(options, run_name)
        self.events: list[Received | Tick] = []
        self.now_ns = 0
        self._number = 0
        self.goals: list[RelocationGoal] = []
        self.speech: list[Speech] = []
        self.rules: list[Rules] = []
        self.stages: list[ApplicationStage] = []
        self.calibrations: list = []
        self.outcomes: list[tuple[int, str, Place | None]] = []
        self.in_the_way: list[list[int]] = []
        self.misfit = False
        self.twins: set[str] = set()
        self.lie: set[str] = set()
        self.deaf = 0
        self.places: dict[str, Place] = {}
        self.calibrated = False
        self.answers: dict[int, Callable[[str], None]] = {
            Speech.REQUEST_HAND_ME_AN_OBJECT: lambda _: self.hand_over("yellow"),
            Speech.REQUEST_STAND_OBJECT_AT_START: lambda _: self.put(1.0, "green", options.start or (0.0, 0.0)),
            Speech.REQUEST_LET_GO: lambda _: self.later(1.0, self.hand, False),
            Speech.REQUEST_SHOW_RULES: lambda _: self.show(*OPENINGS),
            Speech.REQUEST_SHOW_RULE_AGAIN: lambda name: self.show(name),
            Speech.REQUEST_POINT_AT_OBJECT: lambda name: self.point(name or None),
            Speech.REQUEST_HELP: lambda name: self.put(1.0, name, PLACES[name]),
        }
        self._known: set[str] = set()
        self._events: list[tuple[float, int, Callable[..., None], tuple]] = []
        self._count = itertools.count()

    # Time

    @property
    def now_s(self) -> float:
        return self.now_ns * 1e-9

    def later(self, after_s: float, do: Callable[..., None], *arguments) -> None:
        heapq.heappush(self._events, (self.now_s + after_s, next(self._count), do, arguments))

    def tick(self) -> None:
        self.now_ns += TICK_NS
        while self._events and self._events[0][0] <= self.now_s:
            _, _, do, arguments = heapq.heappop(self._events)
            do(*arguments)
        self._number += 1
        self.events.append(Tick(self._number, self.now_ns))
        outgoing = self.learner.tick(self.now_ns * 1e-9)
        self.calibrations += outgoing.calibrations
        self.calibrated |= bool(outgoing.calibrations)
        self.rules += outgoing.rules
        self.stages += outgoing.stages
        for goal in outgoing.goals:
            self.goals.append(goal)
            self._hear(goal)
        for speech in outgoing.speech:
            self.speech.append(speech)
            self.answers.get(speech.request, lambda _: None)(speech.object)

    def run(self, seconds: float = 600.0, until: Callable[[], bool] | None = None) -> bool:
        end_s = self.now_s + seconds
        while self.now_s < end_s and not self.learner.finished:
            self.tick()
            if until is not None and until():
                return True
        return self.learner.finished

    def run_to(self, stage: ApplicationStage.Stage) -> None:
        assert self.run(until=lambda: self.stages[-1].stage == stage), f"stopped at: {self.learner.detail}"

    # What is seen

    def gesture(self, kind: Gesture.Kind, name: str = "", place: Place = (0.0, 0.0)) -> None:
        u, v = 240 - 1000 * place[1], 400 - 1000 * place[0]
        seen = Gesture(kind=kind, object=name, u_px=u, v_px=v, located=self.calibrated)
        if self.calibrated:
            seen.x, seen.y, seen.frame = place[0], place[1], "right_shoulder"
            seen.width_m = WIDTH if name else 0.0
            seen.length_m = 2 * WIDTH if name in self.lie else 0.0
        seen.twin = name in self.twins
        seen.captured.FromNanoseconds(self.now_ns)
        self._heard(topics.GESTURES, seen)
        self.learner.on_gesture(seen)

    def hand(self, there: bool) -> None:
        self.gesture(Gesture.KIND_HAND_APPEARED if there else Gesture.KIND_HAND_VANISHED)

    def stand(self, name: str, place: Place) -> None:
        self.places[name] = place
        self.gesture(Gesture.KIND_APPEARED, name, place)

    def vanish(self, name: str, place: Place) -> None:
        self.places.pop(name, None)
        self.gesture(Gesture.KIND_VANISHED, name, place)

    # What the instructor does

    def hand_over(self, name: str) -> None:
        self.later(0.5, self.hand, True)
        self.later(1.5, self.gesture, Gesture.KIND_APPEARED, name, (0.155, -0.02))

    def show(self, *names: str) -> None:
        for number, name in enumerate(names):
            start = 1.0 + 6.0 * number
            self.later(start, self.hand, True)
            self.later(start + 0.5, self.gesture, Gesture.KIND_MOVED, name, PLACES[name])
            self.later(start + 2.0, self.vanish, name, OPENINGS[name])
            self.later(start + 2.5, self.hand, False)

    def put(self, after_s: float, name: str, place: Place) -> None:
        self.later(after_s, self.hand, True)
        self.later(after_s + 0.5, self.gesture, Gesture.KIND_MOVED, name, place)
        self.later(after_s + 1.0, self.stand, name, place)
        self.later(after_s + 2.0, self.hand, False)

    def point(self, name: str | None = None) -> None:
        """At the object, by default at the first that stands; the table is laid at the first time."""
        if not self._known:
            self._known = set(PLACES)
            for each, place in PLACES.items():
                self.later(0.5, self.stand, each, place)
        self.later(3.0, self.hand, True)
        self.later(4.0, self._point_at, name)
        self.later(5.0, self.hand, False)

    def _point_at(self, name: str | None) -> None:
        standing = [each for each in PLACES if each in self.places]
        if name or standing:
            chosen = name or standing[0]
            self.gesture(Gesture.KIND_POINTED_AT, chosen, self.places.get(chosen, (0.2, 0.0)))

    # What the arm does

    def _hear(self, goal: RelocationGoal) -> None:
        if self.deaf:
            self.deaf -= 1
            return
        if goal.asked_again:
            self._say(goal.id, FAILED, "the synthesizer was restarted")
            return
        self._say(goal.id, RelocationStatus.STATE_ACCEPTED)
        state, reason, place = SUCCEEDED, "", None
        applying = self.stages[-1].stage == ApplicationStage.STAGE_APPLY
        if applying and goal.kind == RelocationGoal.KIND_RELOCATE and self.outcomes:
            state, reason, place = self.outcomes.pop(0)
        if state == REJECTED:
            self._say(goal.id, state, reason, self.in_the_way.pop(0) if self.in_the_way else [])
            return
        target = (goal.to.x, goal.to.y)
        if goal.kind == RelocationGoal.KIND_PLACE_HELD or (goal.kind == RelocationGoal.KIND_RELOCATE and not applying):
            self.later(0.5 * MOTION_S, self.gesture, Gesture.KIND_MOVED, goal.object, target)
            self.later(MOTION_S + 0.5, self.stand, goal.object, target)
        elif goal.kind == RelocationGoal.KIND_RELOCATE and place is not None:
            self.later(0.5 * MOTION_S, self.gesture, Gesture.KIND_MOVED, goal.object, place)
            self.later(0.8 * MOTION_S, self.stand, goal.object, place)
        elif goal.kind == RelocationGoal.KIND_RELOCATE and state == SUCCEEDED:
            self.later(0.5 * MOTION_S, self.gesture, Gesture.KIND_MOVED, goal.object, target)
            self.later(0.8 * MOTION_S, self.vanish, goal.object, target)
        self.later(MOTION_S, self._say, goal.id, state, reason)

    def forget_goals(self) -> None:
        """The arm ends its motion and reports it no more, as after the synthesizer's restart."""
        moves = (self._say, self.vanish, self.stand)
        self._events = [event for event in self._events if event[2] not in moves]
        heapq.heapify(self._events)

    def _say(self, name: str, state: RelocationStatus.State, reason: str = "", in_the_way: Sequence[int] = ()) -> None:
        misfit = state == REJECTED and self.misfit
        status = RelocationStatus(goal_id=name, state=state, reason=reason, in_the_way=in_the_way, misfit=misfit)
        self._heard(topics.RELOCATION_STATUS, status)
        self.learner.on_goal_status(status)

    def _heard(self, topic: topics.Topic, message: Gesture | RelocationStatus) -> None:
        self.events.append(Received(topic, message, self.now_ns, self.now_ns, len(self.events)))

    # What was published

    def requests(self) -> list[str]:
        return [
            Speech.Request.Name(speech.request).removeprefix("REQUEST_")
            for speech in self.speech
            if speech.request != Speech.REQUEST_UNSPECIFIED
        ]

    def sentences(self) -> str:
        return "\n".join(speech.text for speech in self.speech)

    def relocations(self) -> list[RelocationGoal]:
        """Relocations of stage 3, each once."""
        seen = {goal.id: goal for goal in self.goals if goal.kind == RelocationGoal.KIND_RELOCATE}
        return [goal for goal in seen.values() if (goal.to.x, goal.to.y) in OPENINGS.values()]
