"""Relocation by pointing (paper 5.4, figure 16): the robot holds an object and puts it where a person points.

Then it fetches the object again, and the person points at the next position. It knows the object's position from its
own last placement.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from paramove.applications.application import Application
from paramove.applications.conversation import position_at
from paramove.applications.options import Place, RelocatorOptions, cm, within
from paramove.msgs.action_estimate_pb2 import ActionEstimate
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import Position, RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Speech

NO_ESTIMATE_S = 1.0


class Relocator(Application):
    """Pass received messages to the `on_…` methods, then call `tick`.

    States: resting, aligning (waiting for the object to be pointed at), fetching, waiting (for a target),
    letting_hand_leave, placing, helped (waiting for help).

    Args:
        options: Positions and timeouts.
        run_name: Prefix of the goals' ids; unique to the process, as a goal id is executed only once.

    Attributes:
        placed: Positions at which the object was put.
    """

    def __init__(self, options: RelocatorOptions, run_name: str) -> None:
        super().__init__(options, run_name)
        self.stage = ApplicationStage.STAGE_APPLY
        self._options = options
        self._sight = ArmSight(options.frame)
        self._quiet_since_s = 0.0
        self._reported: set[str] = set()
        self._object_at = options.start
        self._target: Place = options.start
        self._offset: Place | None = None if options.aligns else (0.0, 0.0)
        self._holding = False
        self._missed = 0
        self.placed: list[Place] = []
        self._steps = {
            "resting": self._resting,
            "aligning": lambda: self._watch_for(self._ask_to_align),
            "fetching": self._fetching,
            "waiting": lambda: self._watch_for(self._ask),
            "letting_hand_leave": self._letting_hand_leave,
            "placing": self._placing,
            "helped": self._helped,
        }

    def on_gesture(self, gesture: Gesture) -> None:
        """The tracker recognised a pointing gesture. One captured before the robot's request is ignored."""
        after_request = gesture.captured.ToNanoseconds() * 1e-9 > self._since_s
        if gesture.kind != Gesture.KIND_POINTED_AT or not gesture.located or not after_request:
            return
        if self.state == "waiting":
            self._pointed_at(gesture)
        elif self.state == "aligning":
            self._pointed_at_object(gesture)

    def on_estimate(self, estimate: ActionEstimate) -> None:
        """The tracker's estimate of the person's arm."""
        self._sight.on_estimate(estimate, self.now_s)

    def begin(self) -> None:
        """Bring the arm to its base pose, wherever it is."""
        self._rest()

    def step(self) -> None:
        """One tick of the state."""
        self._steps[self.state]()

    # States

    def _rest(self) -> None:
        self.goal_client.start(RelocationGoal.KIND_REST, self.now_s)
        self.go("resting")

    def _resting(self) -> None:
        outcome = self.goal_client.outcome
        if self.goal_client.succeeded:
            self._fetch() if self._offset is not None else self._ask_to_align()
        elif outcome is not None:
            self._ask_for_help(f"I cannot bring my arm to rest: {outcome.reason}")

    def _fetch(self) -> None:
        source = self.goal_client.position(self._object_at)
        self._start(RelocationGoal.KIND_FETCH, source, position_at(self._options.hold), 1 + self._missed)
        self.go("fetching")

    def _fetching(self) -> None:
        outcome = self.goal_client.outcome
        if self.goal_client.succeeded:
            self._missed, self._holding = 0, True
            self._ask()
        elif outcome is not None:
            self._missed += 1
            failed = outcome.state == RelocationStatus.STATE_FAILED
            if failed and self._missed < self._options.attempts:
                self.speak(f"I could not fetch it at {cm(self._object_at)}: {outcome.reason}. I try again.")
                self._rest()
            else:
                self._ask_for_help(f"I could not fetch it at {cm(self._object_at)}: {outcome.reason}")

    def _ask(self, before: str = "") -> None:
        self.speak(f"{before}Please point at the place where I shall put it.", Speech.REQUEST_POINT_AT_PLACE)
        self._wait_for("waiting")

    def _ask_to_align(self, before: str = "") -> None:
        self.speak(f"{before}Please point at the object, so that I see how you point.", Speech.REQUEST_POINT_AT_OBJECT)
        self._wait_for("aligning")

    def _wait_for(self, state: str) -> None:
        self._quiet_since_s, self._reported = self.now_s, set()
        self.go(state)

    def _watch_for(self, ask: Callable[[str], None]) -> None:
        trouble = self._sight.trouble(self.now_s)
        if trouble:
            self._quiet_since_s = self.now_s
            if trouble not in self._reported:
                self._reported.add(trouble)
                self.speak(f"I do not see where you point: {trouble}. I wait.")
        elif self.now_s - self._quiet_since_s > self._options.ask_again_s:
            ask("I have not seen you point. ")

    def _pointed_at(self, gesture: Gesture) -> None:
        assert self._offset is not None
        target = (gesture.x - self._offset[0], gesture.y - self._offset[1])
        doubt = self._doubt(gesture) or self._unfit(target)
        if doubt:
            self._ask(f"{doubt} ")
            return
        self._target = target
        self.speak(f"You point at {cm(target)}, certain to {100 * gesture.confidence:.0f} %. I put it there.")
        self.go("letting_hand_leave")

    def _pointed_at_object(self, gesture: Gesture) -> None:
        offset = (gesture.x - self._object_at[0], gesture.y - self._object_at[1])
        doubt = self._doubt(gesture)
        if not doubt and not math.hypot(*offset) <= self._options.max_offset:  # NaN is not below either
            doubt = f"You point at {cm((gesture.x, gesture.y))}, but the object stands at {cm(self._object_at)}."
        if doubt:
            self._ask_to_align(f"{doubt} ")
            return
        self._offset, self._target = offset, self._object_at
        self.speak(f"I see you point {1000 * math.hypot(*offset):.0f} mm beside the object. I bear that in mind.")
        self.go("letting_hand_leave")

    def _doubt(self, gesture: Gesture) -> str:
        """Why a gesture's target is not accepted; empty if it is."""
        o = self._options
        if gesture.frame != o.frame:
            return f"You point at a place in the frame {gesture.frame!r}; I only know places in {o.frame!r}."
        if not gesture.confidence >= o.min_certainty:  # NaN is not at least anything
            return (
                f"I am not sure where you point: certain to {100 * gesture.confidence:.0f} %, "
                f"{100 * o.min_certainty:.0f} % are needed."
            )
        return ""

    def _unfit(self, target: Place) -> str:
        """Why the object cannot be put at a position; empty if it can."""
        o = self._options
        if not within(target, o.area_x, o.area_y):
            first, last = (cm(corner) for corner in zip(o.area_x, o.area_y, strict=True))
            return f"You point at {cm(target)}, which I do not reach: my working area goes from {first} to {last}."
        near = [other for other in o.standing if math.dist(other, target) < o.min_gap]
        if near:
            return f"You point at {cm(target)}, but something stands there, at {cm(near[0])}."
        return ""

    def _letting_hand_leave(self) -> None:
        """Wait until the hand is known to be away from the target."""
        away_s = self._sight.away_for(self._target, self._options.hand_away, self.now_s)
        if away_s >= self._options.hand_away_s and not self._holding:
            self._fetch()
        elif away_s >= self._options.hand_away_s:
            self._start(RelocationGoal.KIND_PLACE_HELD, None, self.goal_client.position(self._target))
            self.go("placing")
        elif self.for_s > self._options.ask_again_s:
            self.speak(f"Please take your hand away from {cm(self._target)}, so that I can go there.")
            self.go("letting_hand_leave")

    def _placing(self) -> None:
        outcome = self.goal_client.outcome
        if self.goal_client.succeeded:
            self._object_at, self._holding = self._target, False
            self.placed.append(self._target)
            self.speak(f"It stands at {cm(self._target)}.")
            self._fetch() if len(self.placed) < self._options.places else self._finish()
        elif outcome is None:
            return
        elif outcome.state == RelocationStatus.STATE_REJECTED:
            self._ask(f"I cannot put it at {cm(self._target)}: {outcome.reason}. ")
        else:
            self._ask_for_help(f"I could not put it at {cm(self._target)}: {outcome.reason}")

    def _finish(self) -> None:
        self.speak("It has been at all places. Thank you!", Speech.REQUEST_THANK_YOU)
        self.stage = ApplicationStage.STAGE_DONE
        self.go("done")

    def _ask_for_help(self, detail: str) -> None:
        """Ask a person to put the object back to its start: its position is no longer known."""
        self._object_at, self._missed, self._holding = self._options.start, 0, False
        self.speak(f"{detail}. Please stand it at {cm(self._object_at)}.", Speech.REQUEST_HELP)
        self.go("helped")

    def _helped(self) -> None:
        if self.for_s > self._options.ask_again_s:
            self._rest()

    # Outgoing messages

    def _start(self, kind: RelocationGoal.Kind, source: Position | None, target: Position, attempt: int = 1) -> None:
        o = self._options
        self.goal_client.start(kind, self.now_s, o.object_name, source, target, o.standing, attempt)

    def speak(self, detail: str, request: Speech.Request = Speech.REQUEST_UNSPECIFIED, name: str = "") -> None:
        """Say something about the object."""
        super().speak(detail, request, name or self._options.object_name)


class ArmSight:
    """Follows the tracker's estimates.

    Args:
        frame: Frame of the positions passed to `away_for`.
    """

    def __init__(self, frame: str) -> None:
        self._frame = frame
        self._received_s = float("-inf")
        self._trouble = ""
        self._hand: tuple[float, float] | None = None
        self._near_s: dict[tuple[float, float], float] = {}

    def on_estimate(self, estimate: ActionEstimate, now_s: float) -> None:
        """Store the current estimate; a hand in another frame is ignored."""
        self._received_s = now_s
        if estimate.lost or estimate.degraded:
            self._trouble = "the tracker has lost the arm" if estimate.lost else "no camera sees the arm"
            self._hand = None
        else:
            self._trouble = ""
            self._hand = (estimate.hand.x, estimate.hand.y) if estimate.frame == self._frame else None

    def trouble(self, now_s: float) -> str:
        """Why there is no valid estimate of the arm; empty while there is one."""
        if now_s - self._received_s > NO_ESTIMATE_S:
            return "the tracker sends no data"
        return self._trouble

    def away_for(self, position: tuple[float, float], distance: float, now_s: float) -> float:
        """How long the hand has been farther than `distance`, m, from a position, s; counted from its first query."""
        away = (
            not self.trouble(now_s)
            and self._hand is not None
            and math.dist(self._hand, position) > distance  # False for NaN
        )
        if not away or position not in self._near_s:
            self._near_s = {position: now_s}
        return now_s - self._near_s[position]
