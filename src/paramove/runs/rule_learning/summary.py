"""The numbers of one run, as they are written to `run.json` (docs/reference/run_json.md)."""

from __future__ import annotations

import importlib.metadata
import json
import platform
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from paramove.bus import topics
from paramove.msgs.rule_pb2 import Speech
from paramove.robots import RobotDescription
from paramove.runs.recorded_run import RecordedRun
from paramove.runs.relocations import Relocation, relocations_of, stages_of
from paramove.runs.rule_learning.accuracy import (
    DetectedAtRest,
    GripperSample,
    MappedPoints,
    detected_at_rest,
    grid_error,
    gripper_samples,
    summary_statistics,
)
from paramove.runs.rule_learning.pointed_places import (
    PointedPlace,
    pointed_places,
    pointing_summary,
    unrequested_fetches,
)
from paramove.runs.traffic import publishers_of
from paramove.workspace import Workspace

WHERE = ("inside", "outside")
DECIMALS = 6
PACKAGES = ("mujoco", "numpy", "scipy", "opencv-contrib-python-headless", "numba", "protobuf", "pyzmq")


@dataclass(frozen=True, eq=False)
class RunEvaluation:
    """The results of a run; each part is computed at its first use.

    Attributes:
        run: As recorded.
        robot: Description of its robot.
        workspace: Where nodes' modules are, to name the publisher of each topic.
    """

    run: RecordedRun
    robot: RobotDescription
    workspace: Workspace

    @cached_property
    def relocations(self) -> list[Relocation]:
        """Every goal."""
        return relocations_of(self.run)

    @cached_property
    def grasps(self) -> list[Relocation]:
        """Goals for which the arm set out to fetch an object."""
        return [goal for goal in self.relocations if goal.fetches and goal.result != "refused"]

    @cached_property
    def samples(self) -> list[GripperSample]:
        """Grasps and placings."""
        return gripper_samples(self.run, self.robot, self.relocations)

    @cached_property
    def grid(self) -> MappedPoints | None:
        """The calibration over the working area."""
        return grid_error(self.run)

    @cached_property
    def pointings(self) -> list[PointedPlace]:
        """True and estimated targets, with tracking in action space."""
        return pointed_places(self.run)

    @cached_property
    def detections(self) -> list[DetectedAtRest]:
        """Objects detected at rest."""
        return detected_at_rest(self.run)

    @cached_property
    def rules(self) -> list[dict[str, Any]]:
        """The robot's final rules compared with the truth; one entry for each object that has an opening."""
        published = self.run.received(topics.RULES)
        learnt = {rule.object: rule for rule in published[-1].message.rules} if published else {}
        truth = self.run.truth
        radius = min((float(o.radius) for o in truth.layout.openings), default=0.0)
        return [
            _rule(name, truth.openings, radius, opening, learnt.get(name))
            for name, opening in sorted(truth.opening_of.items())
        ]

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Everything, ready for JSON."""
        run, truth = self.run, self.run.truth
        applied = [grasp for grasp in self.grasps if grasp.stage == "apply"]
        calibrated = [grasp for grasp in self.grasps if grasp.stage == "calibrate"]
        return {
            "seed": int(truth.layout.seed),
            "success": bool(run.verdict.get("success", False)),
            "reason": self._reason(),
            "done": run.done,
            "objects": self._objects(),
            "objects_placed": int(run.verdict.get("placed", 0)),
            "grasps": len(applied),
            "grasps_first_try": sum(map(_at_first_try, applied)),
            "calibration_grasps": len(calibrated),
            "calibration_grasps_first_try": sum(map(_at_first_try, calibrated)),
            "training_hull": by_hull(self.relocations),
            "grasp_list": [self._grasp(grasp) for grasp in self.grasps],
            "retries": sum(grasp.goal.attempt > 1 for grasp in self.grasps),
            "refused_goals": [
                {"time_s": goal.begun_s, "kind": goal.kind, "object": goal.goal.object, "reason": goal.reason}
                for goal in self.relocations
                if goal.result == "refused"
            ],
            "unwanted_contacts": int(truth.unwanted_contacts[-1]),
            "contact_list": unwanted_contacts(run),
            "deepest_penetration_mm": float(truth.penetration_mm[-1]),
            **self._pointing(),
            "homography_error_mm": summary_statistics(self.grid.errors_mm if self.grid is not None else ()),
            "seen_at_rest_error_mm": summary_statistics(item.error_mm for item in self.detections),
            "gripper_error_commanded_mm": self._gripper_error("commanded_error_mm"),
            "gripper_error_physical_mm": self._gripper_error("physical_error_mm")
            | {"overall": summary_statistics(1e3 * np.linalg.norm(truth.gripper - truth.commanded, axis=1))},
            "simulated_s": run.end_s,
            "stages": stages_of(run),
            "rules": self.rules,
            "speech": [
                {
                    "time_s": recorded.publish_ns * 1e-9,
                    "request": Speech.Request.Name(recorded.message.request).removeprefix("REQUEST_").lower(),
                    "sentence": recorded.message.text,
                }
                for recorded in run.received(topics.SPEECH)
            ],
            "topic_rates": run.traffic.rates(publishers_of(run.folder / "launch.yaml", self.workspace)),
            "loss": run.traffic.loss(),
            "gaps": [asdict(gap) for gap in run.gaps],
            "versions": _versions(run.facts),
            "workspace": run.facts.get("workspace"),
            "wall": self._wall(),
        }

    def _pointing(self) -> dict[str, Any]:
        if not self.pointings:
            return {}
        return pointing_summary(self.pointings, unrequested_fetches(self.run, self.relocations))

    def _reason(self) -> str:
        run = self.run
        if run.verdict.get("success"):
            return "every object rests in its own opening"
        if run.verdict.get("reason"):
            return str(run.verdict["reason"])
        wrong = [
            f"{name} {'rests in ' + found['rests_in'] if found['rests_in'] else 'is in no opening'}"
            + (", not at rest" if not found["at_rest"] else "")
            + (f", last touched by {found['last_touched_by'] or 'nobody'}" if found["rests_in"] else "")
            for name, found in sorted(run.verdict.get("objects", {}).items())
            if not found["success"]
        ]
        return "; ".join(wrong) + ("" if run.done else "; the application did not report that it was done")

    def _objects(self) -> dict[str, Any]:
        return {
            name: {key: found[key] for key in ("opening", "rests_in", "at_rest", "last_touched_by", "success")}
            for name, found in self.run.verdict.get("objects", {}).items()
        }

    def _gripper_error(self, which: str) -> dict[str, Any]:
        return {
            kind: summary_statistics(getattr(sample, which) for sample in self.samples if sample.kind in kinds)
            for kind, kinds in {"grasp": ("grasp",), "place": ("place",), "both": ("grasp", "place")}.items()
        }

    def _grasp(self, grasp: Relocation) -> dict[str, Any]:
        truth, name = self.run.truth, grasp.goal.object
        before, after = truth.at(grasp.begun_s), truth.at(grasp.ended_s)
        stood, stands = truth.objects[name][before][:2], truth.objects[name][after][:2]
        errors = {
            f"{sample.kind}_{which}_mm": getattr(sample, f"{which}_error_mm")
            for sample in self.samples
            if sample.goal_id == grasp.goal.id
            for which in ("commanded", "physical")
        }
        return {
            "id": grasp.goal.id,
            "stage": grasp.stage,
            "object": name,
            "attempt": grasp.goal.attempt,
            "begun_s": grasp.begun_s,
            "ended_s": grasp.ended_s,
            "result": grasp.result,
            "reason": grasp.reason,
            "held": grasp.held,
            "elbow_turn_deg": float(np.rad2deg(grasp.elbow_turn_rad)),
            "from_hull": grasp.from_hull,
            "to_hull": grasp.to_hull,
            "from": grasp.source[:2].tolist(),
            "from_error_mm": 1e3 * float(np.linalg.norm(grasp.source[:2] - stood)),
            "to": grasp.target[:2].tolist(),
            "to_error_mm": 1e3 * float(np.linalg.norm(grasp.target[:2] - stands)),
        } | errors

    def _wall(self) -> dict[str, Any]:
        facts, verdict = self.run.facts, self.run.verdict
        latest = {
            name: messages[-1].message for name, messages in self.run.messages.items() if name.startswith("status/")
        }
        return {
            "realtime_factor": verdict.get("realtime_factor"),
            "seconds": verdict.get("wall_s"),
            "begun": str(facts.get("begun", "")),
            "run_folder": str(self.run.folder),
            "processing_s": {status.node: status.processing_seconds for status in latest.values()},
        }


def unwanted_contacts(run: RecordedRun) -> list[dict[str, Any]]:
    """When the count of unwanted contacts grew, and the contacts at that time."""
    counts = run.truth.unwanted_contacts
    grew = np.flatnonzero(np.diff(counts, prepend=0) > 0)
    return [
        {
            "time_s": float(run.truth.time_s[state]),
            "count": int(counts[state] - (counts[state - 1] if state else 0)),
            "in_contact": list(run.truth.contacts[state]),
        }
        for state in grew
    ]


def as_json(summary: Any) -> str:
    """The summary as text: sorted keys, floats rounded, so that equal runs give equal files."""
    return json.dumps(rounded(summary), indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False) + "\n"


def rounded(value: Any) -> Any:
    """The same with every float rounded to six digits after the point."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(item) for item in value]
    if isinstance(value, float):
        return round(value, DECIMALS) + 0.0  # no negative zero
    return value


def _at_first_try(grasp: Relocation) -> bool:
    return bool(grasp.goal.attempt <= 1 and grasp.result == "succeeded")


def _rule(name: str, openings: dict[str, Any], radius: float, opening: str, learnt: Any) -> dict[str, Any]:
    true = openings[opening]
    rule: dict[str, Any] = {"object": name, "opening": opening, "true": true.tolist()}
    if learnt is None:
        return rule | {"believed": None, "error_mm": None, "nearest_opening": None, "right": False, "sentence": ""}
    position = np.array([learnt.x, learnt.y])
    nearest = min(openings, key=lambda other: float(np.linalg.norm(openings[other] - position)))
    return rule | {
        "believed": position.tolist(),
        "error_mm": 1e3 * float(np.linalg.norm(position - true)),
        "nearest_opening": nearest,
        "right": bool(np.linalg.norm(position - true) < radius),
        "sentence": learnt.text,
    }


def _versions(facts: dict[str, Any]) -> dict[str, str]:
    versions = {"python": platform.python_version(), "commit": str(facts.get("commit") or "")}
    for package in ("paramove", *PACKAGES):
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = ""
    return versions


def by_hull(goals: Iterable[Relocation]) -> dict[str, Any]:
    """Counts of the goals to fetch something, by where they fetch it (`from`) and where they bring it (`to`)."""
    fetching = [goal for goal in goals if goal.fetches]
    return {
        end: {where: _counts([goal for goal in fetching if getattr(goal, end + "_hull") == where]) for where in WHERE}
        for end in ("from", "to")
    }


def _counts(goals: list[Relocation]) -> dict[str, int]:
    tried = [goal for goal in goals if goal.result != "refused"]
    return {
        "tried": len(tried),
        "succeeded": sum(goal.result == "succeeded" for goal in tried),
        "refused": len(goals) - len(tried),
    }
