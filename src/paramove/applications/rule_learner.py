"""The rule-learning application: calibrate, learn, apply (thesis 5.2.6), from gestures and goal status alone."""

from __future__ import annotations

from paramove.applications.applying import Applying
from paramove.applications.arm_watch import ArmWatch
from paramove.applications.calibrating import Calibrating
from paramove.applications.conversation import GoalClient, Goals, OutgoingMessages
from paramove.applications.learning import Learning
from paramove.applications.options import RuleLearnerOptions
from paramove.applications.stage import ApplicationState, Stage
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage
from paramove.msgs.safety_state_pb2 import SafetyState

STAGE_PERIOD_S = 1.0


class RuleLearner:
    """Pass received messages to the `on_…` methods, then call `tick`.

    Args:
        options: Positions and timeouts.
        run_name: Prefix of the goals' ids; unique to the process, as a goal id is executed only once.
        begun_ns: When the run began, by its clock; for texts.
    """

    def __init__(self, options: RuleLearnerOptions, run_name: str, begun_ns: int = 0) -> None:
        goals = Goals(options.frame, options.grasp_z)
        self._app = ApplicationState(options, GoalClient(goals, run_name), goals, 1e-9 * begun_ns)
        self._watch = ArmWatch(options.arming_timeout_s)
        self._stage: Stage | None = None
        self._finished = False
        self._published_s = float("-inf")
        self._published_state = ""

    @property
    def failure(self) -> str:
        """Why the application cannot go on; empty while it can."""
        return self._watch.detail if self._watch.given_up(self._app.now_s) else ""

    @property
    def finished(self) -> bool:
        """Whether all objects are put away."""
        return self._finished

    @property
    def detail(self) -> str:
        """Text of the last speech message."""
        return self._app.detail

    def on_gesture(self, gesture: Gesture) -> None:
        """Something happened on the table."""
        self._app.table.on_gesture(gesture)
        if self._stage is not None:
            self._stage.on_gesture(gesture)

    def on_goal_status(self, status: RelocationStatus) -> None:
        """The arm reports the status of a goal."""
        self._app.goal_client.on_status(status)

    def on_safety(self, state: SafetyState) -> None:
        """The safety gate reports its state."""
        armed = not self._watch.lost
        self._watch.on_safety(state, self._app.now_s)
        if armed and self._watch.lost:
            self._app.speak(f"I cannot go on: {self._watch.detail}.")

    def tick(self, now_s: float) -> OutgoingMessages:
        """One tick; returns the messages to publish."""
        app = self._app
        app.now_s = now_s
        if self._stage is None:
            self._enter(Calibrating(app))
        elif arming := self._watch.first_arming(now_s):
            if app.detail != arming:
                app.speak(arming)
        elif not self._finished and not self._watch.lost:
            following = self._stage.step()
            if following is not None:
                self._follow(following)
        app.goal_client.step(now_s, app.outgoing)
        self._publish_stage()
        outgoing, app.outgoing = app.outgoing, OutgoingMessages()
        return outgoing

    def _follow(self, stage: ApplicationStage.Stage) -> None:
        if stage == ApplicationStage.STAGE_DONE:
            self._finished = True
        else:
            stages = {one.stage: one for one in (Calibrating, Learning, Applying)}
            self._enter(stages[stage](self._app))

    def _enter(self, stage: Stage) -> None:
        self._stage = stage
        stage.enter()

    def _publish_stage(self) -> None:
        """Publish the stage once a second and on every change."""
        app, stage = self._app, self._stage
        assert stage is not None
        state = f"{stage.state} {app.detail} {self._finished}"
        if state == self._published_state and app.now_s - self._published_s < STAGE_PERIOD_S:
            return
        self._published_state, self._published_s = state, app.now_s
        message = ApplicationStage(
            stage=ApplicationStage.STAGE_DONE if self._finished else stage.stage,
            step=stage.state,
            detail=app.detail,
            grasps=app.goal_client.grasps,
            retries=app.goal_client.retries,
        )
        message.captured.FromNanoseconds(round(app.now_s * 1e9))
        app.outgoing.stages.append(message)
