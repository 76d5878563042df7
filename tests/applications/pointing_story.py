"""An arm, a tracker and a person made of messages, tick by tick, around a relocator."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable

from paramove.applications.relocator import Relocator
from paramove.bus import topics
from paramove.bus.subscriber import Received
from paramove.bus.ticks import Tick
from paramove.msgs.action_estimate_pb2 import ActionEstimate
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Speech
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState
from tests.applications.launched import relocator

TICK_NS = 66_666_667
MOTION_S = 4.0
REST = (0.40, -0.30)
PLACES = ((0.14, 0.03), (0.18, -0.06), (0.16, 0.0))
FETCH, PUT, RESTS = RelocationGoal.KIND_FETCH, RelocationGoal.KIND_PLACE_HELD, RelocationGoal.KIND_REST
Place = tuple[float, float]


class PointingStory:
    """What happens follows from `answers`, `points` and `outcomes`, which a test may replace.

    Attributes:
        events: Everything that the relocator received, and the ticks.
        goals: Every goal, each once.
        points: Where the person points next: (place, certainty); None: at nothing.
        offsets: How far beside the object the person seems to point, next.
        outcomes: Of the next goals of a kind: (state, reason). When they are used up, all go well.
        trouble: Why the tracker does not see the arm; "" while it does. `sends_nothing`: no estimates.
        hand_stays: The hand stays where it pointed.
        hand: Where it is.
    """

    def __init__(self, run_name: str = "run", **options) -> None:
        self.relocator = Relocator(relocator(**{"aligns": False, **options}), run_name)
        self.offsets: list[Place] = [(0.004, -0.008)]
        self.events: list[Received | Tick] = []
        self.now_ns = 0
        self.goals: list[RelocationGoal] = []
        self.sent: list[RelocationGoal] = []
        self.speech: list[Speech] = []
        self.stages: list[ApplicationStage] = []
        self.points: list[tuple[Place, float] | None] = [(place, 0.9) for place in PLACES]
        self.outcomes: dict[int, list[tuple[int, str]]] = {}
        self.trouble = ""
        self.sends_nothing = False
        self.lost = True
        self.hand_stays = False
        self.hand = REST
        self.frame = "right_shoulder"
        self._number = 0
        self._count = itertools.count()
        self._later: list[tuple[float, int, Callable[..., None], tuple]] = []

    @property
    def now_s(self) -> float:
        return self.now_ns * 1e-9

    def later(self, after_s: float, do: Callable[..., None], *arguments) -> None:
        heapq.heappush(self._later, (self.now_s + after_s, next(self._count), do, arguments))

    def tick(self) -> None:
        self.now_ns += TICK_NS
        while self._later and self._later[0][0] <= self.now_s:
            _, _, do, arguments = heapq.heappop(self._later)
            do(*arguments)
        if not self.sends_nothing:
            self._estimate()
        self._number += 1
        self.events.append(Tick(self._number, self.now_ns))
        outgoing = self.relocator.tick(self.now_ns * 1e-9)
        self.stages += outgoing.stages
        for goal in outgoing.goals:
            self.sent.append(goal)
            if goal.id not in {known.id for known in self.goals}:
                self.goals.append(goal)
                self._do(goal)
        for speech in outgoing.speech:
            self.speech.append(speech)
            if speech.request == Speech.REQUEST_POINT_AT_PLACE and self.points:
                self._answer(self.points.pop(0))
            if speech.request == Speech.REQUEST_POINT_AT_OBJECT and self.offsets:
                x, y = self.offsets.pop(0)
                start = relocator().start
                self._answer(((start[0] + x, start[1] + y), 0.9))

    def run(self, seconds: float = 300.0, until: Callable[[], bool] | None = None) -> bool:
        end_s = self.now_s + seconds
        while self.now_s < end_s and not self.relocator.finished:
            self.tick()
            if until is not None and until():
                return True
        return self.relocator.finished

    def run_to(self, state: str) -> None:
        assert self.run(until=lambda: self.relocator.state == state), f"stopped at: {self.relocator.detail}"

    # What is seen

    def point(self, place: Place, certainty: float = 0.9, frame: str = "right_shoulder") -> None:
        self.hand = place
        gesture = Gesture(kind=Gesture.KIND_POINTED_AT, located=True, frame=frame, x=place[0], y=place[1])
        gesture.confidence = certainty
        gesture.captured.FromNanoseconds(self.now_ns)
        self._hear(topics.GESTURES, gesture, self.relocator.on_gesture)
        if not self.hand_stays:
            self.later(1.0, self.take_away)

    def take_away(self) -> None:
        self.hand = REST

    def safety(self, state: SafetyState.State, why: str = "") -> None:
        message = SafetyState(state=state, faults=[SafetyFault(code="x", detail=why)] if why else [])
        self._hear(topics.ARM_SAFETY, message, self.relocator.on_safety)

    def _answer(self, how: tuple[Place, float] | None) -> None:
        if how is not None:
            self.later(2.0, self.point, *how)

    def _estimate(self) -> None:
        message = ActionEstimate(frame=self.frame, views=2, particles=400, effective_sample_size=90.0)
        message.captured.FromNanoseconds(self.now_ns)
        message.hand.x, message.hand.y = self.hand
        if self.trouble:
            message.lost, message.degraded, message.detail = self.lost, not self.lost, self.trouble
        self._hear(topics.ACTION_ESTIMATE, message, self.relocator.on_estimate)

    # What the arm does

    def _do(self, goal: RelocationGoal) -> None:
        waiting = self.outcomes.get(goal.kind)
        state, reason = waiting.pop(0) if waiting else (RelocationStatus.STATE_SUCCEEDED, "")
        if state == RelocationStatus.STATE_REJECTED:
            self._say(goal.id, state, reason)
            return
        self._say(goal.id, RelocationStatus.STATE_ACCEPTED)
        self.later(MOTION_S, self._say, goal.id, state, reason)

    def _say(self, goal_id: str, state: RelocationStatus.State, reason: str = "") -> None:
        message = RelocationStatus(goal_id=goal_id, state=state, reason=reason)
        self._hear(topics.RELOCATION_STATUS, message, self.relocator.on_goal_status)

    def _hear(self, topic: topics.Topic, message, on: Callable) -> None:
        self.events.append(Received(topic, message, self.now_ns, self.now_ns, len(self.events)))
        on(message)

    # What was published

    def of(self, kind: RelocationGoal.Kind) -> list[RelocationGoal]:
        return [goal for goal in self.goals if goal.kind == kind]

    def sentences(self) -> str:
        return "\n".join(speech.text for speech in self.speech)
