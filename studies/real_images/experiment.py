"""The recording replayed for several seeds: by outline and key points, by one of them, with sides exchanged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from paramove.cameras import CalibratedCamera
from paramove.demonstrations import RecordingsError, data_folder
from paramove.documents import InputError
from paramove.observation import BodyKeyPoints
from studies.real_images import seated_person
from studies.real_images.replay import RATE_HZ, ReplayedEstimate, replayed
from studies.real_images.scores import Distances, Reference, distances, network_alone

DATA_SET = "rgbd_pointing"
SEEDS = (0, 1, 2, 3, 4)
EXCHANGED = 0.25
"""Fraction of the frames in which right and left are exchanged, in that case."""


@dataclass(frozen=True)
class Case:
    """One way to replay: pictures a second, whether key points are used, fraction of them with exchanged sides,
    whether the person was measured by hand or from key points."""

    name: str
    rate_hz: float = RATE_HZ
    uses_key_points: bool = True
    exchanged: float = 0.0
    by_hand: bool = True


JUDGED = Case("outline and key points")
OUTLINE = Case("outline alone", uses_key_points=False)
SIDES_EXCHANGED = Case("sides exchanged in a quarter", exchanged=EXCHANGED)
NO_RULER = Case("without a ruler", by_hand=False)
CASES = (
    JUDGED,
    OUTLINE,
    SIDES_EXCHANGED,
    NO_RULER,
    Case("5 Hz assumed", rate_hz=5.0),
    Case("30 Hz assumed", rate_hz=30.0),
)
NETWORK = "network alone"
GOALS: tuple[tuple[str, str, str, float], ...] = (
    (JUDGED.name, "frames 32-50", "median_px", 6.0),
    (JUDGED.name, "frames 43-49", "median_px", 5.0),
    (JUDGED.name, "all frames", "far_frames", 0.0),
    (JUDGED.name, "all frames", "lost_frames", 0.0),
    (SIDES_EXCHANGED.name, "all frames", "far_frames", 2.0),
    (JUDGED.name, "all frames", "hand_cm", 9.0),
    (JUDGED.name, "all frames", "from_shoulder_cm", 8.0),
    (JUDGED.name, "all frames", "direction_deg", 6.0),
    (NO_RULER.name, "all frames", "hand_cm", 10.5),
    (NO_RULER.name, "all frames", "from_shoulder_cm", 8.2),
    (NO_RULER.name, "all frames", "direction_deg", 8.0),
)
"""Case, frames, number, and the most that its mean over the seeds may be."""


@dataclass(frozen=True)
class Replay:
    """One case with one seed: the estimates, and their distances from the reference."""

    case: Case
    seed: int
    estimates: list[ReplayedEstimate]
    distances: Distances


def recording_folder(data: Path | None) -> Path:
    """The recording below the folder of recordings. Raises InputError that names what is missing."""
    try:
        folder = data_folder(data) / DATA_SET
    except RecordingsError as error:
        raise InputError(str(error), missing=True) from error
    if not folder.is_dir():
        raise InputError(f"no recording {folder}: pictures, lens and reference of a seated person expected", True)
    return folder


def run_all(
    folder: Path, key_points: Sequence[BodyKeyPoints], reference: Reference, seeds: Sequence[int] = SEEDS,
    cases: Sequence[Case] = CASES, done: Callable[[str], None] = lambda case: None, models: Path | None = None,
) -> list[Replay]:  # fmt: skip
    """Replays; the reference is compared with each after it has ended. Raises InputError for a recording of no use."""
    camera = seated_person.camera(folder)
    measured = None
    if not all(case.by_hand for case in cases):
        measured = seated_person.without_ruler(camera, key_points, float(reference.shoulder[0, 2]))
    replays = []
    for case in cases:
        for seed in seeds:
            points = exchanged(key_points, case.exchanged, seed) if case.uses_key_points else ()
            estimates = replayed(
                folder,
                points,
                rate_hz=case.rate_hz,
                seed=seed,
                models=models,
                person=None if case.by_hand else measured,
            )
            replays.append(Replay(case, seed, estimates, distances(estimates, reference, camera)))
            done(f"{case.name}, seed {seed}")
    return replays


def exchanged(key_points: Sequence[BodyKeyPoints], fraction: float, seed: int) -> list[BodyKeyPoints]:
    """With right and left exchanged in about that fraction of them."""
    chosen = np.random.default_rng(seed).random(len(key_points)) < fraction
    return [one.exchanged() if swap else one for one, swap in zip(key_points, chosen, strict=True)]


def numbers_of(
    replays: Sequence[Replay], key_points: Sequence[BodyKeyPoints], reference: Reference, camera: CalibratedCamera
) -> dict[str, Any]:
    """All numbers as plain JSON, and whether the means over the seeds meet the goals."""
    frames, cases = len(reference.pixels), {}
    for case in dict.fromkeys(replay.case for replay in replays):
        own = [replay for replay in replays if replay.case == case]
        cases[case.name] = [{"seed": replay.seed, **replay.distances.numbers(frames)} for replay in own]
    cases[NETWORK] = [network_alone(key_points, reference).numbers(frames)]
    cases["hand left on the knee"] = [distances(_at_rest(camera, frames), reference, camera).numbers(frames)]
    goals = [
        {
            "case": case,
            "frames": rows,
            "number": number,
            "goal": goal,
            "mean": mean,
            "met": mean is not None and mean <= goal,
        }
        for case, rows, number, goal in GOALS
        if case in cases
        for mean in [mean_of(cases[case], rows, number)]
    ]
    return {"goals": goals, "met": all(one["met"] for one in goals), "cases": cases}


def mean_of(runs: Sequence[dict[str, Any]], frames: str, number: str) -> float | None:
    """Mean of the seeds; None if one of them has no number."""
    values = [run[frames][number] for run in runs]
    return None if None in values else round(float(np.mean(values)), 1)


def _at_rest(camera: CalibratedCamera, frames: int) -> list[ReplayedEstimate]:
    """An estimate that always stays on the knee: no tracker may do worse."""
    rest = seated_person.resting_pose(camera)
    return [ReplayedEstimate(frame, rest, np.empty((0, 2)), 0.0, np.zeros(2), False) for frame in range(frames)]
