"""Judges a run on its truth alone: who rests where, who touched what, how true the gripper was."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Any

import numpy as np

from paramove.msgs.truth_pb2 import TruthBody, TruthLayout, TruthState

REST_STATES = 15  # one second
REST_DISTANCE = 0.001  # m, moved at most in that time
COMMAND_AT_REST = 1e-6  # m, change of the commanded gripper per state


class Verdict:
    """Takes in the truth of a run, state by state.

    Args:
        layout: Openings and rules.
        begun_ns: When the run began, by its clock.
    """

    def __init__(self, layout: TruthLayout, begun_ns: int = 0) -> None:
        self._layout, self._begun_ns = layout, begun_ns
        self._openings = {item.name: item for item in layout.openings}
        self._sizes = {item.name: (item.width, item.height) for item in layout.objects}
        self._rules = {rule.object: rule.opening for rule in layout.rules}
        self._recent: deque[TruthState] = deque(maxlen=REST_STATES)
        self._errors_mm: list[float] = []
        self._errors_at_rest_mm: list[float] = []
        self._rest_states = 0

    @property
    def states(self) -> int:
        """How many states were taken in."""
        return len(self._errors_mm)

    def take(self, state: TruthState) -> None:
        """One more state, the next in time."""
        gripper, commanded = np.array(state.gripper), np.array(state.gripper_commanded)
        error_mm = 1e3 * float(np.linalg.norm(gripper - commanded))
        if self._recent:
            moved = float(np.linalg.norm(commanded - np.array(self._recent[-1].gripper_commanded)))
            self._rest_states = self._rest_states + 1 if moved < COMMAND_AT_REST else 0
        self._recent.append(state)
        self._errors_mm.append(error_mm)
        if self._rest_states >= 3:
            self._errors_at_rest_mm.append(error_mm)

    def of_object(self, name: str) -> dict[str, Any]:
        """Where the object is in the latest state, and whether the robot put it where it belongs."""
        body = _body(self._recent[-1].objects, name)
        own = self._rules.get(name, "")
        inside = self._opening_of(body)
        at_rest = self._at_rest(name)
        return {
            "opening": own,
            "rests_in": inside,
            "at_rest": at_rest,
            "last_touched_by": body.last_touched_by,
            "position": [round(value, 5) for value in (body.x, body.y, body.z)],
            "success": bool(inside and inside == own and at_rest and body.last_touched_by == "robot"),
        }

    def summary(self) -> dict[str, Any]:
        """Everything judged so far, ready for JSON. Positions in the world frame, m."""
        if not self._recent:
            return {"success": False, "reason": "no state was received", "seed": self._layout.seed}
        last = self._recent[-1]
        objects = {name: self.of_object(name) for name in self._rules}
        return {
            "success": bool(objects) and all(result["success"] for result in objects.values()),
            "placed": sum(result["success"] for result in objects.values()),
            "seed": self._layout.seed,
            "objects": objects,
            "unwanted_contacts": last.unwanted_contacts,
            "deepest_penetration_mm": round(last.deepest_penetration_mm, 4),
            "gripper_error_mm": _spread(self._errors_mm),
            "gripper_error_at_rest_mm": _spread(self._errors_at_rest_mm),
            "simulated_s": round(1e-9 * (last.time_ns - self._begun_ns), 3),
            "states": self.states,
            "layout": {
                "openings": [
                    {"name": item.name, "x": item.x, "y": item.y, "radius": item.radius}
                    for item in self._layout.openings
                ],
                "rules": dict(self._rules),
                "surface_z": self._layout.surface_z,
                "world_from_shoulder": list(self._layout.world_from_shoulder),
                "camera_from_world": list(self._layout.camera_from_world),
                "camera_intrinsics": list(self._layout.camera_intrinsics),
                "light_levels": list(self._layout.light_levels),
                "pixel_noise": self._layout.pixel_noise,
            },
        }

    def _opening_of(self, body: TruthBody) -> str:
        """Name of the opening in whose compartment the object is, wholly below the working plane; "" if in none."""
        if self._top_of(body) >= self._layout.surface_z:
            return ""
        for item in self._openings.values():
            if np.hypot(body.x - item.x, body.y - item.y) < item.radius:
                return str(item.name)
        return ""

    def _top_of(self, body: TruthBody) -> float:
        """Height of the highest point of a cylinder, m; of a block, if it leans along a side."""
        width, height = self._sizes[body.name]
        x, y, _, _ = body.quaternion_xyzw
        upright = abs(1 - 2 * (x * x + y * y))  # of the axis' z component
        lying = np.sqrt(max(0.0, 1 - upright**2))
        return float(body.z + upright * height / 2 + lying * width / 2)

    def _at_rest(self, name: str) -> bool:
        if len(self._recent) < REST_STATES:
            return False
        bodies = [_body(state.objects, name) for state in self._recent]
        points = np.array([(body.x, body.y, body.z) for body in bodies])
        return bool(np.linalg.norm(points - points[-1], axis=1).max() < REST_DISTANCE)


def _body(bodies: Iterable[TruthBody], name: str) -> TruthBody:
    for body in bodies:
        if body.name == name:
            return body
    raise KeyError(f"no object {name!r} in the truth; there are: {', '.join(body.name for body in bodies)}")


def _spread(values: list[float]) -> dict[str, float] | None:
    if not values:
        return None
    return {"median": round(float(np.median(values)), 3), "max": round(max(values), 3), "samples": len(values)}
