"""Nine movements are taught in front of one or two cameras, and a model of them reaches new positions."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from paramove.cameras import Board, CalibratedCamera
from paramove.demonstrations import RESTING_SHOULDER, DemonstrationSet, TaughtSet
from paramove.documents import Floats
from paramove.observation import BodyKeyPoints, WebcamTeacher, board_targets
from paramove.phmm import ParametricHMM
from paramove.training import examples_of, train, untrained
from sim.performances_scene import looking
from studies.teaching.simulated_person import RATE_HZ, SIZES, key_points, mean_path, movement

SQUARE_M = 0.03
PLACES = ((0.6, -1.8, 0.8), (1.7, -0.9, 0.75))
"""Of the cameras, m, in the frame of the table: at the right of the person, as one camera stands; in front."""
MEASURED_M, LENGTH_ERROR = 0.02, 0.03
"""Deviations of the person's measures: position of the shoulder, and lengths as a fraction."""
NEW_POSITIONS = 12
SEEDS = (0, 1, 2, 3, 4)
ACTION = "reach"
GOALS_CM = {2: {"end": 1.0, "path": 4.0}, 1: {"end": 2.0, "path": 7.0}}


def cameras(count: int) -> list[CalibratedCamera]:
    """640 x 480 px, looking at the arm."""
    return [camera_at(f"camera_{number}", np.array(place)) for number, place in enumerate(PLACES[:count], start=1)]


def camera_at(name: str, place: Floats) -> CalibratedCamera:
    pose = np.eye(4)
    pose[:3, :3] = looking(np.array([0.0, -0.15, 0.2]) - place)
    pose[:3, 3] = -pose[:3, :3] @ place
    matrix = np.array([[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]])
    return CalibratedCamera(name, 640, 480, matrix, np.zeros(0), pose)


def taught(folder: Path, count: int, seed: int) -> list[str]:
    """A set taught in front of so many cameras; the messages to the person."""
    rng, views = np.random.default_rng(seed), cameras(count)
    targets = board_targets(Board(SQUARE_M).corners())
    known: dict[str, Any] = {}
    if count == 1:
        factor = 1.0 + LENGTH_ERROR * rng.standard_normal(3)
        arm = zip(("upper_arm", "forearm", "hand"), (SIZES.upper_arm, SIZES.forearm, SIZES.hand), factor, strict=True)
        known["sizes"] = replace(SIZES, **{name: size * by for name, size, by in arm})
        known["shoulder"] = RESTING_SHOULDER + MEASURED_M * rng.standard_normal(3)
    written = TaughtSet(folder, ACTION, "simulated", "simulated key points")
    teacher = WebcamTeacher(views, targets, written, rate_hz=RATE_HZ, **known)
    messages, frame = [], 0
    for target in targets.values():
        poses = movement(target, rng)
        tracks = [key_points(poses, camera, rng) for camera in views]
        for now in range(len(poses)):
            frame += 1
            messages += [one for one in _handled(teacher, views, tracks, now, round(frame * 1e9 / RATE_HZ)) if one]
    return messages


def _handled(
    teacher: WebcamTeacher, views: Sequence[CalibratedCamera], tracks: Sequence[Sequence[BodyKeyPoints]], now: int,
    at_ns: int,
) -> list[str]:  # fmt: skip
    pairs = list(zip(views, tracks, strict=True))
    return [teacher.see(camera.name, at_ns, track[now]) for camera, track in pairs]


def trained(folder: Path) -> ParametricHMM:
    """A model of the set as `paramove train` makes it."""
    examples = examples_of(DemonstrationSet.load(folder), action=ACTION)
    description, floor = examples.description(ACTION), examples.floor_deviation
    make = {ACTION: lambda: untrained("best", description=description, floor_deviation=floor)}
    training = train(examples, make, folder / "model.npz")
    training.write()
    return training.trained[0].model


def errors_cm(model: ParametricHMM, seed: int) -> dict[str, float]:
    """Median distance of the fingertip from new positions, and of its path from that of the person; cm."""
    corners = Board(SQUARE_M).corners()
    rng = np.random.default_rng(1000 + seed)
    places = rng.uniform(corners.min(axis=0), corners.max(axis=0), (NEW_POSITIONS, 3))
    assert model.description is not None
    at = 3 * model.description.point_names.index("index")
    ends, paths = [], []
    for place in places:
        path = model.synthesize(place[: len(model.description.parameter_names)], 60)[:, at : at + 3]
        ends.append(np.linalg.norm(path[-1] - place))
        paths.append(np.sqrt(np.mean(np.sum((along(path) - along(mean_path(place, 60))) ** 2, axis=1))))
    return {"end": round(100.0 * float(np.median(ends)), 2), "path": round(100.0 * float(np.median(paths)), 2)}


def along(path: Floats, count: int = 60) -> Floats:
    """The same path (T, 3) at equal distances: where it leads, not how fast."""
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.linspace(0.0, run[-1], count)
    return np.stack([np.interp(at, run, column) for column in path.T], axis=1)


def run(count: int, seed: int) -> dict[str, Any]:
    """One person who teaches, and what the model of it gives."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "set"
        messages = taught(folder, count, seed)
        written = sum(": " in one and "touched" in one for one in messages)
        return {"cameras": count, "seed": seed, "movements": written, **errors_cm(trained(folder), seed)}
