"""Evaluates a run in which several arms at one table took turns: `run.json`, `report.html`, `tasks.png`, `tasks.mp4`.

Called by the launcher after the run, or by hand: `python -m paramove.runs.hand_over RUN_FOLDER [--no-video]`. All
positions are in the frame of the first arm's base. Exit codes: 0 every object is where the last turn with it should put
it, by the recorded truth; 3 it is not; 66 no such run.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from rich.console import Console

from paramove.documents import Floats
from paramove.robots import RobotDescription
from paramove.runs.after_a_run import evaluated
from paramove.runs.recorded_run import RunFolderError, parameter_in
from paramove.runs.servo_arm import results_of, show_results, truth_in
from paramove.runs.servo_arm_film import FilmedArm, base_of, write_film

MODEL_FILE = "table.mjb"


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    return evaluated("paramove.runs.hand_over", __doc__, {}, _evaluate, arguments)


def _evaluate(options: argparse.Namespace, console: Console) -> tuple[bool, list[Path | None]]:
    folder = options.run_folder
    model = _model_in(folder)
    arms = {
        namespace: FilmedArm(RobotDescription.load(Path(arm["robot"])), truth_in(folder, namespace), f"{namespace}_")
        for namespace, arm in parameter_in(folder, "shared_table", "arms", dict).items()
    }
    first = next(iter(arms.values()))
    tasks = tasks_in_frame_of(first, model, arms, parameter_in(folder, "turn_taker", "turns", list))
    name = " and ".join(dict.fromkeys(arm.robot.name for arm in arms.values()))

    def make_film() -> Path | None:
        return write_film(folder, " and ".join(arms), model, list(arms.values()), console)

    results = results_of(tasks, first.states)
    return show_results(folder, name, results, first.states, None if options.no_video else make_film, console)


def tasks_in_frame_of(
    first: FilmedArm, model: mujoco.MjModel, arms: Mapping[str, FilmedArm], turns: Sequence[Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """What the turns place, in their order, with positions in the frame of one arm's base.

    Reaches are left out: where an arm reached to is in its own states.
    """
    first_from_world = np.empty(3), np.empty(4)
    mujoco.mju_negPose(*first_from_world, *base_of(model, first))
    world_from_arm = {name: base_of(model, arm) for name, arm in arms.items()}
    tasks = []
    for turn in turns:
        for arm, step in turn.items():
            if step.get("place") is not None:
                in_world = {key: _moved(world_from_arm[arm], step[key]) for key in ("pick", "place")}
                tasks.append({key: _moved(first_from_world, position) for key, position in in_world.items()})
    return tasks


def _moved(pose: tuple[Floats, Floats], position: Sequence[float] | Floats) -> Floats:
    """A position [3] after a pose: origin [3] and quaternion [4]."""
    moved = np.empty(3)
    mujoco.mju_trnVecPose(moved, *pose, np.array(position, dtype=float))
    return moved


def _model_in(folder: Path) -> mujoco.MjModel:
    path = folder / MODEL_FILE
    try:
        return mujoco.MjModel.from_binary_path(str(path))
    except ValueError as error:
        raise RunFolderError(f"{path}: no model of the table of a run ({error})") from error


if __name__ == "__main__":
    sys.exit(main())
