"""The goals that the rule learner set, each with how it went and when."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import Any

import numpy as np

from paramove.bus import topics
from paramove.documents import Floats
from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage
from paramove.runs.recorded_run import RecordedRun

_LAST: dict[int, str] = {
    RelocationStatus.STATE_SUCCEEDED: "succeeded",
    RelocationStatus.STATE_FAILED: "failed",
    RelocationStatus.STATE_REJECTED: "refused",
}
_HULLS: dict[int, str] = {RelocationStatus.HULL_INSIDE: "inside", RelocationStatus.HULL_OUTSIDE: "outside"}


@dataclass(frozen=True, eq=False)
class Relocation:
    """One goal.

    Attributes:
        goal: As it was first published.
        stage: Name of the application's stage: calibrate, learn, apply.
        begun_s, ended_s: From the goal to its last status (or the end of the run).
        result: "succeeded", "failed", "refused", or "unfinished".
        reason: The synthesizer's reason.
        held: Whether the object was felt in the hand when it was to be carried.
        elbow_turn_rad: Largest turn of the elbow.
        from_hull, to_hull: Whether the goal's positions lie "inside" or "outside" the convex hull of the targets that
            the movement model was trained with; None where there is none or it is not known.
    """

    goal: Any
    stage: str
    begun_s: float
    ended_s: float
    result: str
    reason: str
    held: bool
    elbow_turn_rad: float
    from_hull: str | None = None
    to_hull: str | None = None

    @property
    def fetches(self) -> bool:
        """Whether an object was to be grasped from the table."""
        return bool(self.goal.kind == RelocationGoal.KIND_RELOCATE)

    @property
    def kind(self) -> str:
        """Kind of goal as text."""
        return str(RelocationGoal.Kind.Name(self.goal.kind)).removeprefix("KIND_").lower()

    @property
    def source(self) -> Floats:
        """Where it was to be fetched, [3], m."""
        position = getattr(self.goal, "from")
        return np.array([position.x, position.y, position.z])

    @property
    def target(self) -> Floats:
        """Where it was to be put, [3], m."""
        return np.array([self.goal.to.x, self.goal.to.y, self.goal.to.z])


@dataclass(frozen=True, eq=False)
class Motion:
    """A trajectory that the arm executed.

    Attributes:
        goal_id: Of the goal that it belongs to.
        begun_s: When its time was 0, in the run's time.
        reached_s: How far it got, along the trajectory.
        duration_s: Of the whole trajectory.
        phases: Name -> start, s.
    """

    goal_id: str
    begun_s: float
    reached_s: float
    duration_s: float
    phases: dict[str, float]

    def middle_of(self, phase: str) -> float | None:
        """Middle of a phase along the trajectory, s; None if it has none or did not get there."""
        if phase not in self.phases:
            return None
        start = self.phases[phase]
        end = min((other for other in self.phases.values() if other > start), default=self.duration_s)
        middle = (start + end) / 2
        return middle if middle <= self.reached_s else None


def stages_of(run: RecordedRun) -> list[dict[str, Any]]:
    """Stages in order: name, begin_s, end_s."""
    stages: list[dict[str, Any]] = []
    for recorded in run.received(topics.APPLICATION_STAGE):
        name = ApplicationStage.Stage.Name(recorded.message.stage).removeprefix("STAGE_").lower()
        if not stages or stages[-1]["stage"] != name:
            if stages:
                stages[-1]["end_s"] = recorded.publish_ns * 1e-9
            stages.append({"stage": name, "begin_s": recorded.publish_ns * 1e-9, "end_s": run.end_s})
    return [stage for stage in stages if stage["stage"] != "done"]


def relocations_of(run: RecordedRun) -> list[Relocation]:
    """Every goal in order; one that was sent again counts once."""
    stages = stages_of(run)
    begins = [stage["begin_s"] for stage in stages]
    statuses: dict[str, list[Any]] = {}
    for recorded in run.received(topics.RELOCATION_STATUS):
        statuses.setdefault(recorded.message.goal_id, []).append(recorded)
    relocations: dict[str, Relocation] = {}
    for recorded in run.received(topics.RELOCATION_GOAL):
        goal, begun_s = recorded.message, recorded.publish_ns * 1e-9
        if goal.id not in relocations:
            # A goal published with a stage's last message belongs to that stage: a stage never begins with a fetch.
            index = max(bisect_right(begins, begun_s) - 1, 0)
            stage = stages[index]["stage"] if stages else ""
            relocations[goal.id] = _relocation(goal, stage, begun_s, statuses.get(goal.id, []), run.end_s)
    return list(relocations.values())


def _relocation(goal: Any, stage: str, begun_s: float, statuses: list[Any], end_s: float) -> Relocation:
    last = next((r for r in statuses if r.message.state in _LAST), None)
    executing = [r.message for r in statuses if r.message.state == RelocationStatus.STATE_EXECUTING]
    return Relocation(
        goal=goal,
        stage=stage,
        begun_s=begun_s,
        ended_s=last.publish_ns * 1e-9 if last is not None else end_s,
        result=_LAST[last.message.state] if last else "unfinished",
        reason=last.message.reason if last is not None else "",
        held=any(status.phase == "carry" and status.holding for status in executing),
        elbow_turn_rad=max((r.message.elbow_turn_rad for r in statuses), default=0.0),
        from_hull=_hull_of(statuses, "from_hull"),
        to_hull=_hull_of(statuses, "to_hull"),
    )


def _hull_of(statuses: list[Any], name: str) -> str | None:
    hulls = [_HULLS[value] for r in statuses if (value := getattr(r.message, name)) in _HULLS]
    return hulls[-1] if hulls else None


def motions_of(run: RecordedRun) -> list[Motion]:
    """Every trajectory that was begun, in order."""
    progress: dict[str, list[tuple[float, float]]] = {}
    for recorded in run.received(topics.ARM_TRAJECTORY_STATUS):
        status = recorded.message
        if status.state == TrajectoryStatus.STATE_EXECUTING and status.time_s > 0:
            at_s = run.captured_s(status)
            progress.setdefault(status.trajectory_id, []).append((at_s, status.time_s))
        elif status.state == TrajectoryStatus.STATE_SUCCEEDED and status.trajectory_id in progress:
            begun_s = progress[status.trajectory_id][0][0] - progress[status.trajectory_id][0][1]
            progress[status.trajectory_id].append((begun_s + status.duration_s, status.duration_s))
    motions: dict[str, Motion] = {}
    for recorded in run.received(topics.ARM_TRAJECTORY):
        message = recorded.message
        if message.id in motions or message.id not in progress:
            continue
        known = progress[message.id]
        motions[message.id] = Motion(
            goal_id=message.id.rpartition("/")[0],
            begun_s=float(np.median([at_s - time_s for at_s, time_s in known])),
            reached_s=max(time_s for _, time_s in known),
            duration_s=message.points[-1].time_s,
            phases={phase.name: phase.start_s for phase in message.phases},
        )
    return list(motions.values())
