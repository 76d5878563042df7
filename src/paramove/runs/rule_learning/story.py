"""Observations, estimates, speech and goals of the robot at any time of a run, for captions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from paramove.bus import topics
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import ApplicationStage
from paramove.objects import PlaneHomography
from paramove.runs.recorded_run import RecordedRun
from paramove.runs.relocations import Relocation

GESTURE_DISPLAYED_S = 1.5
_TEXTS = {
    Gesture.KIND_APPEARED: "appeared",
    Gesture.KIND_MOVED: "moves",
    Gesture.KIND_RESTED: "rests",
    Gesture.KIND_VANISHED: "vanished",
    Gesture.KIND_POINTED_AT: "pointed at",
}


@dataclass(frozen=True, eq=False)
class RobotState:
    """The robot's state at one time.

    Attributes:
        stage: "calibrate", "learn", "apply", "done" or "".
        detail: Text of the last speech message.
        rules: Object -> estimated opening (x, y), m.
        goal: The goal under way, else None; `phase` of its motion.
        gesture: The latest gesture if it is fresh, else None.
        tracked: The latest `TrackedObjects`, else None.
        homography: The robot's calibration, once it has one.
    """

    stage: str
    detail: str
    rules: dict[str, tuple[float, float]]
    goal: Relocation | None
    phase: str
    gesture: Any
    tracked: Any
    homography: PlaneHomography | None

    @property
    def doing(self) -> str:
        """The goal as text."""
        if self.goal is None:
            return ""
        name = f" {self.goal.goal.object}" if self.goal.goal.object else ""
        attempt = f", attempt {self.goal.goal.attempt}" if self.goal.goal.attempt > 1 else ""
        return f"{self.goal.kind.replace('_', ' ')}{name}{attempt}{': ' + self.phase if self.phase else ''}"

    @property
    def seeing(self) -> str:
        """The gesture as text."""
        if self.gesture is None or self.gesture.kind not in _TEXTS:
            return ""
        return f"{self.gesture.object or 'hand'} {_TEXTS[self.gesture.kind]}"


def state_at(run: RecordedRun, relocations: Sequence[Relocation], time_s: float) -> RobotState:
    """The robot's state at a time of a run, s, by the latest of everything; `relocations` are the run's goals."""
    stage, speech = run.latest(topics.APPLICATION_STAGE, time_s), run.latest(topics.SPEECH, time_s)
    rules, plane = run.latest(topics.RULES, time_s), run.latest(topics.CALIBRATION_PLANE, time_s)
    gesture, status = run.latest(topics.GESTURES, time_s), run.latest(topics.RELOCATION_STATUS, time_s)
    # What is drawn onto an image belongs to the time at which the image was taken.
    tracked = run.latest(topics.OBJECTS_TRACKED, time_s, "log_ns")
    goal = next((g for g in relocations if g.begun_s <= time_s < g.ended_s and g.result != "refused"), None)
    of_goal = goal is not None and status is not None and status.message.goal_id == goal.goal.id
    fresh = gesture is not None and time_s - gesture.publish_ns * 1e-9 < GESTURE_DISPLAYED_S
    return RobotState(
        stage=ApplicationStage.Stage.Name(stage.message.stage).removeprefix("STAGE_").lower() if stage else "",
        detail=speech.message.text if speech is not None else "",
        rules={rule.object: (rule.x, rule.y) for rule in rules.message.rules} if rules is not None else {},
        goal=goal,
        phase=status.message.phase if of_goal and status is not None else "",
        gesture=gesture.message if fresh and gesture is not None else None,
        tracked=tracked.message if tracked is not None else None,
        homography=PlaneHomography.from_message(plane.message) if plane is not None else None,
    )
