"""The rule-learning application: calibrate, learn, apply (thesis 5.2.6), from gestures and goal status alone."""

from __future__ import annotations

from paramove.applications.applying import Applying
from paramove.applications.arm_watch import ArmWatch
from paramove.applications.calibrating import Calibrating
from paramove.applications.conversation import Errand, Goals, Outbox
from paramove.applications.learning import Learning
from paramove.applications.stage import Mind, RuleLearnerOptions, Stage
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage
from paramove.msgs.safety_state_pb2 import SafetyState

STAGE_PERIOD_S = 1.0


class RuleLearner:
    """Hear messages with the `on_…` methods, then call `tick`.

    Args:
        options: Places and patience.
        run_name: Begins the goals' ids; a new one for every process, as the same id is done only once.
    """

    def __init__(self, options: RuleLearnerOptions, run_name: str) -> None:
        goals = Goals(options.frame, options.grasp_z)
        self._mind = Mind(options, Errand(goals, run_name), goals)
        self._watch = ArmWatch(options.arm_patience_s)
        self._stage: Stage | None = None
        self._finished = False
        self._said_s = float("-inf")
        self._said_state = ""

    @property
    def failure(self) -> str:
        """Why the application cannot go on; empty while it can."""
        return self._watch.sentence if self._watch.given_up(self._mind.now_s) else ""

    @property
    def finished(self) -> bool:
        """Whether all objects are put away."""
        return self._finished

    @property
    def sentence(self) -> str:
        """What was said last."""
        return self._mind.sentence

    def on_gesture(self, gesture: Gesture) -> None:
        """Something happened on the table."""
        self._mind.table.on_gesture(gesture)
        if self._stage is not None:
            self._stage.on_gesture(gesture)

    def on_goal_status(self, status: RelocationStatus) -> None:
        """The arm says how a goal fares."""
        self._mind.errand.on_status(status)

    def on_safety(self, state: SafetyState) -> None:
        """The safety gate says how it stands."""
        armed = not self._watch.lost
        self._watch.on_safety(state, self._mind.now_s)
        if armed and self._watch.lost:
            self._mind.tell(f"I cannot go on: {self._watch.sentence}.")

    def tick(self, now_s: float) -> Outbox:
        """One turn: what is to be said."""
        mind = self._mind
        mind.now_s = now_s
        if self._stage is None:
            self._enter(Calibrating(mind))
        elif not self._finished and not self._watch.lost:
            following = self._stage.step()
            if following is not None:
                self._follow(following)
        mind.errand.step(now_s, mind.outbox)
        self._say_stage()
        outbox, mind.outbox = mind.outbox, Outbox()
        return outbox

    def _follow(self, stage: ApplicationStage.Stage) -> None:
        if stage == ApplicationStage.STAGE_DONE:
            self._finished = True
        else:
            self._enter({Learning.stage: Learning, Applying.stage: Applying}[stage](self._mind))

    def _enter(self, stage: Stage) -> None:
        self._stage = stage
        stage.enter()

    def _say_stage(self) -> None:
        """Once a second, and whenever it changes."""
        mind, stage = self._mind, self._stage
        assert stage is not None
        state = f"{stage.state} {mind.sentence} {self._finished}"
        if state == self._said_state and mind.now_s - self._said_s < STAGE_PERIOD_S:
            return
        self._said_state, self._said_s = state, mind.now_s
        message = ApplicationStage(
            stage=ApplicationStage.STAGE_DONE if self._finished else stage.stage,
            step=stage.state,
            sentence=mind.sentence,
            grasps=mind.errand.grasps,
            retries=mind.errand.retries,
        )
        message.captured.FromNanoseconds(round(mind.now_s * 1e9))
        mind.outbox.stages.append(message)
