"""Estimates and actions of the robot, collected from its nodes' messages: rules, positions, goals, speech."""

from __future__ import annotations

from collections import deque
from dataclasses import asdict, dataclass
from typing import Any

from paramove.msgs.action_estimate_pb2 import ActionEstimate
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.msgs.relocation_pb2 import Position, RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Rules, Speech
from paramove.msgs.tracked_objects_pb2 import TrackedObject, TrackedObjects
from paramove.objects import HomographyError, ObjectShape, PlaneHomography

MAX_SPEECH = 12
MAX_RESULTS = 8
POINTING_DISPLAY_S = 3.0
POINTING_KNOWN_CM = 6.0
"""Largest standard deviation of a target that is displayed."""
_ENDED = frozenset({RelocationStatus.STATE_SUCCEEDED, RelocationStatus.STATE_FAILED, RelocationStatus.STATE_REJECTED})
_PUTS_DOWN = frozenset({RelocationGoal.KIND_RELOCATE, RelocationGoal.KIND_PLACE_HELD})
_GESTURES = {
    Gesture.KIND_APPEARED: "stands",
    Gesture.KIND_RESTED: "stands",
    Gesture.KIND_MOVED: "moves",
    Gesture.KIND_VANISHED: "gone",
}
IN_HAND = "in the robot's hand"


def _label(enum: Any, value: int) -> str:
    """`STATE_SUCCEEDED` -> `succeeded`."""
    return str(enum.Name(value)).partition("_")[2].replace("_", " ").lower()


@dataclass
class _Object:
    state: str = "not detected yet"
    detected: tuple[float, float] | None = None  # m, plane's frame
    put: tuple[float, float] | None = None  # where the robot itself put it down
    shape: ObjectShape | None = None  # as it was last seen


class Estimates:
    """Handles messages with the `on_…` methods; `sections` gives JSON values for the page.

    Lengths in the sections are metres in the frame of the right shoulder.

    Args:
        surface: Range of the working surface in x and y.
    """

    def __init__(self, surface: tuple[tuple[float, float], tuple[float, float]]) -> None:
        self._surface = surface
        self._stage: dict[str, Any] = {}
        self._speech: deque[dict[str, Any]] = deque(maxlen=MAX_SPEECH)
        self._rules: dict[str, dict[str, Any]] = {}
        self._objects: dict[str, _Object] = {}
        self._pointed = ("", 0.0)
        self._action = ""
        self._plane: PlaneHomography | None = None
        self._goal: RelocationGoal | None = None
        self._goal_s = 0.0
        self._status: RelocationStatus | None = None
        self._results: deque[dict[str, Any]] = deque(maxlen=MAX_RESULTS)
        self._tracked: TrackedObjects | None = None

    def on_stage(self, stage: ApplicationStage, now_s: float) -> None:
        """Stage of the application."""
        self._stage = {
            "stage": _label(ApplicationStage.Stage, stage.stage),
            "step": stage.step.replace("_", " "),
            "grasps": stage.grasps,
            "retries": stage.retries,
        }

    def on_speech(self, speech: Speech, now_s: float) -> None:
        """Speech of the robot."""
        self._speech.append({"s": round(now_s, 1), "sentence": speech.text})

    def on_rules(self, rules: Rules, now_s: float) -> None:
        """Learned rules."""
        self._rules = {
            rule.object: {"x": rule.x, "y": rule.y, "observations": rule.observations} for rule in rules.rules
        }
        for rule in rules.rules:
            self._objects.setdefault(rule.object, _Object())

    def on_plane(self, message: PlaneCalibration, now_s: float) -> None:
        """Calibration of the table plane; an unusable one is ignored."""
        try:
            self._plane = PlaneHomography.from_message(message)
        except HomographyError:
            self._plane = None

    def on_tracked(self, tracked: TrackedObjects, now_s: float) -> None:
        """Objects that the colour tracker detects now."""
        self._tracked = tracked
        for item in tracked.objects:
            if item.kind == TrackedObject.KIND_OBJECT:
                self._objects.setdefault(item.name, _Object())

    def on_gesture(self, gesture: Gesture, now_s: float) -> None:
        """Something happened on the table."""
        if gesture.kind == Gesture.KIND_POINTED_AT:
            self._pointed = (gesture.object, now_s)
        elif gesture.object and gesture.kind in _GESTURES:
            known = self._objects.setdefault(gesture.object, _Object())
            known.state = _GESTURES[gesture.kind]
            known.detected = (gesture.x, gesture.y) if gesture.located else None
            known.shape = ObjectShape.of(gesture) or known.shape
            if known.state == "stands" and known.shape is not None and known.shape.length:
                known.state = "lies"
            if gesture.located and known.state != "gone":
                known.put = None  # it was detected elsewhere than where the robot put it

    def on_action(self, estimate: ActionEstimate, now_s: float) -> None:
        """What a person's arm does, and where it points."""
        self._action = estimate.detail or _sentence_of(estimate)

    def on_goal(self, goal: RelocationGoal, now_s: float) -> None:
        """Goal of the arm, which is published again until it is acknowledged."""
        if self._goal is None or goal.id != self._goal.id:
            self._goal, self._status, self._goal_s = goal, None, now_s

    def on_goal_status(self, status: RelocationStatus, now_s: float) -> None:
        """Status of the goal."""
        goal = self._goal
        if goal is None or status.goal_id != goal.id:
            return
        ended_before = self._status is not None and self._status.state in _ENDED
        self._status = status
        if status.state not in _ENDED or ended_before:
            return
        if status.state == RelocationStatus.STATE_SUCCEEDED and goal.kind in _PUTS_DOWN and goal.object:
            self._objects.setdefault(goal.object, _Object()).put = (goal.to.x, goal.to.y)
        if goal.kind != RelocationGoal.KIND_REST or status.state != RelocationStatus.STATE_SUCCEEDED:
            self._results.append(
                {
                    "s": round(now_s, 1),
                    "kind": _label(RelocationGoal.Kind, goal.kind),
                    "object": goal.object,
                    "attempt": goal.attempt,
                    "result": _label(RelocationStatus.State, status.state),
                    "reason": status.reason,
                    "took_s": round(now_s - self._goal_s, 1),
                }
            )

    def sections(self, now_s: float) -> dict[str, Any]:
        """The present estimates, by name of the section."""
        return {
            "stage": self._stage,
            "words": list(self._speech),
            "action": self._action,
            "objects": {name: self._object(name) for name in sorted(self._objects)},
            "pointed": self._pointed[0] if now_s - self._pointed[1] < POINTING_DISPLAY_S else "",
            "goal": self._goal_section(),
            "results": list(self._results),
            "tracked": self._tracked_section(),
            "plane": self._plane_section(),
        }

    @property
    def held(self) -> str:
        """Name of the object that the robot holds; "" for none."""
        goal, status = self._goal, self._status
        return goal.object if goal is not None and status is not None and status.holding else ""

    def _object(self, name: str) -> dict[str, Any]:
        known, rule = self._objects[name], self._rules.get(name)
        rests = known.state in ("stands", "lies") and known.shape  # its height is accounted for
        position = (known.detected if rests else None) or self._detected_now(name) or known.detected or known.put
        state = known.state
        if name == self.held:
            position, state = None, IN_HAND
        elif state == "gone" and known.put is not None:  # the hand hid how it was put in
            position, state = known.put, "in an opening"
        elif state == "gone":
            inside = known.detected is not None and self._on_surface(known.detected)
            position, state = (known.detected, "in an opening") if inside else (None, "not in view")
        return {
            "state": state,
            "place": _position_2d(position),
            "size": known.shape and asdict(known.shape),
            "rule": rule and {**rule, "place": _position_2d((rule["x"], rule["y"]))},
        }

    def _detected_now(self, name: str) -> tuple[float, float] | None:
        if self._plane is None or self._tracked is None:
            return None
        for item in self._tracked.objects:
            if item.name == name and item.kind == TrackedObject.KIND_OBJECT:
                try:
                    position = self._plane.plane_from_image(item.u_px, item.v_px)
                except ValueError:  # on the plane's horizon
                    return None
                return position if max(map(abs, position)) < 1.0 else None
        return None

    def _on_surface(self, position: tuple[float, float]) -> bool:
        return all(low <= value <= high for value, (low, high) in zip(position, self._surface, strict=True))

    def _goal_section(self) -> dict[str, Any]:
        goal, status = self._goal, self._status
        if goal is None:
            return {}
        return {
            "kind": _label(RelocationGoal.Kind, goal.kind),
            "object": goal.object,
            "attempt": goal.attempt,
            "from": _position(goal, "from"),
            "to": _position(goal, "to"),
            "state": _label(RelocationStatus.State, status.state) if status is not None else "requested",
            "phase": status.phase if status is not None else "",
            "reason": status.reason if status is not None else "",
            "ended": status is not None and status.state in _ENDED,
        }

    def _tracked_section(self) -> dict[str, Any]:
        if self._tracked is None:
            return {}
        items = [
            {
                "name": item.name,
                "hand": item.kind == TrackedObject.KIND_HAND,
                "box": [round(v, 1) for v in (item.left_px, item.top_px, item.width_px, item.height_px)],
                "outline": [[round(point.u_px, 1), round(point.v_px, 1)] for point in item.outline],
            }
            for item in self._tracked.objects
        ]
        return {"width": self._tracked.width_px, "height": self._tracked.height_px, "items": items}

    def _plane_section(self) -> dict[str, Any]:
        """The calibrated plane: its corners as the robot put an object there, and in the image."""
        plane = self._plane
        if plane is None or plane.correspondences is None:
            return {}
        corners = [[round(float(value), 5) for value in row] for row in plane.correspondences]
        return {"z": plane.plane_z, "corners": corners, "plane_from_image": plane.plane_from_image_matrix.tolist()}


def _sentence_of(estimate: ActionEstimate) -> str:
    likeliest = max(estimate.actions, key=lambda one: one.probability, default=None)
    if likeliest is None:
        return ""
    name, at = likeliest.action.replace("_", " "), estimate.pointed
    off_cm = 100.0 * max(at.x_deviation, at.y_deviation)
    if off_cm > POINTING_KNOWN_CM:
        return f"{name}: it is not known yet where to"
    side = "left" if at.y >= 0.0 else "right"
    return f"{name}: {100.0 * at.x:.0f} cm forward, {100.0 * abs(at.y):.0f} cm to the {side}, ± {off_cm:.1f} cm"


def _position_2d(position: tuple[float, float] | None) -> list[float] | None:
    return None if position is None else [round(position[0], 4), round(position[1], 4)]


def _position(goal: RelocationGoal, field: str) -> list[float] | None:
    if not goal.HasField(field):
        return None
    position: Position = getattr(goal, field)
    return [round(position.x, 4), round(position.y, 4), round(position.z, 4)]
