"""`paramove demos`: demonstration sets listed, shown, drawn, labelled, imported, split and synthesized."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from paramove.cli import demos_import
from paramove.cli.movement_options import (
    ActionOption,
    LabelSubjectOption,
    ParametersOption,
    PointOption,
    SetArgument,
    SubjectOption,
    ThetaOption,
    files_below,
    numbers,
    words,
)
from paramove.cli.output import JsonOption, ended, list_of, one_line, table_of
from paramove.documents import checked_name, exit_codes, printable

if TYPE_CHECKING:
    from paramove.demonstrations import DemonstrationSet

app = typer.Typer(
    name="demos", help="List, show, plot, label, import, split and synthesize demonstrations.", no_args_is_help=True
)
app.command("import")(demos_import.import_files)


@app.command("list")
def list_sets(
    folder: Annotated[Path, typer.Argument(help="where to look, three levels deep")] = Path(),
    as_json: JsonOption = False,
) -> None:
    """List the demonstration sets in a folder, by their labels alone.

    Exit codes: 0; 66 there is none; 78 the labels of one are wrong, which is reported.
    """
    from paramove.demonstrations import FILE_NAME

    files = files_below(folder, FILE_NAME)
    if not files:
        raise ended(
            f"no demonstration set in {folder} (a folder with recordings and a {FILE_NAME}); "
            "make one with `paramove demos import` or `paramove demos synthesize`",
            exit_codes.INPUT_MISSING,
        )
    list_of(files, _listed, as_json)


def _listed(file: Path) -> dict[str, Any]:
    from paramove.demonstrations import load_labels

    content = load_labels(file).file
    return {
        "set": str(file.parent),
        "segments": len(content.segments),
        "recordings": len({segment.recording for segment in content.segments}),
        "actions": sorted({segment.action for segment in content.segments}),
        "subjects": sorted({segment.subject for segment in content.segments if segment.subject}),
        "parameters": list(content.parameters),
    }


@app.command()
def show(
    folder: SetArgument,
    segments: Annotated[bool, typer.Option("--segments", help="a line for each movement")] = False,
    as_json: JsonOption = False,
) -> None:
    """Read a whole set, check it, and show what is in it.

    Exit codes: 0; 66 there is no set; 78 something in it cannot be used, with file, line and column.
    """
    with one_line():
        demonstrations = _loaded(folder)
    facts = {
        "set": str(folder),
        "description": demonstrations.description,
        "movements": len(demonstrations),
        "points": list(demonstrations.point_names),
        "frame": demonstrations.frame,
        "parameters": list(demonstrations.parameter_names),
        "groups": _groups(demonstrations),
        "remarks": list(demonstrations.remarks),
    }
    if as_json:
        typer.echo(json.dumps(facts | {"segments": _segments(demonstrations)}, indent=2, ensure_ascii=False))
        return
    for key in ("set", "description", "points", "frame", "parameters"):
        value = facts[key]
        text = ", ".join(value) if isinstance(value, list) else str(value)
        typer.echo(f"{key + ':':<13}{printable(text) or '–'}")
    typer.echo()
    table_of(_segments(demonstrations) if segments else _groups(demonstrations))
    for remark in demonstrations.remarks:
        typer.echo(remark)


def _loaded(folder: Path, action: str | None = None, subject: str | None = None) -> DemonstrationSet:
    from paramove.demonstrations import DemonstrationSet

    loaded = DemonstrationSet.load(folder)
    return loaded if action is None and subject is None else loaded.select(action, subject)


def _groups(demonstrations: DemonstrationSet) -> list[dict[str, Any]]:
    """A row for each action and person."""
    rows = []
    for action, subject in sorted({(movement.action, movement.subject) for movement in demonstrations}):
        chosen = demonstrations.select(action, subject)
        durations = sorted(movement.duration for movement in chosen)
        rows.append(
            {
                "action": action,
                "subject": subject,
                "movements": len(chosen),
                "thetas": len({tuple(movement.theta.tolist()) for movement in chosen}),
                "frames": sum(len(movement.time) for movement in chosen),
                "rate_hz": sorted(movement.rate_hz for movement in chosen)[len(chosen) // 2],
                "shortest_s": durations[0],
                "longest_s": durations[-1],
            }
        )
    return rows


def _segments(demonstrations: DemonstrationSet) -> list[dict[str, Any]]:
    return [
        {
            "recording": movement.recording,
            "action": movement.action,
            "theta": movement.theta.tolist(),
            "subject": movement.subject,
            "repetition": movement.repetition,
            "side": movement.side,
            "frames": len(movement.time),
            "seconds": movement.duration,
        }
        for movement in demonstrations
    ]


@app.command()
def plot(
    folder: SetArgument,
    output: Annotated[Path, typer.Option(metavar="FILE", help="a .png, .svg, .pdf or .html")] = Path("demos.png"),
    action: ActionOption = None,
    subject: SubjectOption = None,
    point: PointOption = None,
    colour_by: Annotated[
        str | None, typer.Option(help="a parameter, or 'action' (default: the parameter that varies most)")
    ] = None,
    body: Annotated[bool, typer.Option("--body", help="in the person's body frame, left arms mirrored")] = False,
) -> None:
    """Draw the paths of a body point in space and its coordinates over time, coloured by a parameter."""
    from paramove.demonstrations import plot_set, write_plot

    with one_line():
        demonstrations = _loaded(folder, action, subject)
        if body:
            demonstrations = demonstrations.in_body_frame().with_right_arms()
        write_plot(
            plot_set(demonstrations, point, colour_by),
            output,
            f"{folder.resolve().name}: {len(demonstrations)} movements",
        )
    typer.echo(str(output))


@app.command()
def label(
    folder: SetArgument,
    recording: Annotated[str, typer.Option(help="file in the folder, such as take_1.mcap")],
    action: Annotated[str, typer.Option(help="what is done, such as reaching")],
    start: Annotated[float | None, typer.Option(min=0.0, help="s from the recording's first pose")] = None,
    end: Annotated[float | None, typer.Option(min=0.0, help="s")] = None,
    find: Annotated[
        bool, typer.Option("--find", help="label every movement: from 3 cm/s before 15 cm/s until below 3 cm/s")
    ] = False,
    theta: ThetaOption = "",
    parameters: ParametersOption = None,
    subject: LabelSubjectOption = "",
    side: Annotated[Literal["right", "left"], typer.Option(help="which arm moves")] = "right",
    point: Annotated[str, typer.Option("--point", help="with --find: the point whose speed counts")] = "index",
) -> None:
    """Add a label to a recording: the movement from --start to --end, or with --find every movement.

    Comments in labels.yaml are preserved; repetitions are counted on. Where there is no labels.yaml, one is made.
    """
    from paramove.demonstrations import FILE_NAME, Segment, load_labels, next_repetition
    from paramove.demonstrations import label as add_labels

    if find == (start is not None or end is not None) or (not find and None in (start, end)):
        raise typer.BadParameter("give both --start and --end, or --find", param_hint="--start")
    values = list(numbers(theta, "--theta"))
    with one_line():
        file = folder / FILE_NAME
        there = list(load_labels(file).file.segments) if file.exists() else []
        checked_name(recording, "recording")
        times = _found_in(folder / recording, point) if find else [(start or 0.0, end or 0.0)]
        added: list[Segment] = []
        for first, last in times:
            segment = _segment(recording, first, last, action, values, subject, side)
            repetition = next_repetition([*there, *added], segment)
            added.append(segment.model_copy(update={"repetition": repetition}))
        add_labels(folder, added, words(parameters))
    for one in added:
        typer.echo(f"{one.recording}, {one.start:g} to {one.end:g} s: {one.action}, repetition {one.repetition}")


def _segment(recording: str, start: float, end: float, action: str, theta: list[float], subject: str, side: str) -> Any:
    from pydantic import ValidationError

    from paramove.demonstrations import DemonstrationError, Segment

    try:
        return Segment(
            recording=recording,
            start=start,
            end=end,
            action=action,
            theta=theta,
            subject=subject,
            side="left" if side == "left" else "right",
        )
    except ValidationError as error:
        first = error.errors()[0]
        raise DemonstrationError(f"{first['loc'][0]} {first['input']!r}: {first['msg']}") from error


def _found_in(recording: Path, point: str) -> list[tuple[float, float]]:
    """Start and end of every movement of a recording, s."""
    from paramove.demonstrations import DemonstrationError, movements_by_speed, read_poses

    poses = read_poses(recording)
    time = poses.time
    movements = movements_by_speed(time, poses.positions, poses.point_names, point)
    if not movements:
        raise DemonstrationError(f"{recording}: {point} never exceeds 15 cm/s; there is no movement to label")
    return [(float(time[first]), float(time[end - 1])) for first, end in movements]


@app.command()
def split(
    folder: SetArgument,
    by: Annotated[
        Literal["movement", "subject", "theta"],
        typer.Option(help="what is not split: nothing, each person, each parameter cell"),
    ] = "movement",
    fraction: Annotated[float, typer.Option(min=0.001, max=0.999, help="fraction for testing")] = 0.25,
    bins: Annotated[
        int | None, typer.Option(min=1, help="with --by theta: cells per parameter (default: one per value)")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="the same seed gives the same split")] = 0,
    train: Annotated[Path | None, typer.Option(metavar="FOLDER", help="default: SET_train")] = None,
    test: Annotated[Path | None, typer.Option(metavar="FOLDER", help="default: SET_test")] = None,
) -> None:
    """Write two sets: movements to train with, and movements to test with."""
    base = folder.resolve()
    goals = (train or base.with_name(f"{base.name}_train"), test or base.with_name(f"{base.name}_test"))
    with one_line():
        _refuse_sets(goals)
        parts = _loaded(folder).split(by, fraction, seed, bins)
        for part, goal in zip(parts, goals, strict=True):
            part.write(goal)
    for part, goal in zip(parts, goals, strict=True):
        typer.echo(f"{goal}: {len(part)} movements")


def _refuse_sets(folders: Sequence[Path]) -> None:
    """Nothing is written if any of the folders holds a set already."""
    from paramove.demonstrations import FILE_NAME, DemonstrationError

    if len({folder.resolve() for folder in folders}) < len(folders):
        raise DemonstrationError("training and test need different folders")
    for folder in folders:
        if (folder / FILE_NAME).exists():
            raise DemonstrationError(f"{folder} holds a demonstration set already; choose another folder")


@app.command()
def synthesize(
    folder: SetArgument,
    action: Annotated[Literal["reaching", "pointing"], typer.Option(help="which movement")] = "reaching",
    columns: Annotated[int, typer.Option(min=1, max=50, help="targets across the table")] = 3,
    rows: Annotated[int, typer.Option(min=1, max=50, help="targets away from the person")] = 3,
    repetitions: Annotated[int, typer.Option(min=1, max=1000, help="movements to each target")] = 4,
    seed: Annotated[int, typer.Option(min=0, help="the same seed gives the same set")] = 0,
    add: Annotated[bool, typer.Option("--add", help="to a set that is there already")] = False,
) -> None:
    """Synthesize a set: a synthetic person reaches for, or points at, a grid of targets over 80 x 30 cm of a table."""
    from paramove.demonstrations import synthetic_takes, write_set

    with one_line():
        takes, names = synthetic_takes(action, columns, rows, repetitions, seed)
        write_set(folder, takes, names, f"synthetic demonstrator, seed {seed}", add=add)
    typer.echo(f"{folder}: {len(takes)} movements ({action}, {columns} x {rows} targets)")
