"""Stage 2: the instructor shows which object belongs into which opening (thesis 5.2.6, step 3).

"The robot identifies the color of an object when it starts to move and remembers the object location shortly before the
object disappears."
"""

from __future__ import annotations

from paramove.applications.options import Place, cm
from paramove.applications.stage import ApplicationState, Stage
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import ApplicationStage, Rule, Rules, Speech

BORDER = 0.02  # m; an object that vanishes at the surface's border was carried away
GONE_FOR_GOOD_S = 1.5  # an object that was only hidden appears again within this time


class Learning(Stage):
    """States: asking, watching."""

    stage = ApplicationStage.STAGE_LEARN

    def __init__(self, app: ApplicationState) -> None:
        super().__init__(app)
        self._moved: set[str] = set()
        self._going_in: dict[str, tuple[Place, float]] = {}
        self._observations: dict[str, tuple[float, int]] = {}

    def enter(self) -> None:
        """Ask for the rules."""
        self.app.speak("Please show me into which opening each object belongs.", Speech.REQUEST_SHOW_RULES)
        self.app.go("watching")
        self._last_event_s = self.app.now_s

    def on_gesture(self, gesture: Gesture) -> None:
        """Follow each object from its first movement to its disappearance."""
        self._last_event_s = self.app.now_s
        name, place = gesture.object, (gesture.x, gesture.y)
        if gesture.kind == Gesture.KIND_MOVED:
            self._moved.add(name)
            self._going_in.pop(name, None)
            (self.app.lay.add if gesture.length_m else self.app.lay.discard)(name)
        elif gesture.kind in (Gesture.KIND_APPEARED, Gesture.KIND_RESTED):
            self._going_in.pop(name, None)
            self._moved.discard(name)
            if name in self.app.rules:
                # It is back: the observed opening was wrong, or the person demonstrates it again.
                del self.app.rules[name]
                self._publish_rules()
        elif gesture.kind == Gesture.KIND_VANISHED and name in self._moved and gesture.located:
            self._moved.discard(name)
            if self.app.options.on_surface(place, BORDER):
                self._going_in[name] = (place, gesture.captured.ToNanoseconds() * 1e-9)

    def step(self) -> ApplicationStage.Stage | None:
        """One tick."""
        for name, (place, seen_s) in list(self._going_in.items()):
            if self.app.now_s - seen_s >= GONE_FOR_GOOD_S and not self.app.table.hand_in_view:
                del self._going_in[name]
                self._learn(name, place, seen_s)
        missing = [name for name in self.app.options.objects if name not in self.app.rules]
        if not missing:
            self.app.speak("I know all the rules now.")
            return ApplicationStage.STAGE_APPLY
        quiet_s = self.app.now_s - max(self._last_event_s, self.app.now_s - self.app.for_s)
        if quiet_s > self.app.options.ask_again_s:
            self._ask_again(missing[0])
        return None

    def _learn(self, name: str, place: Place, seen_s: float) -> None:
        count = self._observations.get(name, (0.0, 0))[1] + 1
        self._observations[name] = (seen_s, count)
        self.app.rules[name] = place
        self.app.speak(self._description(name))
        self._publish_rules()

    def _description(self, name: str) -> str:
        place, (seen_s, _) = self.app.rules[name], self._observations[name]
        return f"{name} belongs to the opening at {cm(place)}, seen going in at {seen_s - self.app.begun_s:.1f} s"

    def _publish_rules(self) -> None:
        message = Rules(frame=self.app.options.frame)
        message.captured.FromNanoseconds(round(self.app.now_s * 1e9))
        for name in sorted(self.app.rules):
            place, (seen_s, count) = self.app.rules[name], self._observations[name]
            rule = Rule(object=name, x=place[0], y=place[1], observations=count, text=self._description(name))
            rule.seen.FromNanoseconds(round(seen_s * 1e9))
            message.rules.append(rule)
        self.app.outgoing.rules.append(message)

    def _ask_again(self, name: str) -> None:
        self.app.speak(
            f"I did not see where {name} belongs. Please show me again.", Speech.REQUEST_SHOW_RULE_AGAIN, name
        )
        self.app.go("watching")
