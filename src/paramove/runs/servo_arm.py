"""Evaluates a run of a servo arm's tasks: `run.json`, `report.html`, `tasks.png` and `tasks.mp4` in its folder.

Called by the launcher after the run, or by hand: `python -m paramove.runs.servo_arm RUN_FOLDER [--no-video]`.
Exit codes: 0 the arm reached every target and put every object where it belongs, by the recorded truth; 3 it did not;
66 no such run.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from paramove.bus import topics
from paramove.documents import Floats, film, image, report_page, section, table
from paramove.msgs.truth_pb2 import TruthState
from paramove.recording import PartedRecording
from paramove.robots import RobotDescription
from paramove.runs.after_a_run import evaluated, verdict, write_report, write_run_json
from paramove.runs.recorded_run import RunFolderError, parameter_in, robot_in

REACHED_M, PLACED_M = 0.015, 0.010
"""The hand hangs below its commanded position: a servo holds a load by its position error."""


@dataclass(frozen=True)
class TaskResult:
    """One task; positions in the arm's base frame, m.

    Attributes:
        task: "reach" or "place".
        wanted: The target.
        found: Where the end effector came nearest to it, or where the object ended.
        thing: Name of the object; "" of a reach.
        error: Between the two, m.
    """

    task: str
    wanted: tuple[float, ...]
    found: tuple[float, ...]
    thing: str
    error: float

    @property
    def good(self) -> bool:
        """Whether it is near enough."""
        return self.error <= (REACHED_M if self.task == "reach" else PLACED_M)


def results_of(tasks: Sequence[dict[str, Any]], states: Sequence[TruthState]) -> list[TaskResult]:
    """The result of each task. Of an object that several tasks move, the last one counts.

    Raises RunFolderError if an object is to be placed and there is none.
    """
    gripper = np.array([state.gripper for state in states])
    begin, end = (_places(states[at]) for at in (0, -1))
    results: dict[Any, TaskResult] = {}
    for number, task in enumerate(tasks):
        if task.get("reach") is not None:
            target = np.array(task["reach"])
            nearest = gripper[np.argmin(np.linalg.norm(gripper - target, axis=1))]
            results[number] = _result("reach", target, nearest, "")
        else:
            target = np.array(task["place"])
            if not begin:
                raise RunFolderError("the scene has no body with a free joint: there was nothing to pick")
            thing = min(begin, key=lambda name: float(np.linalg.norm(begin[name] - task["pick"])))
            begin[thing] = target
            results[thing] = _result("place", target, end[thing], thing)
    return list(results.values())


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    return evaluated("paramove.runs.servo_arm", __doc__, {}, _evaluate, arguments)


def _evaluate(options: argparse.Namespace, console: Console) -> tuple[bool, list[Path | None]]:
    folder = options.run_folder
    states = truth_in(folder)
    results = results_of(parameter_in(folder, "reacher", "tasks", list), states)
    robot = robot_in(folder)
    if robot is None:
        return show_results(folder, "a servo arm", results, states, None, console)
    from paramove.runs.servo_arm_film import FilmedArm, scene_of, write_film

    description = RobotDescription.load(robot)

    def make_film() -> Path | None:
        return write_film(folder, description.name, scene_of(description), [FilmedArm(description, states)], console)

    return show_results(folder, description.name, results, states, None if options.no_video else make_film, console)


def show_results(
    folder: Path,
    name: str,
    results: Sequence[TaskResult],
    states: Sequence[TruthState],
    make_film: Callable[[], Path | None] | None,
    console: Console,
) -> tuple[bool, list[Path | None]]:
    """Prints results, writes `run.json`, the picture of the paths and the report; whether all is good, and the files.

    Args:
        folder: Of the run.
        name: Of who did the tasks.
        results: In the frame of the states.
        states: Of the world.
        make_film: Makes the film and returns its file; None: there is none.
        console: Where it prints.
    """
    good = sum(one.good for one in results)
    success = good == len(results) > 0
    content = {"success": success, "good": good, "tasks": [{**asdict(one), "good": one.good} for one in results]}
    numbers = write_run_json(folder, content)
    console.print(f"\n{verdict(success)}: {good} of {len(results)} tasks done")
    for one in results:
        what = f"{one.thing or 'hand'} to {_metres(one.wanted)}"
        mark = "" if one.good else "  <- too far"
        console.print(f"  {one.task:6} {what:40} {1e3 * one.error:5.1f} mm away{mark}", markup=False)
    picture = _draw(folder / "tasks.png", results, states)
    video = None if make_film is None else make_film()
    report = _write_report(folder, name, results, picture, video)
    return success, [report, picture, video, numbers]


def truth_in(folder: Path, namespace: str = "") -> list[TruthState]:
    """States of an arm and the things around it, in the recorded truth of a run; raises RunFolderError."""
    recording = PartedRecording(folder / "truth.mcap")
    read = recording.read((topics.name_in(namespace, topics.TRUTH_STATE.name),))
    states = [one.message for one in read if len(one.message.gripper) == 3]
    if states:
        return states
    if not folder.is_dir():
        raise RunFolderError(f"no run folder {folder}")
    if not (folder / "nodes" / "judge.yaml").is_file():
        raise RunFolderError(f"no truth.mcap in {folder}: only emulated runs, which have a node judge, write one")
    raise RunFolderError(f"nothing to judge in {folder}: the run ended before the emulated arm published a state")


def _write_report(folder: Path, robot: str, results: Sequence[TaskResult], picture: Path, video: Path | None) -> Path:
    good = sum(one.good for one in results)
    rows = [
        [one.task, one.thing or "hand", _metres(one.wanted), f"{1e3 * one.error:.1f}",
         "good" if one.good else "too far"]
        for one in results
    ]  # fmt: skip
    title = f"Tasks of {robot}"
    parts = [
        film(video),
        section(
            "Numbers", f"A hand within {1e3 * REACHED_M:.0f} mm of its target and an object within "
            f"{1e3 * PLACED_M:.0f} mm count as there.",
            table(["task", "what", "to", "error, mm", ""], rows, numbers=(3,)),
        ),
        section("Paths", "Crosses are targets.", image(picture.read_bytes(), "paths of the hand and the objects")),
    ]  # fmt: skip
    page = report_page(
        title, title, f"{good} of {len(results)} tasks done", parts, good=good == len(results), style="img{width:100%}"
    )
    return write_report(folder, page)


def _places(state: TruthState) -> dict[str, Floats]:
    return {body.name: np.array([body.x, body.y, body.z]) for body in state.objects}


def _result(task: str, target: Floats, reached: Floats, thing: str) -> TaskResult:
    error = float(np.linalg.norm(reached - target))
    return TaskResult(task, tuple(target.tolist()), tuple(reached.tolist()), thing, error)


def _metres(place: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:.3f}" for value in place) + ") m"


def _draw(path: Path, results: Sequence[TaskResult], states: Sequence[TruthState]) -> Path:
    """From above and from the side: the paths of the hand and the objects, and the targets."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    axes = figure.subplots(1, 2)
    gripper = np.array([state.gripper for state in states])
    paths = {name: np.array([_places(state)[name] for state in states]) for name in _places(states[0])}
    for ax, (across, up), title in zip(axes, ((1, 0), (0, 2)), ("from above", "from the side"), strict=True):
        ax.plot(gripper[:, across], gripper[:, up], color="0.6", linewidth=1, label="hand")
        for number, (name, route) in enumerate(paths.items()):
            colour = _colour(name, number)
            ax.plot(route[:, across], route[:, up], linewidth=2, color=colour, label=_legend(name))
            ax.plot(
                route[-1, across], route[-1, up], "s", color=colour, markersize=5
            )  # an object that did not move has no path
        for one in results:
            ax.plot(one.wanted[across], one.wanted[up], "x", color="black", markersize=9)
        ax.set_xlabel(f"{'xyz'[across]}, m")
        ax.set_ylabel(f"{'xyz'[up]}, m")
        ax.set_title(title)
        ax.set_aspect("equal", adjustable="datalim")  # narrow motions fill the axes too
        ax.margins(0.1)
        ax.locator_params(nbins=5)
    axes[0].invert_xaxis()  # y grows to the left
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=6, frameon=False)
    figure.savefig(path, dpi=110)
    return path


def _colour(name: str, number: int) -> str:
    """The colour that an object's name begins with, such as red_cube; else one of matplotlib's own."""
    from matplotlib.colors import CSS4_COLORS

    first = name.split("_")[0]
    return first if first in CSS4_COLORS else f"C{number % 10}"


def _legend(name: str) -> str:
    return name.replace("_", " ").replace("$", r"\$")  # matplotlib would read formulas between dollars


if __name__ == "__main__":
    sys.exit(main())
