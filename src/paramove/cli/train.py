"""`paramove train`: movement models from demonstrations."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.console import Console
from rich.progress import Progress, TaskID

from paramove.cli.evaluation_io import PROGRESS
from paramove.cli.movement_options import SetArgument, words
from paramove.cli.output import JsonOption, ended, one_line
from paramove.documents import InputError, checked_name, exit_codes, printable
from paramove.training import DEFAULT_FRAMES, DEFAULT_STATES, Kind

if TYPE_CHECKING:
    from paramove.training import Examples, LeftOutBy, Make, Trained, Training

app = typer.Typer(add_completion=False)

FOLDER = Path("models")
LeaveOut = Literal["theta", "subject", "none"]


@app.command()
def train(
    folder: SetArgument,
    model: Annotated[Kind, typer.Option(help="how poses depend on theta; best: what is recommended now")] = "best",
    action: Annotated[str | None, typer.Option(help="only this one (default: all, and a classifier)")] = None,
    parameters: Annotated[
        str | None, typer.Option(metavar="NAMES", help="those that are learned (default: all that vary)")
    ] = None,
    states: Annotated[int, typer.Option(min=1, max=500, help="number of states")] = DEFAULT_STATES,
    d_min: Annotated[int | None, typer.Option("--d-min", min=1, help="minimum frames in a state")] = None,
    d_max: Annotated[int | None, typer.Option("--d-max", min=1, help="maximum frames in a state")] = None,
    frames: Annotated[
        int, typer.Option(min=5, max=2000, help="every movement is resampled to this many")
    ] = DEFAULT_FRAMES,
    residuals: Annotated[
        Literal["correlated", "independent"] | None,
        typer.Option(help="whether whole performances are modelled, or frames as in the thesis"),
    ] = None,
    body: Annotated[bool, typer.Option("--body", help="in the person's body frame, left arms mirrored")] = False,
    leave_out: Annotated[LeaveOut, typer.Option(help="train again without each, and test with it")] = "theta",
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help=".npz, or a folder (default: models/ACTION.npz, models/SET)"),
    ] = None,
    report: Annotated[Path | None, typer.Option(metavar="FILE", help="write a page .html about the training")] = None,
    as_json: JsonOption = False,
) -> None:
    """Train a movement model from a demonstration set; of several actions one each, and a classifier of all.

    The same command again gives the same model and replaces the file. A training that fails leaves an earlier model as
    it is; Ctrl-C leaves no half of one.

    Exit codes: 0; 2 wrong arguments; 66 there is no set; 78 nothing can be learned from it; 130 interrupted.
    """
    from paramove.demonstrations import DemonstrationSet
    from paramove.training import examples_of, untrained

    console = Console(stderr=True, highlight=False, emoji=False, markup=False)
    with one_line():
        demonstrations = DemonstrationSet.load(folder)
        examples = examples_of(
            demonstrations, action=action, parameters=words(parameters), body=body, source=folder.resolve().name
        )
        for remark in examples.remarks:
            console.print(printable(remark), soft_wrap=True)
        goal = _goal(out, folder, examples)
        make: dict[str, Make] = {
            name: partial(
                untrained, model, description=examples.description(name), n_states=states, d_min=d_min,
                d_max=d_max, frames=frames, residuals=residuals, floor_deviation=examples.floor_deviation,
            )
            for name in examples.actions
        }  # fmt: skip
        trained = _trained(examples, make, goal, leave_out, console)
        if report is not None:
            from paramove.training import write_training_report

            report.parent.mkdir(parents=True, exist_ok=True)
            write_training_report(trained, report, examples.remarks)
    _tell(trained, report, as_json)


def _goal(out: Path | None, folder: Path, examples: Examples) -> Path:
    """The file of one model, or the folder of a classifier."""
    several = len(examples.actions) > 1
    if several and out is not None and out.suffix == ".npz":
        raise typer.BadParameter(
            f"several actions ({', '.join(examples.actions)}) go into a folder; or choose one with --action",
            param_hint="--out",
        )
    if several:
        return out or FOLDER / checked_name(folder.resolve().name, "demonstration set")
    name = f"{checked_name(examples.actions[0], 'action')}.npz"
    if out is None:
        return FOLDER / name
    return out if out.suffix == ".npz" else out / name


def _trained(
    examples: Examples, make: dict[str, Make], goal: Path, leave_out: LeaveOut, console: Console
) -> list[Trained]:
    """Trains, checks, and then writes: a training that fails leaves an earlier model as it is.

    An interrupted check leaves the new model, without the result of the check.
    """
    from paramove.training import train as train_models

    written = "nothing was written"
    try:
        with console.status("training: " + ", ".join(examples.actions)):
            training = train_models(examples, make, goal)
        if leave_out != "none":
            try:
                training = _checked(training, make, leave_out, console)
            except KeyboardInterrupt:
                training.write()
                written = f"{goal} was written, but not its accuracy on data that it was not trained with"
                raise
        training.write()
        return list(training.trained)
    except KeyboardInterrupt:
        raise ended(f"interrupted: {written}", exit_codes.CTRL_C) from None
    except InputError:
        raise
    except ValueError as error:
        raise InputError(
            f"nothing can be learned so, and {written}: {_with_points(str(error), examples.point_names)}"
        ) from error


def _checked(training: Training, make: dict[str, Make], leave_out: LeftOutBy, console: Console) -> Training:
    """The training with its cross-validation, whose progress is shown."""
    with Progress(*PROGRESS, console=console, transient=True) as progress:
        tasks: dict[str, TaskID] = {
            one.action: progress.add_task(f"without each {leave_out}: {one.action}", total=None)
            for one in training.trained
        }

        def report(action: str, done: int, total: int) -> None:
            progress.update(tasks[action], completed=done, total=total)

        return training.checked(make, leave_out, report)


def _with_points(message: str, names: tuple[str, ...]) -> str:
    """The message with names of body points for numbers of dimensions."""

    def named(match: re.Match[str]) -> str:
        point, axis = divmod(int(match[1]), 3)
        return f"{names[point]}_{'xyz'[axis]}" if point < len(names) else match[0]

    return re.sub(r"dimension (\d+)", named, message)


def _tell(trained: list[Trained], report: Path | None, as_json: bool) -> None:
    from paramove.training import coverage_warning, sentences

    facts = [one.facts() for one in trained]
    if as_json:
        typer.echo(json.dumps(facts, indent=2, ensure_ascii=False))
        for warning in filter(None, map(coverage_warning, facts)):
            typer.echo(f"warning: {printable(warning)}", err=True)
        return
    for one in facts:
        typer.echo(printable(one["action"]))
        for name, value in sentences(one):
            typer.echo(f"  {name:<22}{printable(value)}")
    if report is not None:
        typer.echo(f"report: {report}")
