"""The rule-learning application: calibrate, learn, apply (thesis 5.2.6), from gestures and goal status alone."""

from __future__ import annotations

from paramove.applications.applying import Applying
from paramove.applications.calibrating import Calibrating
from paramove.applications.learning import Learning
from paramove.applications.options import RuleLearnerOptions
from paramove.applications.stage import ApplicationState, Stage
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import ApplicationStage

_STAGES = {one.stage: one for one in (Calibrating, Learning, Applying)}


class RuleLearner(ApplicationState):
    """Pass received messages to the `on_…` methods, then call `tick`.

    Args:
        options: Positions and timeouts.
        run_name: Prefix of the goals' ids; unique to the process, as a goal id is executed only once.
        begun_ns: When the run began, by its clock; for texts.
    """

    def __init__(self, options: RuleLearnerOptions, run_name: str, begun_ns: int = 0) -> None:
        super().__init__(options, run_name, 1e-9 * begun_ns)
        self._stage: Stage = Calibrating(self)

    def on_gesture(self, gesture: Gesture) -> None:
        """Something happened on the table."""
        self.table.on_gesture(gesture)
        self._stage.on_gesture(gesture)

    def begin(self) -> None:
        """Calibrate."""
        self._enter(self._stage)

    def step(self) -> None:
        """One tick of the stage."""
        following = self._stage.step()
        if following == ApplicationStage.STAGE_DONE:
            self.stage = following
        elif following is not None:
            self._enter(_STAGES[following](self))

    def _enter(self, stage: Stage) -> None:
        self.stage, self._stage = stage.stage, stage
        stage.enter()
