"""A recorded run of relocation by pointing: true targets, recognised targets, and where the object ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from paramove.bus import topics
from paramove.documents import Floats
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import RelocationGoal
from paramove.msgs.rule_pb2 import Speech
from paramove.runs.after_a_run import rounded
from paramove.runs.recorded_run import RecordedRun, RunFolderError
from paramove.runs.relocations import Relocation, relocations_of

SCALE = 0.42
"""Of the simulated person and table over a grown person at a table of usual size."""
GOAL_AT_HUMAN_SCALE = 0.03
GOAL = SCALE * GOAL_AT_HUMAN_SCALE
"""m: maximum distance of the object from the target pointed at."""
UPRIGHT = 0.99
"""Minimum cosine of the tilt of a standing object."""


@dataclass(frozen=True, eq=False)
class PointedRelocation:
    """One target at which the robot was to put the object. Positions are x, y in the right shoulder's frame, m.

    Attributes:
        number: From 1.
        pointed: The true target of the person, (2,); None if nobody pointed.
        pointed_s: When the fingertip arrived there.
        recognised: The target that the robot recognised, (2,), at `recognised_s`.
        certainty: Of it, 0 to 1.
        final: Where the object ended, (2,), at `final_s`.
        stands: Whether it stands upright there, put by the robot.
        result: Of the robot's goal, one word; `reason` if it is not "succeeded".
    """

    number: int
    pointed: Floats | None
    pointed_s: float
    recognised: Floats
    recognised_s: float
    certainty: float
    final: Floats
    final_s: float
    stands: bool
    result: str
    reason: str

    @property
    def error(self) -> float:
        """From the true target to where the object ended, m; infinite if nobody pointed."""
        return _apart(self.final, self.pointed)

    @property
    def recognition_error(self) -> float:
        """From the true target to the recognised one, m."""
        return _apart(self.recognised, self.pointed)

    @property
    def placing_error(self) -> float:
        """From the recognised target to where the object ended, m."""
        return _apart(self.final, self.recognised)

    @property
    def good(self) -> bool:
        """Whether the object stands at the true target."""
        return self.result == "succeeded" and self.stands and self.error <= GOAL

    def as_json(self) -> dict[str, Any]:
        """All numbers; positions in m, errors in mm as they are and in cm at human scale."""
        return {
            "good": self.good,
            "pointed": None if self.pointed is None else _places(self.pointed),
            "recognised": _places(self.recognised),
            "final": _places(self.final),
            "certainty": round(self.certainty, 3),
            "error_mm": rounded(1e3 * self.error),
            "recognition_error_mm": rounded(1e3 * self.recognition_error),
            "placing_error_mm": rounded(1e3 * self.placing_error),
            "error_cm_at_human_scale": rounded(1e2 * self.error / SCALE),
            "stands": self.stands,
            "result": self.result,
            "reason": self.reason,
            "recognised_after_s": rounded(self.recognised_s - self.pointed_s),
            "took_s": rounded(self.final_s - self.recognised_s),
        }


def pointed_relocations_of(run: RecordedRun) -> list[PointedRelocation]:
    """Every goal to put the object somewhere that was not rejected, in order."""
    arrivals = _arrivals(run)
    gestures = [
        (recorded.publish_ns * 1e-9, recorded.message)
        for recorded in run.received(topics.GESTURES)
        if recorded.message.kind == Gesture.KIND_POINTED_AT
    ]
    goals = [
        one
        for one in relocations_of(run)
        if one.goal.kind == RelocationGoal.KIND_PLACE_HELD and one.result != "refused"
    ]
    return [_relocation(run, number, one, arrivals, gestures) for number, one in enumerate(goals, start=1)]


def summary_of(run: RecordedRun, relocations: list[PointedRelocation]) -> dict[str, Any]:
    """All numbers of a run, as plain JSON."""
    speech = [recorded.message for recorded in run.received(topics.SPEECH)]
    requests = sum(one.request == Speech.REQUEST_POINT_AT_PLACE for one in speech)
    goals = relocations_of(run)
    errors = np.array([one.error for one in relocations if np.isfinite(one.error)])
    good = sum(one.good for one in relocations)
    truth = run.truth
    return {
        "success": bool(run.done and relocations and good == len(relocations)),
        "reason": _reason(run, relocations),
        "seed": int(truth.layout.seed),
        "scale": SCALE,
        "goal_mm": round(1e3 * GOAL, 3),
        "done": run.done,
        "good": good,
        "relocations": [one.as_json() for one in relocations],
        "error_mm": {
            "median": rounded(1e3 * float(np.median(errors))) if len(errors) else None,
            "worst": rounded(1e3 * float(errors.max())) if len(errors) else None,
        },
        "asked": requests,
        "refused": sum(one.result == "refused" for one in goals),
        "failed": sum(one.result == "failed" for one in goals),
        "helped": sum(one.request == Speech.REQUEST_HELP for one in speech),
        "pointings": len(_arrivals(run)),
        "unwanted_contacts": int(truth.unwanted_contacts[-1]),
        "deepest_penetration_mm": round(float(truth.penetration_mm[-1]), 4),
        "simulated_s": round(run.end_s, 3),
    }


def _reason(run: RecordedRun, relocations: list[PointedRelocation]) -> str:
    """Why a run is no success; empty if it is."""
    if not relocations:
        return "the object was put nowhere"
    for one in relocations:
        if not one.good:
            return f"place {one.number}: {_fault(one)}"
    return "" if run.done else f"after {len(relocations)} places the run ended"


def _fault(one: PointedRelocation) -> str:
    if one.result != "succeeded":
        return one.reason or one.result
    if one.pointed is None:
        return "nobody had pointed"
    if not one.stands:
        return "the object does not stand"
    return f"the object stands {1e3 * one.error:.1f} mm from the place pointed at (goal {1e3 * GOAL:.1f} mm)"


def _relocation(
    run: RecordedRun,
    number: int,
    put: Relocation,
    arrivals: list[tuple[float, Floats]],
    gestures: list[tuple[float, Any]],
) -> PointedRelocation:
    gestures_before = [(time_s, gesture) for time_s, gesture in gestures if time_s <= put.begun_s]
    recognised_s, certainty = (
        (gestures_before[-1][0], gestures_before[-1][1].confidence) if gestures_before else (put.begun_s, 0.0)
    )
    before = [(time_s, target) for time_s, target in arrivals if time_s <= recognised_s]
    pointed_s, pointed = before[-1] if before else (float("nan"), None)
    at = run.truth.at(put.ended_s)
    name = put.goal.object
    return PointedRelocation(
        number=number,
        pointed=pointed,
        pointed_s=pointed_s,
        recognised=put.target[:2],
        recognised_s=recognised_s,
        certainty=float(certainty),
        final=run.truth.objects[name][at, :2],
        final_s=put.ended_s,
        stands=bool(run.truth.upright[name][at] >= UPRIGHT and not run.truth.held_by_instructor[name][at]),
        result=put.result,
        reason=put.reason,
    )


def _arrivals(run: RecordedRun) -> list[tuple[float, Floats]]:
    """When the fingertip was at a target for the first time in each demonstration, s, and the target (2,)."""
    layout = run.truth.layout
    if len(layout.world_from_table) != 16:
        raise RunFolderError(f"{run.folder}: the truth has no position of the person's table (world_from_table)")
    world_from_table = np.array(layout.world_from_table).reshape(4, 4)
    arrivals: dict[int, tuple[float, Floats]] = {}
    for recorded in run.recording("truth").read({topics.TRUTH_ARM.name}):
        arm = recorded.message
        time_s = 1e-9 * (arm.time_ns - run.begun_ns)
        if arm.at_target and arm.performance not in arrivals and time_s <= run.end_s:
            in_table = np.array([arm.target.x, arm.target.y, arm.target.z, 1.0])
            in_shoulder = (world_from_table @ in_table)[:3] - run.truth.shoulder
            arrivals[arm.performance] = (time_s, in_shoulder[:2])
    return list(arrivals.values())


def _apart(one: Floats, other: Floats | None) -> float:
    return float("inf") if other is None else float(np.linalg.norm(one - other))


def _places(place: Floats) -> list[float]:
    return [round(float(value), 5) for value in place]
