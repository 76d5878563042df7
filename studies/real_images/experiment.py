"""The recording replayed for several seeds, with and without what the thesis lacks, at several assumed rates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from paramove.demonstrations import RecordingsError, data_folder
from paramove.documents import InputError
from studies.real_images import seated_person
from studies.real_images.replay import RATE_HZ, RETARGETED, ReplayedEstimate, replayed
from studies.real_images.scores import GOAL_PX, Distances, distances, is_met, read_reference

DATA_SET = "rgbd_pointing"
SEEDS = (0, 1, 2, 3, 4)


@dataclass(frozen=True)
class Case:
    """One way to replay: pictures a second, and the fraction of particles that are retargeted."""

    name: str
    rate_hz: float = RATE_HZ
    retargeted: float = RETARGETED


JUDGED = Case("as judged: 10 Hz assumed")
CASES = (
    JUDGED,
    Case("no particle is retargeted", retargeted=0.0),
    Case("5 Hz assumed", rate_hz=5.0),
    Case("30 Hz assumed", rate_hz=30.0),
)


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
    folder: Path,
    seeds: Sequence[int] = SEEDS,
    cases: Sequence[Case] = CASES,
    done: Callable[[str], None] = lambda case: None,
    models: Path | None = None,
) -> list[Replay]:
    """Replays; the reference is compared with each after it has ended. Raises InputError for a recording of no use."""
    camera, reference = seated_person.camera(folder), read_reference(folder)
    replays = []
    for case in cases:
        for seed in seeds:
            estimates = replayed(folder, rate_hz=case.rate_hz, retargeted=case.retargeted, seed=seed, models=models)
            replays.append(Replay(case, seed, estimates, distances(estimates, reference, camera)))
            done(f"{case.name}, seed {seed}")
    return replays


def numbers_of(replays: Sequence[Replay]) -> dict[str, Any]:
    """All numbers as plain JSON; the goal is judged on all seeds of the judged case."""
    cases = {}
    for case in dict.fromkeys(replay.case for replay in replays):
        own = [replay for replay in replays if replay.case == case]
        runs = [{"seed": replay.seed, **replay.distances.numbers()} for replay in own]
        cases[case.name] = {
            "rate_hz": case.rate_hz,
            "retargeted": case.retargeted,
            "met": is_met(runs),
            "runs": runs,
        }
    judged = cases[JUDGED.name]
    return {"goal_px": GOAL_PX, "met": judged["met"], "judged": JUDGED.name, "cases": cases}


def resting_numbers(folder: Path) -> dict[str, Any]:
    """The score of an estimate that always stays on the knee: no tracker may do worse."""
    camera, reference = seated_person.camera(folder), read_reference(folder)
    rest = seated_person.resting_pose(camera)
    estimates = [
        ReplayedEstimate(frame, rest, np.empty((0, 2)), 0.0, np.zeros(2), False) for frame in range(len(reference))
    ]
    return distances(estimates, reference, camera).numbers()
