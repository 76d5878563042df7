"""How well the robot's own calibration maps image points to positions on its working plane (thesis 5.2.6, step 2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from paramove.bus import topics
from paramove.documents import Floats
from paramove.msgs.gesture_pb2 import Gesture
from paramove.objects import PlaneHomography
from paramove.runs.recorded_run import RecordedRun
from paramove.runs.summary_statistics import summary_statistics

GRID_X = (0.135, 0.190)
GRID_Y = (-0.100, 0.076)
GRID_STEPS = (12, 23)
STANDING = 0.003  # m; an object this near to its standing height rests on the surface
UPRIGHT = 0.99
GOAL_MM = 3.0
"""Largest median error over the working area."""
_AT_REST = (Gesture.KIND_APPEARED, Gesture.KIND_RESTED)


@dataclass(frozen=True, eq=False)
class MappedPoints:
    """True positions and those of the robot's calibration, each [M, 2], m, shoulder frame."""

    true: Floats
    estimated: Floats

    @property
    def errors_mm(self) -> Floats:
        """Distances, [M]."""
        return np.asarray(1e3 * np.linalg.norm(self.estimated - self.true, axis=1))


@dataclass(frozen=True)
class DetectedAtRest:
    """An object that the robot detected at rest, with its true position at that time."""

    time_s: float
    object: str
    true: tuple[float, float]
    estimated: tuple[float, float]

    @property
    def error_mm(self) -> float:
        """Distance."""
        return 1e3 * float(np.hypot(self.estimated[0] - self.true[0], self.estimated[1] - self.true[1]))


def project(layout: Any, points: ArrayLike) -> Floats:
    """Image points [M, 2], px, of world points [M, 3], m, through the true camera and lens.

    distorted = undistorted * (1 + k1 r²), r in focal lengths.
    """
    camera_from_world = np.array(layout.camera_from_world).reshape(4, 4)
    fx, fy, cx, cy, k1 = layout.camera_intrinsics
    world = np.atleast_2d(np.asarray(points, dtype=np.float64))
    camera = world @ camera_from_world[:3, :3].T + camera_from_world[:3, 3]
    undistorted = camera[:, :2] / camera[:, 2:]
    bent = undistorted * (1 + k1 * (undistorted**2).sum(axis=1, keepdims=True))
    return np.asarray(bent * [fx, fy] + [cx, cy])


def grid_error(run: RecordedRun) -> MappedPoints | None:
    """The calibration over a grid of the working area; None if the robot never calibrated."""
    homography = calibration_of(run)
    if homography is None:
        return None
    x, y = np.meshgrid(np.linspace(*GRID_X, GRID_STEPS[0]), np.linspace(*GRID_Y, GRID_STEPS[1]), indexing="ij")
    true = np.stack([x.ravel(), y.ravel()], axis=1)
    half_height = run.truth.half_height_of(homography.object_name)
    height = np.full((len(true), 1), run.truth.surface_z + half_height)
    image = project(run.truth.layout, np.hstack([true, height]) + run.truth.shoulder)
    return MappedPoints(true, np.array([homography.plane_from_image(u, v) for u, v in image]))


def calibration_of(run: RecordedRun) -> PlaneHomography | None:
    """The latest homography that the robot published."""
    calibrations = run.received(topics.CALIBRATION_PLANE)
    return PlaneHomography.from_message(calibrations[-1].message) if calibrations else None


def detected_at_rest(run: RecordedRun) -> list[DetectedAtRest]:
    """Objects reported to have appeared or come to rest that truly stood upright on the surface then."""
    truth = run.truth
    detections = []
    for recorded in run.received(topics.GESTURES):
        gesture = recorded.message
        if gesture.kind not in _AT_REST or not gesture.located or gesture.object not in truth.objects:
            continue
        time_s = run.captured_s(gesture)
        state = truth.at(time_s)
        x, y, z = truth.objects[gesture.object][state]
        stands = (
            abs(z - truth.surface_z - truth.half_height_of(gesture.object)) < STANDING
            and truth.upright[gesture.object][state] > UPRIGHT
        )
        if stands:
            detections.append(DetectedAtRest(time_s, gesture.object, (float(x), float(y)), (gesture.x, gesture.y)))
    return detections


def accuracy_of(run: RecordedRun) -> dict[str, Any]:
    """Seed, errors over the grid, and errors of the objects detected at rest, ready for JSON."""
    grid = grid_error(run)
    grid_mm = grid.errors_mm if grid is not None else np.zeros(0)
    detections = detected_at_rest(run)
    p95 = float(np.percentile(grid_mm, 95)) if grid_mm.size else None
    return {
        "seed": int(run.truth.layout.seed),
        "run_folder": str(run.folder),
        "grid_mm": summary_statistics(grid_mm) | {"p95": p95},
        "seen_at_rest_mm": summary_statistics(item.error_mm for item in detections),
        "seen_at_rest": [
            {
                "time_s": item.time_s,
                "object": item.object,
                "true": list(item.true),
                "estimated": list(item.estimated),
                "error_mm": item.error_mm,
            }
            for item in detections
        ],
    }
