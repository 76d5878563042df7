"""How accurate the robot's calibration and its gripper were.

Calibration: how well it maps image points to positions on the working plane (thesis 5.2.6, step 2). Gripper: its
position when it grasps and when it places (thesis 5.2.7: within 2 mm of the target).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from paramove.bus import topics
from paramove.documents import Floats
from paramove.motion import RelocationOptions
from paramove.msgs.gesture_pb2 import Gesture
from paramove.objects import PlaneHomography
from paramove.robots import RobotDescription
from paramove.runs.recorded_run import RecordedRun
from paramove.runs.relocations import Relocation, motions_of

GRID_X = (0.135, 0.190)
GRID_Y = (-0.100, 0.076)
GRID_STEPS = (12, 23)
STANDING = 0.003  # m; an object this near to its standing height rests on the surface
UPRIGHT = 0.99
GOAL_MM = 3.0
"""Largest median error over the working area."""
Place = tuple[float, float]
"""x, y, m, on the working plane in the right shoulder's frame."""
_AT_REST = (Gesture.KIND_APPEARED, Gesture.KIND_RESTED)


def summary_statistics(values: Iterable[float]) -> dict[str, float | int | None]:
    """Median, largest and number of values; None where there are none."""
    array = np.asarray(list(values), dtype=np.float64)
    if not array.size:
        return {"median": None, "max": None, "samples": 0}
    return {"median": float(np.median(array)), "max": float(array.max()), "samples": int(array.size)}


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
    true: Place
    estimated: Place

    @property
    def error_mm(self) -> float:
        """Distance."""
        return apart_mm(self.true, self.estimated)


def apart_mm(one: Place, other: Place) -> float:
    """Distance of two positions (x, y) in m."""
    return 1e3 * float(np.hypot(other[0] - one[0], other[1] - one[1]))


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
    """The latest calibration over a grid of the working area; None if the robot never calibrated."""
    calibrations = run.received(topics.CALIBRATION_PLANE)
    if not calibrations:
        return None
    homography = PlaneHomography.from_message(calibrations[-1].message)
    x, y = np.meshgrid(np.linspace(*GRID_X, GRID_STEPS[0]), np.linspace(*GRID_Y, GRID_STEPS[1]), indexing="ij")
    true = np.stack([x.ravel(), y.ravel()], axis=1)
    half_height = run.truth.half_height_of(homography.object_name)
    height = np.full((len(true), 1), run.truth.surface_z + half_height)
    image = project(run.truth.layout, np.hstack([true, height]) + run.truth.shoulder)
    return MappedPoints(true, np.array([homography.plane_from_image(u, v) for u, v in image]))


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
        "seen_at_rest": [asdict(item) | {"error_mm": item.error_mm} for item in detections],
    }


@dataclass(frozen=True)
class GripperSample:
    """The gripper at rest, closing or opening the hand.

    Attributes:
        goal_id: Of the goal.
        kind: "grasp" or "place".
        time_s: In the run's time.
        commanded_error_mm: From the target to the gripper by forward kinematics of the commanded integer joint units.
        physical_error_mm: From the commanded gripper to the gripper in the world.
    """

    goal_id: str
    kind: str
    time_s: float
    commanded_error_mm: float
    physical_error_mm: float


def gripper_samples(
    run: RecordedRun, robot: RobotDescription, relocations: Sequence[Relocation]
) -> list[GripperSample]:
    """Every grasp and every placing that the arm reached; none of a robot whose `wire/hoap3/state` is not recorded."""
    states = [r for r in run.received(topics.WIRE_HOAP3_STATE) if len(r.message.target_counts) == robot.n_joints]
    if not states:
        return []
    arm = robot.arm("right")
    times_s = np.array([run.captured_s(r.message) for r in states])
    counts = np.array([list(r.message.target_counts) for r in states])
    points = arm.kinematics.forward(robot.units.to_radians(counts)[:, arm.indices])
    by_id = {relocation.goal.id: relocation for relocation in relocations}
    samples = []
    for motion in motions_of(run):
        relocation = by_id.get(motion.goal_id)
        if relocation is None:
            continue
        phases = {"grasp": "grasp"} | ({"release": "place"} if "place" in motion.phases else {})
        for phase, kind in phases.items():
            middle = motion.middle_of(phase)
            if middle is None:
                continue
            time_s = motion.begun_s + middle
            nearest = int(np.abs(times_s - time_s).argmin())
            commanded, elbow = points.gripper[nearest], points.elbow[nearest]
            target = place_target(relocation) if kind == "place" else grasp_target(relocation.source, commanded, elbow)
            gripper = run.truth.gripper[run.truth.at(time_s)]
            commanded_mm = 1e3 * float(np.linalg.norm(commanded - target))
            physical_mm = 1e3 * float(np.linalg.norm(gripper - commanded))
            samples.append(GripperSample(relocation.goal.id, kind, time_s, commanded_mm, physical_mm))
    return samples


def grasp_target(source: Floats, gripper: Floats, elbow: Floats) -> Floats:
    """Where the gripper closes: next to the object's position, to the right of the forearm (thesis 5.2.5)."""
    forward = (gripper - elbow) * [1.0, 1.0, 0.0]
    forward /= np.linalg.norm(forward)
    right = np.array([forward[1], -forward[0], 0.0])
    return np.asarray(source + RelocationOptions().grasp_aside * right)


def place_target(relocation: Relocation) -> Floats:
    """Where the gripper opens: a little above the target."""
    return np.asarray(relocation.target + np.array([0.0, 0.0, RelocationOptions().release_height]))
